"""Differential kinematics of a UAV with continuum arms, Eqs. (1)-(7).

q = [x y z φ θ ψ | κ ψa of each section], sections arm by arm from the base out: (6 + 2N,), the
paper's (8,) for one section. Each section is the paper's arm in the axes of its base: those of its
arm's mount, or of the end of the section before, carried there without twist. arm and section say
which one is meant, both counted from 0.

Remark 1, Eq. (6), holds throughout: |κ| <= κ_s counts as κ_s, the section's parameter kappa_s; 0
switches it off, and then κ = 0 divides by zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair import checks
from continuair.equations.arc import arc_jacobian, arc_position, arc_rotation, arc_tangent
from continuair.equations.turns import Array as Array
from continuair.equations.turns import about_x, about_y, about_z, by_rows, of_quaternion
from continuair.errors import InputError, shown
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle, check_has_arms

Pose = tuple[Array, Array]
"""Origin (3,) [m] and axes (3, 3) in body axes."""


def rotation(q: Array) -> Array:
    """R_B: body to world, (3, 3), of the ZYX Euler angles of q, Eq. (7): Rz(ψ) Ry(θ) Rx(φ).

    Raises InputError unless q is one configuration.
    """
    _check_one(q)
    return about_z(q[5]) @ about_y(q[4]) @ about_x(q[3])


def euler_rate_matrix(q: Array) -> Array:
    """T, (3, 3): Euler rates (φ̇, θ̇, ψ̇) to angular velocity in world axes; after Eq. (7).

    The paper calls T_e the map from Euler rates to angular velocity, as here, and yet prints T_e⁻¹
    in J_p2 and J_o2. (It is of rates only: in J_L = L T_a⁻¹ J_t, before Eq. (15), the paper also
    applies it to linear velocity, where a rotation belongs.) Raises InputError unless q is one
    configuration.
    """
    _check_one(q)
    sθ, cθ, sψ, cψ = np.sin(q[4]), np.cos(q[4]), np.sin(q[5]), np.cos(q[5])
    nil, one = 0.0 * sθ, 1.0 + 0.0 * sθ
    return np.array([[cψ * cθ, -sψ, nil], [sψ * cθ, cψ, nil], [-sθ, nil, one]])


def columns_of(vehicle: Vehicle, arm: int = 0, section: int = 0) -> slice:
    """Where (κ, ψa) of a section are in q; InputError if there is no such section."""
    return _found(vehicle, arm, section)[0]


def bend_of(vehicle: Vehicle, q: Array, arm: int = 0, section: int = 0) -> tuple[Any, Any]:
    """(κ, ψa) with Remark 1, Eq. (6): |κ| <= κ_s counts as κ_s, whatever the sign of κ."""
    check_coordinates("q", q, vehicle)
    where, chain = _found(vehicle, arm, section)
    threshold = chain.section[section].kappa_s
    κ, ψ = q[where]
    return (threshold + 0.0 * κ if abs(κ.real) <= threshold else κ), ψ


def unbounded(vehicle: Vehicle) -> Vehicle:
    """The vehicle with Remark 1 switched off: κ_s = 0 in every section."""
    off = {"kappa_s": 0.0}
    arms: Section | tuple[ArmChain, ...]
    if not vehicle.has_arm_list:
        arms = vehicle.arm.having(**off)
    else:
        arms = tuple(
            arm.having(section=tuple(s.having(**off) for s in arm.section)) for arm in vehicle.arms
        )
    return vehicle.having(arm=arms)


def check_coordinates(name: str, value: Any, vehicle: Vehicle) -> None:
    """Raise InputError unless a value has the shape of one q of the vehicle; it may be complex."""
    expected = (vehicle.layout.coordinates,)
    if np.shape(value) != expected:
        raise InputError(f"{name} has shape {np.shape(value)}; give an array of shape {expected}.")
    if not checks.means_numbers(value):
        raise InputError(
            f"{name} is {shown(value)}, which holds a truth value, a masked entry or a unit; give "
            "numbers."
        )


def tip_of(vehicle: Vehicle, arm: int = 0) -> dict[str, Any]:
    """Where an arm's tip is, as s, arm and section of the functions below."""
    check_has_arms(vehicle)
    sections = vehicle.arms[arm].section
    return {"s": sections[-1].length, "arm": arm, "section": len(sections) - 1}


def arm_position(vehicle: Vehicle, q: Array, s: Any, arm: int = 0, section: int = 0) -> Array:
    """F(s, κ, ψa), Eq. (2), of a section: points (..., 3) in the axes of its base [m].

    s: arc lengths (...) [m]. Those are body axes for the paper's arm; formula in `arc_position`.

    A metre of arm that is bent to a quarter circle ends 2/π m ahead and as much below:

    >>> quarter = [0, 0, 0, 0, 0, 0, np.pi / 2, 0]
    >>> ca.equations.arm_position(ca.load_vehicle("paper"), quarter, [1.0]).round(4).tolist()
    [[0.6366, 0.0, -0.6366]]
    """
    return arc_position(*bend_of(vehicle, q, arm, section), s)


def arm_jacobian(
    vehicle: Vehicle,
    q: Array,
    s: Any,
    tip_frame: str = "untwisted",
    arm: int = 0,
    section: int = 0,
) -> tuple[Array, Array]:
    """J_pa (Eq. (3), Appendix A) and J_oa (Eq. (5)) of a section, (..., 3, 2), in its base's axes.

    s: arc lengths (...) [m]. For the section's own (κ̇, ψ̇a); formulas in `arc_jacobian`.
    """
    return arc_jacobian(*bend_of(vehicle, q, arm, section), s, tip_frame)


def section_bases(vehicle: Vehicle, q: Array, arm: int = 0, section: int = 0) -> list[Pose]:
    """Poses in body axes of the bases of an arm's sections up to one, that one included.

    The mount's, times a transform per section in between. A section hangs along -z of its base.
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


def position(vehicle: Vehicle, q: Array, s: Any, arm: int = 0, section: int = 0) -> Array:
    """Backbone points (..., 3) in the world [m]: Eq. (1), mount P_o included, carried there by q.

    s: arc lengths (...) from 0 to the section's length [m].
    """
    base = section_bases(vehicle, q, arm, section)[-1]
    return q[:3] + _carried(base, arm_position(vehicle, q, s, arm, section)) @ rotation(q).T


def section_rotation(
    vehicle: Vehicle,
    q: Array,
    s: Any,
    tip_frame: str = "untwisted",
    arm: int = 0,
    section: int = 0,
) -> Array:
    """R_s: section frames at s to body, (..., 3, 3), z along the tangent, away from the UAV.

    s: arc lengths (...) [m]. tip_frame: "untwisted" is Rz(ψa) Ry(-κs) Rz(-ψa) diag(1, -1, -1), what
    a tendon-driven arm does, in axes of the section's base; "frenet" is without Rz(-ψa), the frame
    of the paper's Eq. (5), which spins with ψa. Raises InputError for any other frame.
    """
    bent = arc_rotation(*bend_of(vehicle, q, arm, section), s, tip_frame)
    _, axes = section_bases(vehicle, q, arm, section)[-1]
    return axes @ bent @ np.diag([1.0, -1.0, -1.0])


def tangents(vehicle: Vehicle, q: Array, s: Any, arm: int = 0, section: int = 0) -> Array:
    """Unit tangents (..., 3) in world axes, away from the UAV; s: arc lengths (...) [m]."""
    _, axes = section_bases(vehicle, q, arm, section)[-1]
    return arc_tangent(*bend_of(vehicle, q, arm, section), s) @ axes.T @ rotation(q).T


def jacobian(
    vehicle: Vehicle,
    q: Array,
    s: Any,
    tip_frame: str = "untwisted",
    arm: int = 0,
    section: int = 0,
) -> Array:
    """J (..., 6, 6 + 2N): linear rows, then angular rows, in world axes, at s; before Eq. (8).

    s: arc lengths (...) from 0 to the section's length [m].

    J_p = [1, -[R P_s]× T, R J_pa] and J_o = [0, T, R J_oa], where the paper prints T_e⁻¹ for T
    (`euler_rate_matrix`), J_p3 for J_o3, and other columns of J_oa (`arc_jacobian`). Other arms,
    and sections further out, move nothing here. Raises InputError for an unknown frame or section.
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
        end, frame = (s, tip_frame) if here else (chain.section[index].length, "untwisted")
        J_pa, J_oa = (axes @ X for X in arm_jacobian(vehicle, q, end, frame, arm, index))
        if not here:
            # A section carries what lies beyond its end.
            J_pa = J_pa - skew(at - bases[index + 1][0]) @ J_oa
        J[..., :3, where], J[..., 3:, where] = R @ J_pa, R @ J_oa
    return J


def skew(v: Array) -> Array:
    """[v]×, (..., 3, 3), of vectors (..., 3)."""
    x, y, z = np.moveaxis(v, -1, 0)
    nil = 0.0 * x
    return by_rows([nil, -z, y], [z, nil, -x], [-y, x, nil])


def _check_one(q: Any) -> None:
    """Raise InputError unless q is one configuration; the UAV's own (6,) will do."""
    shape = np.shape(q)
    if len(shape) != 1 or shape[0] < 6 or shape[0] % 2:
        raise InputError(
            f"q has shape {shape}; give one configuration, (8,) for one section and 2 more numbers "
            "for each further one."
        )


def _carried(base: Pose, points: Array) -> Array:
    """Points (..., 3) of a section, in axes of its base, in body axes."""
    origin, axes = base
    return origin + points @ axes.T


def _found(vehicle: Vehicle, arm: int, section: int) -> tuple[slice, ArmChain]:
    """Where (κ, ψa) of a section are in q, and its arm."""
    arms = vehicle.arms
    if not 0 <= arm < len(arms):
        raise InputError(f"arm is {shown(arm)}; give a whole number from 0 to {len(arms) - 1}.")
    chain = arms[arm]
    if not 0 <= section < len(chain.section):
        highest = len(chain.section) - 1
        raise InputError(f"section is {shown(section)}; give a whole number from 0 to {highest}.")
    first = sum(len(each.section) for each in arms[:arm])
    return vehicle.layout.polar_of(first + section), chain
