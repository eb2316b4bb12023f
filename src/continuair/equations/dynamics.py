"""Euler-Lagrange dynamics, Eqs. (8)-(10): M q̈ + C q̇ + G = τ - J_tᵀ F_e, with masks on M and C.

Remark 1 concerns the kinematics: below κ_s, the masses and their weight use κ_s for κ. The spring
and the damper, which are regular there, use the actual bend.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, TypeAlias

import numpy as np

from continuair import checks
from continuair.equations.kinematics import Array, check_coordinates, columns_of, jacobian, tip_of
from continuair.equations.masses import mass_matrix, mass_times_height, weight_vector
from continuair.errors import InputError, shown
from continuair.typing import ArrayLike
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

Mask: TypeAlias = Literal["coupled", "block", "diagonal"] | ArrayLike
"""Factors of M and C, by name or as an array."""

_COMPLEX_STEP = 1e-30


def masks(coordinates: int) -> dict[str, Array]:
    """Return the factors of M and C that make up each dynamic model.

    Parameters
    ----------
    coordinates : int
        Number of coordinates, 6 + 2N for N sections.

    Returns
    -------
    dict of str to array (coordinates, coordinates)
        "coupled": all ones. "block": one block of the UAV and one of all arms ("decoupled" in the
        paper). "diagonal": the diagonal.
    """
    of_uav = np.arange(coordinates) < 6
    blocks = (of_uav[:, None] == of_uav).astype(float)
    return {
        "coupled": np.ones((coordinates, coordinates)),
        "block": blocks,
        "diagonal": np.eye(coordinates),
    }


MASKS: dict[str, Array] = masks(8)
"""Those of the paper's eight coordinates."""


def coriolis_matrix(vehicle: Vehicle, q: Array, qd: Array, nodes: int = 24) -> Array:
    """Return the Coriolis matrix from the Christoffel symbols of the mass matrix.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    qd : array (6 + 2N,)
        Their rates.
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    array (6 + 2N, 6 + 2N)
        C.

    Raises
    ------
    InputError
        If `q` or `qd` has another shape.

    Notes
    -----
    C of Eq. (10), Amiri et al. (2026): C_ij = Σ ½ (∂_k M_ij + ∂_j M_ik - ∂_i M_jk) q̇_k. The paper
    does not print its C; this one makes Ṁ - 2C skew. Where abs(κ) <= κ_s, M does not change with κ,
    and its derivatives with respect to κ are 0. Set kappa_s = 0 to switch Remark 1 off near
    straight.
    """
    check_coordinates("q", q, vehicle)
    check_coordinates("qd", qd, vehicle)
    dM = _mass_slopes(vehicle, np.asarray(q, float), nodes)
    return 0.5 * (
        np.einsum("kij,k->ij", dM, qd)
        + np.einsum("jik,k->ij", dM, qd)
        - np.einsum("ijk,k->ij", dM, qd)
    )


def elastic_vector(vehicle: Vehicle, q: Array) -> Array:
    """Return the elastic part of G.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].

    Returns
    -------
    array (6 + 2N,)
        E I l κ at each κ [N m²], 0 elsewhere.

    Raises
    ------
    InputError
        If `q` has another shape.

    Notes
    -----
    The derivative of ½ E I l κ². It is not in Amiri et al. (2026).
    """
    check_coordinates("q", q, vehicle)
    G = np.zeros(len(q))
    for where, section in _bends(vehicle):
        G[where] = section.bending_stiffness * section.length * q[where.start], 0.0
    return G


def gravity_vector(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Array:
    """Return the derivative of the potential energy, of gravity and elasticity.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    gravity : float, default 9.81
        Gravitational acceleration, downwards [m/s²].
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    array (6 + 2N,)
        G.

    Raises
    ------
    InputError
        If `q` has another shape.

    Notes
    -----
    G of Eq. (10), from Eq. (9) of Amiri et al. (2026). The paper calls it the gravity matrix;
    without elasticity, E would have no effect.
    """
    return weight_vector(vehicle, q, gravity, nodes) + elastic_vector(vehicle, q)


def damping_vector(vehicle: Vehicle, q: Array, qd: Array) -> Array:
    """Return the structural damping, to be added on the left of Eq. (10).

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    qd : array (6 + 2N,)
        Their rates.

    Returns
    -------
    array (6 + 2N,)
        Generalised damping forces [N m² at κ, N m at ψa], 0 for the UAV.

    Raises
    ------
    InputError
        If `q` or `qd` has another shape.

    Notes
    -----
    Eq. (10) of Amiri et al. (2026) has no damping. The generalised force -d l k̇ on the bend vector
    is -d l (κ̇, κ² ψ̇a) in polar coordinates.
    """
    check_coordinates("q", q, vehicle)
    check_coordinates("qd", qd, vehicle)
    D = np.zeros(len(q))
    for where, section in _bends(vehicle):
        d = section.structural_damping * section.length
        κ, (κ_rate, ψ_rate) = q[where.start], qd[where]
        D[where] = d * κ_rate, d * κ**2 * ψ_rate
    return D


def kinetic_energy(
    vehicle: Vehicle, q: Array, qd: Array, mask: Mask = "coupled", nodes: int = 24
) -> float:
    """Return the kinetic energy of the masked mass matrix.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    qd : array (6 + 2N,)
        Their rates.
    mask : {"coupled", "block", "diagonal"} or array (6 + 2N, 6 + 2N), default "coupled"
        Factors of M, as in `forward_dynamics`.
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    float
        Energy ½ q̇ᵀ M q̇ [J].

    Raises
    ------
    InputError
        If the mask is unknown, or a shape differs.

    Notes
    -----
    Eq. (8) of Amiri et al. (2026). Where abs(κ) <= κ_s, M is that of κ_s, as Remark 1 is printed,
    but ψ̇a is not adapted: the energy differs near straight. Set kappa_s = 0 to switch Remark 1
    off.
    """
    M = masked(mask, len(q)) * mass_matrix(vehicle, q, nodes)
    return float(0.5 * np.asarray(qd) @ M @ qd)


def potential_energy(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> float:
    """Return the energy of gravity and elasticity.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    gravity : float, default 9.81
        Gravitational acceleration, downwards [m/s²].
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    float or complex
        Potential energy [J], complex for complex `q`; that of gravity is 0 at world z = 0.

    Raises
    ------
    InputError
        If `q` has another shape.

    Notes
    -----
    Eq. (9) of Amiri et al. (2026), and ½ E I l κ² of each section.
    """
    energy = gravity * mass_times_height(vehicle, q, nodes)
    for where, section in _bends(vehicle):
        energy = energy + 0.5 * section.bending_stiffness * section.length * q[where.start] ** 2
    return energy


def forward_dynamics(
    vehicle: Vehicle,
    q: Array,
    qd: Array,
    tau: ArrayLike = 0.0,
    tip_wrench: ArrayLike = 0.0,
    *,
    mask: Mask = "coupled",
    tip_wrench_sign: int = 1,
    gravity: float = 9.81,
    nodes: int = 24,
) -> Array:
    """Return the accelerations of the paper's coordinates.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch) without drag or terms of its own.
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m], (8,) for one section.
    qd : array (6 + 2N,)
        Their rates.
    tau : array_like (6 + 2N,) or 0, default 0
        Generalised forces conjugate to q: force in world axes [N], torques conjugate to the Euler
        angles [N m], and for each section Q_κ [N m²; the paper says N m] and Q_ψa [N m].
    tip_wrench : array_like (6 arms,) or 0, default 0
        Force [N] and moment [N m] at each arm's tip in turn, in world axes, through the untwisted
        J_t.
    mask : {"coupled", "block", "diagonal"} or array_like (6 + 2N, 6 + 2N), default "coupled"
        Factors of M and C; see Notes. G and external forces have none.
    tip_wrench_sign : {1, -1}, default 1
        1: the wrench acts on the tip. -1: the paper's -J_tᵀ F_e.
    gravity : float, default 9.81
        Gravitational acceleration, downwards [m/s²].
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    array (6 + 2N,)
        Accelerations q̈.

    Raises
    ------
    InputError
        If the mask is unknown, a shape differs, or the vehicle has drag, which Eq. (10) lacks.

    Notes
    -----
    Eq. (10) of Amiri et al. (2026), with structural damping. "block" is the paper's decoupled
    model: its "off-diagonal elements" set to zero are read as the blocks between UAV (6) and arms
    (2N). "diagonal" reads them element by element. Where abs(κ) <= κ_s, M, C and J_t are those of
    κ_s, as Remark 1 is printed, but q̇ is not adapted. Near straight, set kappa_s = 0 or use
    `accelerations`.
    """
    check_without_drag(vehicle)
    arms, n = len(vehicle.arms), vehicle.layout.coordinates
    kept = masked(mask, n)
    q, qd = of_shape("q", q, (n,)), of_shape("qd", qd, (n,))
    tau = of_shape("tau", tau, (n,), or_zero=True)
    F = tip_wrench_sign * of_shape("tip_wrench", tip_wrench, (6 * arms,), or_zero=True)
    M = kept * mass_matrix(vehicle, q, nodes)
    C = kept * coriolis_matrix(vehicle, q, qd, nodes)
    G = gravity_vector(vehicle, q, gravity, nodes)
    tips = [jacobian(vehicle, q, **tip_of(vehicle, arm)) for arm in range(arms)]
    J_t = np.vstack([np.zeros((0, n)), *tips])
    pushed = tau + J_t.T @ F
    return np.linalg.solve(M, pushed - C @ qd - G - damping_vector(vehicle, q, qd))


def check_without_drag(vehicle: Vehicle) -> None:
    """Raise InputError for a vehicle with drag or terms of its own, which Eq. (10) lacks.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle to check.

    Raises
    ------
    InputError
        If it has drag on the UAV or a section, tendons, or terms of its own.
    """
    if vehicle.terms:
        raise InputError(
            "vehicle",
            (
                f"{shown(vehicle.name)} has the term {type(vehicle.terms[0]).__name__}, "
                "which Eq. (10) lacks"
            ),
            "leave it out, or use continuair.accelerations",
        )
    if vehicle.tendons:
        raise InputError(
            "vehicle",
            f"{shown(vehicle.name)} has tendons, which Eq. (10) lacks",
            "leave them out, or use continuair.accelerations",
        )
    sections = (section for arm in vehicle.arms for section in arm.section)
    rotors = vehicle.uav.rotors
    dragging = vehicle.uav.drag is not None or (rotors is not None and rotors.moved_by_air)
    if dragging or any(s.drag_coefficient is not None for s in sections):
        raise InputError(
            "vehicle",
            f"{shown(vehicle.name)} has drag, which Eq. (10) lacks",
            (
                "leave uav.drag, drag_coefficient and the rotors' hub_drag and "
                "translational_lift out, or use continuair.accelerations"
            ),
        )


def _bends(vehicle: Vehicle) -> Iterator[tuple[slice, Section]]:
    """Yield every section with the slice of its (κ, ψa) in q."""
    for arm, chain in enumerate(vehicle.arms):
        for index, section in enumerate(chain.section):
            yield columns_of(vehicle, arm, index), section


def _mass_slopes(vehicle: Vehicle, q: Array, nodes: int) -> Array:
    """Return ∂M/∂q_k, k first, by complex steps: M is analytic, so they are exact to rounding."""
    slopes = np.zeros((len(q), len(q), len(q)))
    for k in range(3, len(q)):
        shifted = q.astype(complex)
        shifted[k] += 1j * _COMPLEX_STEP
        slopes[k] = mass_matrix(vehicle, shifted, nodes).imag / _COMPLEX_STEP
    return slopes


def masked(mask: Mask, n: int) -> Array:
    """Return the factors (n, n) of M and C of a mask, or raise InputError."""
    if isinstance(mask, str):
        named = masks(n)
        if mask not in named:
            names = ", ".join(named)
            raise InputError(
                "mask", f"is {shown(mask)}", f"use {names}, or factors of shape {(n, n)}"
            )
        return named[mask]
    return of_shape("mask", mask, (n, n))


def of_shape(name: str, value: object, shape: tuple[int, ...], *, or_zero: bool = False) -> Array:
    """Return a value as an array of a shape, zeros for a 0 if `or_zero`; else raise InputError."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        array = None
    if array is None or not checks.means_numbers(value):
        raise InputError(
            name, f"is {shown(value)}, but must be numbers", f"give an array of shape {shape}"
        )
    if or_zero and array.shape == () and array == 0.0:
        return np.zeros(shape)
    if array.shape != shape:
        raise InputError(name, f"has shape {array.shape}", f"give an array of shape {shape}")
    return array
