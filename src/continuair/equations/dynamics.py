"""Euler-Lagrange dynamics, Eqs. (8)-(10): M q̈ + C q̇ + G = τ - J_tᵀ F_e, with masks on M and C.

Remark 1 concerns the kinematics: below κ_s, the masses and their weight take κ_s for κ, while the
spring and the damper, which are regular there, keep the bend as it is.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from continuair.equations.kinematics import (
    Array,
    bend_of,
    euler_rate_matrix,
    jacobian,
    position,
    rotation,
)
from continuair.errors import InputError, shown
from continuair.vehicle.vehicle import Vehicle

_OF_UAV = np.arange(8) < 6
_BLOCKS = (_OF_UAV[:, None] == _OF_UAV).astype(float)

MASKS: dict[str, Array] = {"coupled": np.ones((8, 8)), "block": _BLOCKS, "diagonal": np.eye(8)}
"""What multiplies M and C: all, UAV and arm blocks ("decoupled" in the paper), the diagonal."""

_COMPLEX_STEP = 1e-30

# NumPy takes longer to find the nodes than the mass matrix takes.
_gauss_nodes = functools.lru_cache(np.polynomial.legendre.leggauss)


def mass_matrix(vehicle: Vehicle, q: Array, nodes: int = 24) -> Array:
    """M (8, 8) of Eq. (10): the Hessian in q̇ of the kinetic energy, Eq. (8).

    nodes: Gauss-Legendre nodes on the backbone. Disks, which the paper's Assumption 1 drops, and
    the rotary inertia of the sections (ρI across, 2ρI along the tangent) are included.
    """
    q = np.asarray(q)
    uav = vehicle.uav
    R, T = rotation(q), euler_rate_matrix(q)
    M = np.zeros((8, 8), dtype=np.result_type(q, float))
    M[:3, :3] = uav.mass * np.eye(3)
    M[3:6, 3:6] = T.T @ R @ np.asarray(uav.inertia) @ R.T @ T
    s, mass, transverse, axial = _sections(vehicle, nodes)
    J = jacobian(vehicle, q, s)
    linear, angular = J[:, :3], J[:, 3:]
    M += np.einsum("n,nij,nik->jk", mass, linear, linear)
    M += np.einsum("n,nij,nik->jk", transverse, angular, angular)
    along = np.einsum("ni,nij->nj", _tangents(vehicle, q, s), angular)
    return M + np.einsum("n,nj,nk->jk", axial - transverse, along, along)


def coriolis_matrix(vehicle: Vehicle, q: Array, qd: Array, nodes: int = 24) -> Array:
    """C (8, 8) of Eq. (10), from Christoffel symbols: Σ ½ (∂_k M_ij + ∂_j M_ik - ∂_i M_jk) q̇_k.

    The paper does not print its C; this one makes Ṁ - 2C skew. Where |κ| <= κ_s, M does not change
    with κ, and its slopes by κ are 0: switch Remark 1 off (arm.kappa_s = 0) for a C near straight.
    """
    dM = _mass_slopes(vehicle, np.asarray(q, float), nodes)
    return 0.5 * (
        np.einsum("kij,k->ij", dM, qd)
        + np.einsum("jik,k->ij", dM, qd)
        - np.einsum("ijk,k->ij", dM, qd)
    )


def weight_vector(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Array:
    """The gravity part of G (8,), the part that the paper names; gravity in m/s², downwards."""
    s, mass, _, _ = _sections(vehicle, nodes)
    G = gravity * np.einsum("n,nj->j", mass, jacobian(vehicle, q, s)[:, 2])
    G[2] += vehicle.uav.mass * gravity
    return G


def elastic_vector(vehicle: Vehicle, q: Array) -> Array:
    """The elastic part of G (8,): E I l κ on κ, from the energy ½ E I l κ²; not in the paper."""
    arm = vehicle.arm
    return np.array([0.0] * 6 + [arm.bending_stiffness * arm.length * q[6], 0.0])


def gravity_vector(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Array:
    """G (8,) of Eq. (10): the slope of the potential energy, Eq. (9), gravity and elasticity.

    The paper calls it the gravity matrix, but without elasticity E would have no effect.
    """
    return weight_vector(vehicle, q, gravity, nodes) + elastic_vector(vehicle, q)


def damping_vector(vehicle: Vehicle, q: Array, qd: Array) -> Array:
    """Structural damping (8,), to be added on the left of Eq. (10), which has none.

    The generalised force -d l k̇ on the bend vector is, in polar coordinates, -d l (κ̇, κ² ψ̇a).
    """
    d = vehicle.arm.structural_damping * vehicle.arm.length
    return np.array([0.0] * 6 + [d * qd[6], d * q[6] ** 2 * qd[7]])


def kinetic_energy(
    vehicle: Vehicle, q: Array, qd: Array, mask: Any = "coupled", nodes: int = 24
) -> float:
    """½ q̇ᵀ M q̇ [J], Eq. (8), of the masked M (masks as in `forward_dynamics`)."""
    M = _mask(mask) * mass_matrix(vehicle, q, nodes)
    return float(0.5 * np.asarray(qd) @ M @ qd)


def potential_energy(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Any:
    """Gravity and elastic energy [J], Eq. (9); gravity's is 0 at world z = 0."""
    s, mass, _, _ = _sections(vehicle, nodes)
    κ, arm = q[6], vehicle.arm
    height = vehicle.uav.mass * q[2] + mass @ position(vehicle, q, s)[:, 2]
    return gravity * height + 0.5 * arm.bending_stiffness * arm.length * κ**2


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
    """q̈ (8,) of Eq. (10), with M and C multiplied by a mask, G and external forces untouched.

    q, qd: the paper's coordinates and rates (8,). tau: generalised forces (8,) conjugate to q, or
    0: force in world axes [N], torques conjugate to the Euler angles [N m], Q_κ [N m²; the paper
    says N m], Q_ψa [N m]. tip_wrench: force [N] and moment [N m] (6,) in world axes, or 0, through
    the untwisted J_t; tip_wrench_sign 1 lets it act on the tip, -1 is the paper's -J_tᵀ F_e.
    mask: "coupled"; "block", the paper's decoupled model: "off-diagonal elements" set to zero, read
    as the blocks between UAV (6) and arm (2); "diagonal", the same read element by element; or any
    (8, 8) factors. Raises InputError for a wrong mask or shape.
    """
    kept = _mask(mask)
    q, qd = _of_shape("q", q, (8,)), _of_shape("qd", qd, (8,))
    tau = _of_shape("tau", tau, (8,), or_zero=True)
    F = tip_wrench_sign * _of_shape("tip_wrench", tip_wrench, (6,), or_zero=True)
    M = kept * mass_matrix(vehicle, q, nodes)
    C = kept * coriolis_matrix(vehicle, q, qd, nodes)
    G = gravity_vector(vehicle, q, gravity, nodes)
    pushed = tau + jacobian(vehicle, q, vehicle.arm.length).T @ F
    return np.linalg.solve(M, pushed - C @ qd - G - damping_vector(vehicle, q, qd))


def _sections(vehicle: Vehicle, nodes: int) -> tuple[Array, Array, Array, Array]:
    """Arc length, mass, transverse and axial inertia of every backbone node and disk."""
    arm = vehicle.arm
    x, weight = _gauss_nodes(nodes)
    ds = 0.5 * arm.length * weight
    rows = [
        np.column_stack(
            [
                0.5 * arm.length * (1.0 + x),
                arm.mass_per_length * ds,
                arm.transverse_inertia_per_length * ds,
                arm.axial_inertia_per_length * ds,
            ]
        )
    ]
    rows += [
        np.array([[d.position, d.mass, d.transverse_inertia, d.axial_inertia]]) for d in arm.disks
    ]
    s, mass, transverse, axial = np.vstack(rows).T
    return s, mass, transverse, axial


def _tangents(vehicle: Vehicle, q: Array, s: Array) -> Array:
    """Unit tangents (n, 3) in world axes."""
    κ, ψ = bend_of(vehicle, q)
    sine = np.sin(κ * s)
    body = np.stack([sine * np.cos(ψ), sine * np.sin(ψ), -np.cos(κ * s)], axis=-1)
    return body @ rotation(q).T


def _mass_slopes(vehicle: Vehicle, q: Array, nodes: int) -> Array:
    """∂M/∂q_k, (8, 8, 8), k first, exact to rounding: M is analytic, so a complex step is."""
    slopes = np.zeros((8, 8, 8))
    for k in range(3, 8):
        shifted = q.astype(complex)
        shifted[k] += 1j * _COMPLEX_STEP
        slopes[k] = mass_matrix(vehicle, shifted, nodes).imag / _COMPLEX_STEP
    return slopes


def _mask(mask: Any) -> Array:
    if isinstance(mask, str):
        if mask not in MASKS:
            names = ", ".join(MASKS)
            raise InputError(f"mask is {shown(mask)}; use {names}, or an 8x8 array of factors.")
        return MASKS[mask]
    return _of_shape("mask", mask, (8, 8))


def _of_shape(name: str, value: Any, shape: tuple[int, ...], *, or_zero: bool = False) -> Array:
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        text = f"{name} is {shown(value)}, but must be numbers"
        raise InputError(f"{text}; give an array of shape {shape}.") from None
    if or_zero and array.shape == () and array == 0.0:
        return np.zeros(shape)
    if array.shape != shape:
        raise InputError(f"{name} has shape {array.shape}; give an array of shape {shape}.")
    return array
