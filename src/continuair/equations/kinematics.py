"""Differential kinematics of a UAV with continuum arms, Eqs. (1)-(7).

q = [x y z φ θ ψ | κ ψa of each section], sections arm by arm from the base out: (6 + 2N,), the
paper's (8,) for one section. Each section is the paper's arm in the axes of its base. These are the
axes of its arm's mount, or those at the end of the section before, carried there without twist.
The arguments arm and section, both counted from 0, choose a section.

Remark 1, Eq. (6), holds throughout: |κ| <= κ_s is replaced by κ_s, the section's parameter
kappa_s. With kappa_s = 0 it is off, and κ = 0 divides by zero.
"""

from __future__ import annotations

from typing import TypeAlias, TypedDict

import numpy as np

from continuair import checks
from continuair.equations.arc import arc_jacobian, arc_position, arc_rotation, arc_tangent
from continuair.equations.turns import Array as Array
from continuair.equations.turns import TipFrame, about_x, about_y, about_z, by_rows, of_quaternion
from continuair.errors import InputError, shown
from continuair.typing import ArrayLike
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle, check_arcs, check_has_arms

Pose: TypeAlias = tuple[Array, Array]
"""Origin (3,) [m] and axes (3, 3) in body axes."""


class TipArguments(TypedDict):
    """The tip of an arm: arc length s [m] on a section of an arm, by their indices."""

    s: float
    arm: int
    section: int


def rotation(q: Array) -> Array:
    """Return the rotation from body to world axes.

    Parameters
    ----------
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m]; those of the UAV alone, (6,), suffice.

    Returns
    -------
    array (3, 3)
        R_B = Rz(ψ) Ry(θ) Rx(φ).

    Raises
    ------
    InputError
        If `q` is not one configuration.

    Notes
    -----
    ZYX Euler angles, Eq. (7) of Amiri et al. (2026).
    """
    _check_one(q)
    return about_z(q[5]) @ about_y(q[4]) @ about_x(q[3])


def euler_rate_matrix(q: Array) -> Array:
    """Return the matrix from Euler rates to angular velocity in world axes.

    Parameters
    ----------
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m]; those of the UAV alone, (6,), suffice.

    Returns
    -------
    array (3, 3)
        T, with ω = T (φ̇, θ̇, ψ̇).

    Raises
    ------
    InputError
        If `q` is not one configuration.

    Notes
    -----
    After Eq. (7) of Amiri et al. (2026). The paper calls T_e the map from Euler rates to angular
    velocity, as here, and yet prints T_e⁻¹ in J_p2 and J_o2. It maps rates only: in J_L = L T_a⁻¹
    J_t, before Eq. (15), the paper also applies it to linear velocity, where a rotation belongs.
    """
    _check_one(q)
    sθ, cθ, sψ, cψ = np.sin(q[4]), np.cos(q[4]), np.sin(q[5]), np.cos(q[5])
    nil, one = 0.0 * sθ, 1.0 + 0.0 * sθ
    return np.array([[cψ * cθ, -sψ, nil], [sψ * cθ, cψ, nil], [-sθ, nil, one]])


def columns_of(vehicle: Vehicle, arm: int = 0, section: int = 0) -> slice:
    """Return the slice of a section's (κ, ψa) in q.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    arm : int, default 0
        Index of the arm.
    section : int, default 0
        Index of the section on the arm, from the base out.

    Returns
    -------
    slice
        Two entries of q.

    Raises
    ------
    InputError
        If there is no such section.
    """
    return _found(vehicle, arm, section)[0]


def bend_of(vehicle: Vehicle, q: Array, arm: int = 0, section: int = 0) -> tuple[Array, Array]:
    """Return (κ, ψa) with Remark 1, Eq. (6): |κ| <= κ_s becomes κ_s, for either sign of κ."""
    check_coordinates("q", q, vehicle)
    where, chain = _found(vehicle, arm, section)
    threshold = chain.section[section].kappa_s
    κ, ψ = q[where]
    return (threshold + 0.0 * κ if abs(κ.real) <= threshold else κ), ψ


def unbounded(vehicle: Vehicle) -> Vehicle:
    """Return the vehicle with Remark 1 switched off: κ_s = 0 in every section."""
    off = {"kappa_s": 0.0}
    arms: Section | tuple[ArmChain, ...]
    if not vehicle.has_arm_list:
        arms = vehicle.arm.having(**off)
    else:
        arms = tuple(
            arm.having(section=tuple(s.having(**off) for s in arm.section)) for arm in vehicle.arms
        )
    return vehicle.having(arm=arms)


def check_coordinates(name: str, value: ArrayLike, vehicle: Vehicle) -> None:
    """Raise InputError unless a value has the shape of one q of the vehicle; it may be complex."""
    check_arcs(vehicle)
    expected = (vehicle.layout.coordinates,)
    if np.shape(value) != expected:
        raise InputError(name, f"has shape {np.shape(value)}", f"give an array of shape {expected}")
    if not checks.means_numbers(value):
        raise InputError(
            name,
            f"is {shown(value)}, which holds a truth value, a masked entry or a unit",
            "give numbers",
        )


def tip_of(vehicle: Vehicle, arm: int = 0) -> TipArguments:
    """Return the position of an arm's tip, as arguments of the functions of kinematics.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    arm : int, default 0
        Index of the arm.

    Returns
    -------
    TipArguments
        Keyword arguments ``s`` [m], ``arm`` and ``section`` of `position`, `jacobian` and others.

    Raises
    ------
    InputError
        If the vehicle has no arms.
    """
    check_has_arms(vehicle)
    sections = vehicle.arms[arm].section
    return {"s": sections[-1].length, "arm": arm, "section": len(sections) - 1}


def arm_position(vehicle: Vehicle, q: Array, s: ArrayLike, arm: int = 0, section: int = 0) -> Array:
    """Return points of a section's backbone in the axes of its base.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array_like (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    s : array_like (...)
        Arc lengths from the section's base [m].
    arm : int, default 0
        Index of the arm.
    section : int, default 0
        Index of the section on the arm, from the base out.

    Returns
    -------
    array (..., 3)
        Points [m]. The axes are body axes for the paper's arm.

    Raises
    ------
    InputError
        If there is no such section, or `q` has another shape.

    Notes
    -----
    F(s, κ, ψa), Eq. (2) of Amiri et al. (2026); see `arc_position`.

    Examples
    --------
    One metre of arm, bent to a quarter circle, ends 2/π m ahead and 2/π m below:

    >>> quarter = [0, 0, 0, 0, 0, 0, np.pi / 2, 0]
    >>> ca.equations.arm_position(ca.load_vehicle("paper"), quarter, [1.0]).round(4).tolist()
    [[0.6366, 0.0, -0.6366]]
    """
    return arc_position(*bend_of(vehicle, q, arm, section), s)


def arm_jacobian(
    vehicle: Vehicle,
    q: Array,
    s: ArrayLike,
    tip_frame: TipFrame = "untwisted",
    arm: int = 0,
    section: int = 0,
) -> tuple[Array, Array]:
    """Return the Jacobians of a section from its (κ̇, ψ̇a), in the axes of its base.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    s : array_like (...)
        Arc lengths from the section's base [m].
    tip_frame : {"untwisted", "frenet"}, default "untwisted"
        Convention of the frame, as in `arc_rotation`.
    arm : int, default 0
        Index of the arm.
    section : int, default 0
        Index of the section on the arm, from the base out.

    Returns
    -------
    J_pa : array (..., 3, 2)
        Linear Jacobian.
    J_oa : array (..., 3, 2)
        Angular Jacobian.

    Raises
    ------
    InputError
        If there is no such section or frame, or `q` has another shape.

    Notes
    -----
    Eqs. (3) and (5) and Appendix A of Amiri et al. (2026); see `arc_jacobian`.
    """
    return arc_jacobian(*bend_of(vehicle, q, arm, section), s, tip_frame)


def section_bases(vehicle: Vehicle, q: Array, arm: int = 0, section: int = 0) -> list[Pose]:
    """Return the poses in body axes of the bases of an arm's sections up to one, inclusive.

    The first is the mount's; each section adds a transform. A section hangs along -z of its base.
    """
    _, chain = _found(vehicle, arm, section)
    origin, axes = np.asarray(chain.mount), of_quaternion(chain.attitude)
    found = [(origin, axes)]
    for index in range(section):
        bend, length = bend_of(vehicle, q, arm, index), chain.section[index].length
        origin = origin + axes @ arc_position(*bend, length)
        axes = axes @ arc_rotation(*bend, length)
        found.append((origin, axes))
    return found


def position(vehicle: Vehicle, q: Array, s: ArrayLike, arm: int = 0, section: int = 0) -> Array:
    """Return backbone points in the world.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    s : array_like (...)
        Arc lengths from 0 to the section's length [m].
    arm : int, default 0
        Index of the arm.
    section : int, default 0
        Index of the section on the arm, from the base out.

    Returns
    -------
    array (..., 3)
        Points in world axes [m].

    Raises
    ------
    InputError
        If there is no such section, or `q` has another shape.

    Notes
    -----
    Eq. (1) of Amiri et al. (2026), with the mount P_o.
    """
    base = section_bases(vehicle, q, arm, section)[-1]
    return q[:3] + _carried(base, arm_position(vehicle, q, s, arm, section)) @ rotation(q).T


def section_rotation(
    vehicle: Vehicle,
    q: Array,
    s: ArrayLike,
    tip_frame: TipFrame = "untwisted",
    arm: int = 0,
    section: int = 0,
) -> Array:
    """Return the rotation from a section's frames to body axes.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    s : array_like (...)
        Arc lengths from the section's base [m].
    tip_frame : {"untwisted", "frenet"}, default "untwisted"
        Convention of the frame, see Notes.
    arm : int, default 0
        Index of the arm.
    section : int, default 0
        Index of the section on the arm, from the base out.

    Returns
    -------
    array (..., 3, 3)
        R_s, with z along the tangent, away from the UAV.

    Raises
    ------
    InputError
        If there is no such section or frame, or `q` has another shape.

    Notes
    -----
    In axes of the section's base, "untwisted" is Rz(ψa) Ry(-κs) Rz(-ψa) diag(1, -1, -1), the frame
    of a tendon-driven arm. "frenet" omits Rz(-ψa): the frame of Eq. (5) of Amiri et al. (2026),
    which turns with ψa.
    """
    bent = arc_rotation(*bend_of(vehicle, q, arm, section), s, tip_frame)
    _, axes = section_bases(vehicle, q, arm, section)[-1]
    return axes @ bent @ np.diag([1.0, -1.0, -1.0])


def tangents(vehicle: Vehicle, q: Array, s: Array, arm: int = 0, section: int = 0) -> Array:
    """Return unit tangents (..., 3) in world axes, away from the UAV; s: arc lengths (...) [m]."""
    _, axes = section_bases(vehicle, q, arm, section)[-1]
    return arc_tangent(*bend_of(vehicle, q, arm, section), s) @ axes.T @ rotation(q).T


def jacobian(
    vehicle: Vehicle,
    q: Array,
    s: ArrayLike,
    tip_frame: TipFrame = "untwisted",
    arm: int = 0,
    section: int = 0,
) -> Array:
    """Return the Jacobian from q̇ to the velocity of backbone points.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    s : array_like (...)
        Arc lengths from 0 to the section's length [m].
    tip_frame : {"untwisted", "frenet"}, default "untwisted"
        Convention of the frame, as in `section_rotation`.
    arm : int, default 0
        Index of the arm.
    section : int, default 0
        Index of the section on the arm, from the base out.

    Returns
    -------
    array (..., 6, 6 + 2N)
        Linear rows, then angular rows, in world axes.

    Raises
    ------
    InputError
        If there is no such section or frame, or `q` has another shape.

    Notes
    -----
    Before Eq. (8) of Amiri et al. (2026): J_p = [1, -[R P_s]× T, R J_pa] and J_o = [0, T, R J_oa].
    The paper prints T_e⁻¹ for T (`euler_rate_matrix`), J_p3 for J_o3, and other columns of J_oa
    (`arc_jacobian`). Other arms, and sections further out, have zero columns.
    """
    s = np.asarray(s, float)
    R, T = rotation(q), euler_rate_matrix(q)
    bases = section_bases(vehicle, q, arm, section)
    at = _carried(bases[-1], arm_position(vehicle, q, s, arm, section))
    J = np.zeros((*s.shape, 6, len(q)), dtype=np.result_type(q, float))
    J[..., :3, :3] = np.eye(3)
    J[..., :3, 3:6] = -skew(at @ R.T) @ T
    J[..., 3:, 3:6] = T
    for index, (_, axes) in enumerate(bases):
        where, chain = _found(vehicle, arm, index)
        here = index == section
        end = s if here else chain.section[index].length
        frame: TipFrame = tip_frame if here else "untwisted"
        J_pa, J_oa = (axes @ X for X in arm_jacobian(vehicle, q, end, frame, arm, index))
        if not here:
            # A section carries what lies beyond its end.
            J_pa = J_pa - skew(at - bases[index + 1][0]) @ J_oa
        J[..., :3, where], J[..., 3:, where] = R @ J_pa, R @ J_oa
    return J


def skew(v: Array) -> Array:
    """Return the matrices of the cross product with vectors.

    Parameters
    ----------
    v : array (..., 3)
        Vectors.

    Returns
    -------
    array (..., 3, 3)
        [v]×, with [v]× w = v × w.
    """
    x, y, z = np.moveaxis(v, -1, 0)
    nil = 0.0 * x
    return by_rows([nil, -z, y], [z, nil, -x], [-y, x, nil])


def _check_one(q: ArrayLike) -> None:
    """Raise InputError unless q is one configuration; (6,), of the UAV alone, suffices."""
    shape = np.shape(q)
    if len(shape) != 1 or shape[0] < 6 or shape[0] % 2:
        raise InputError(
            "q",
            f"has shape {shape}",
            (
                "give one configuration, (8,) for one section and 2 more numbers for each "
                "further one"
            ),
        )


def _carried(base: Pose, points: Array) -> Array:
    """Return points (..., 3) of a section, given in axes of its base, in body axes."""
    origin, axes = base
    return origin + points @ axes.T


def _found(vehicle: Vehicle, arm: int, section: int) -> tuple[slice, ArmChain]:
    """Return the slice of a section's (κ, ψa) in q, and its arm."""
    arms = vehicle.arms
    if not 0 <= arm < len(arms):
        raise InputError(
            "arm", f"is {shown(arm)}", f"give a whole number from 0 to {len(arms) - 1}"
        )
    chain = arms[arm]
    if not 0 <= section < len(chain.section):
        highest = len(chain.section) - 1
        raise InputError(
            "section", f"is {shown(section)}", f"give a whole number from 0 to {highest}"
        )
    first = sum(len(each.section) for each in arms[:arm])
    return vehicle.layout.polar_of(first + section), chain
