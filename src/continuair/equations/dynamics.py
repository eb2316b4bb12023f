"""Euler-Lagrange dynamics, Eqs. (8)-(10): M q̈ + C q̇ + G = τ - J_tᵀ F_e, with masks on M and C.

Remark 1 concerns the kinematics: below κ_s, the masses and their weight take κ_s for κ, while the
spring and the damper, which are regular there, keep the bend as it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from continuair import checks
from continuair.equations.kinematics import Array, check_coordinates, columns_of, jacobian, tip_of
from continuair.equations.masses import mass_matrix, mass_times_height, weight_vector
from continuair.errors import InputError, shown
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

_COMPLEX_STEP = 1e-30


def masks(coordinates: int) -> dict[str, Array]:
    """What multiplies M and C of so many coordinates, by name.

    coupled: all; block: a block of the UAV and one of all arms ("decoupled" in the paper);
    diagonal: the diagonal.
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
    """C (6 + 2N, 6 + 2N) of Eq. (10): C_ij = Σ ½ (∂_k M_ij + ∂_j M_ik - ∂_i M_jk) q̇_k, Christoffel.

    The paper does not print its C; this one makes Ṁ - 2C skew. Where |κ| <= κ_s, M does not change
    with κ, and its slopes by κ are 0: switch Remark 1 off (kappa_s = 0) for a C near straight.
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
    """The elastic part of G (6 + 2N,): E I l κ on each κ, from ½ E I l κ²; not in the paper."""
    check_coordinates("q", q, vehicle)
    G = np.zeros(len(q))
    for where, section in _bends(vehicle):
        G[where] = section.bending_stiffness * section.length * q[where.start], 0.0
    return G


def gravity_vector(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Array:
    """G (6 + 2N,) of Eq. (10): the slope of the potential energy, Eq. (9), gravity and elasticity.

    The paper calls it the gravity matrix, but without elasticity E would have no effect.
    """
    return weight_vector(vehicle, q, gravity, nodes) + elastic_vector(vehicle, q)


def damping_vector(vehicle: Vehicle, q: Array, qd: Array) -> Array:
    """Structural damping (6 + 2N,), to be added on the left of Eq. (10), which has none.

    The generalised force -d l k̇ on the bend vector is, in polar coordinates, -d l (κ̇, κ² ψ̇a).
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
    vehicle: Vehicle, q: Array, qd: Array, mask: Any = "coupled", nodes: int = 24
) -> float:
    """½ q̇ᵀ M q̇ [J], Eq. (8), of the masked M (masks as in `forward_dynamics`).

    Where |κ| <= κ_s, M is that of κ_s, as Remark 1 is printed, which ψ̇a knows nothing of: of
    motions that close to straight the energy is another; kappa_s = 0 switches it off.
    """
    M = _mask(mask, len(q)) * mass_matrix(vehicle, q, nodes)
    return float(0.5 * np.asarray(qd) @ M @ qd)


def potential_energy(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Any:
    """Gravity and elastic energy [J], Eq. (9); gravity's is 0 at world z = 0."""
    energy = gravity * mass_times_height(vehicle, q, nodes)
    for where, section in _bends(vehicle):
        energy = energy + 0.5 * section.bending_stiffness * section.length * q[where.start] ** 2
    return energy


def forward_dynamics(
    vehicle: Vehicle,
    q: Array,
    qd: Array,
    tau: Any = 0.0,
    tip_wrench: Any = 0.0,
    *,
    mask: Any = "coupled",
    tip_wrench_sign: int = 1,
    gravity: float = 9.81,
    nodes: int = 24,
) -> Array:
    """q̈ (6 + 2N,) of Eq. (10), with M and C multiplied by a mask, G and external forces untouched.

    q, qd: the paper's coordinates and rates, (8,) for one section. tau: generalised forces,
    conjugate to q, or 0: force in world axes [N], torques conjugate to the Euler angles [N m], and
    for each section Q_κ [N m²; the paper says N m] and Q_ψa [N m]. tip_wrench: force [N] and moment
    [N m] at each arm's tip in turn, (6,) for one, in world axes, or 0, through the untwisted J_t;
    tip_wrench_sign 1 lets it act on the tip, -1 is the paper's -J_tᵀ F_e.
    mask: "coupled"; "block", the paper's decoupled model: "off-diagonal elements" set to zero, read
    as the blocks between UAV (6) and arms (2N); "diagonal", the same read element by element; or
    any array of factors. Where |κ| <= κ_s, M, C and J_t are those of κ_s, as Remark 1 is printed,
    which q̇ knows nothing of: switch it off (kappa_s = 0), or use `accelerations`, for motions that
    close to straight. Raises InputError for a wrong mask or shape, and for a vehicle with drag,
    which Eq. (10) lacks.
    """
    check_without_drag(vehicle)
    arms, n = len(vehicle.arms), vehicle.layout.coordinates
    kept = _mask(mask, n)
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
    """Raise InputError for a vehicle with drag or terms of its own, which Eq. (10) lacks."""
    if vehicle.terms:
        raise InputError(
            f"vehicle {shown(vehicle.name)} has the term {type(vehicle.terms[0]).__name__}, which "
            "Eq. (10) lacks; leave it out, or use continuair.accelerations."
        )
    sections = (section for arm in vehicle.arms for section in arm.section)
    rotors = vehicle.uav.rotors
    dragging = vehicle.uav.drag is not None or (rotors is not None and rotors.moved_by_air)
    if dragging or any(s.drag_coefficient is not None for s in sections):
        raise InputError(
            f"vehicle {shown(vehicle.name)} has drag, which Eq. (10) lacks; leave uav.drag, "
            "drag_coefficient and the rotors' hub_drag and translational_lift out, or use "
            "continuair.accelerations."
        )


def _bends(vehicle: Vehicle) -> Iterator[tuple[slice, Section]]:
    """Every section, and where its (κ, ψa) are in q."""
    for arm, chain in enumerate(vehicle.arms):
        for index, section in enumerate(chain.section):
            yield columns_of(vehicle, arm, index), section


def _mass_slopes(vehicle: Vehicle, q: Array, nodes: int) -> Array:
    """∂M/∂q_k, k first, exact to rounding: M is analytic, so a complex step is."""
    slopes = np.zeros((len(q), len(q), len(q)))
    for k in range(3, len(q)):
        shifted = q.astype(complex)
        shifted[k] += 1j * _COMPLEX_STEP
        slopes[k] = mass_matrix(vehicle, shifted, nodes).imag / _COMPLEX_STEP
    return slopes


def _mask(mask: Any, n: int) -> Array:
    if isinstance(mask, str):
        named = masks(n)
        if mask not in named:
            names = ", ".join(named)
            raise InputError(f"mask is {shown(mask)}; use {names}, or factors of shape {(n, n)}.")
        return named[mask]
    return of_shape("mask", mask, (n, n))


def of_shape(name: str, value: Any, shape: tuple[int, ...], *, or_zero: bool = False) -> Array:
    """A value as an array of a shape, or zeros for a 0 if that may be given; else InputError."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        array = None
    if array is None or not checks.means_numbers(value):
        text = f"{name} is {shown(value)}, but must be numbers"
        raise InputError(f"{text}; give an array of shape {shape}.")
    if or_zero and array.shape == () and array == 0.0:
        return np.zeros(shape)
    if array.shape != shape:
        raise InputError(f"{name} has shape {array.shape}; give an array of shape {shape}.")
    return array
