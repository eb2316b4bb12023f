"""Euler-Lagrange dynamics, Eqs. (10)-(12): M q̈ + C q̇ + G = τ - J_tᵀ F_e, with masks on M and C."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import block_diag

from continuair.equations.kinematics import (
    Array,
    bend_of,
    euler_rate_matrix,
    jacobian,
    position,
    rotation,
)
from continuair.errors import InputError, shown
from continuair.vehicle import Vehicle

_BLOCKS = block_diag(np.ones((6, 6)), np.ones((2, 2)))

MASKS: dict[str, Array] = {"coupled": np.ones((8, 8)), "block": _BLOCKS, "diagonal": np.eye(8)}
"""What multiplies M and C: all, UAV and arm blocks ("decoupled" in the paper), the diagonal."""

_COMPLEX_STEP = 1e-30


def mass_matrix(vehicle: Vehicle, q: Array, nodes: int = 24) -> Array:
    """M (8, 8): the Hessian of the kinetic energy of Eq. (10) in q̇.

    nodes: Gauss-Legendre nodes on the backbone. Disks, which the paper's assumption drops, and the
    rotary inertia of the sections (ρI across, 2ρI along the tangent) are included.
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
    """C (8, 8) of Christoffel symbols, c_ij = Σ ½ (∂_k M_ij + ∂_j M_ik - ∂_i M_jk) q̇_k."""
    dM = _mass_slopes(vehicle, np.asarray(q, float), nodes)
    return 0.5 * (
        np.einsum("kij,k->ij", dM, qd)
        + np.einsum("jik,k->ij", dM, qd)
        - np.einsum("ijk,k->ij", dM, qd)
    )


def weight_vector(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Array:
    """The gravity part of G (8,)."""
    s, mass, _, _ = _sections(vehicle, nodes)
    G = gravity * np.einsum("n,nj->j", mass, jacobian(vehicle, q, s)[:, 2])
    G[2] += vehicle.uav.mass * gravity
    return G


def elastic_vector(vehicle: Vehicle, q: Array) -> Array:
    """The elastic part of G (8,): E I l κ on κ, from the energy ½ E I l κ²."""
    κ, _ = bend_of(vehicle, q)
    arm = vehicle.arm
    return np.array([0.0] * 6 + [arm.bending_stiffness * arm.length * κ, 0.0])


def gravity_vector(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Array:
    """G (8,) of Eq. (12): gravity and elasticity; without the latter E would have no effect."""
    return weight_vector(vehicle, q, gravity, nodes) + elastic_vector(vehicle, q)


def damping_vector(vehicle: Vehicle, q: Array, qd: Array) -> Array:
    """Structural damping (8,) on the left-hand side: d l k̇ in polar axes, d l (κ̇, κ² ψ̇a)."""
    κ, _ = bend_of(vehicle, q)
    d = vehicle.arm.structural_damping * vehicle.arm.length
    return np.array([0.0] * 6 + [d * qd[6], d * κ**2 * qd[7]])


def kinetic_energy(vehicle: Vehicle, q: Array, qd: Array, mask: Any = "coupled") -> float:
    """½ q̇ᵀ M q̇ [J], Eq. (10), of the masked M."""
    return float(0.5 * qd @ (_mask(mask) * mass_matrix(vehicle, q)) @ qd)


def potential_energy(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Any:
    """Gravity and elastic energy [J], Eq. (11); gravity's is 0 at z = 0."""
    s, mass, _, _ = _sections(vehicle, nodes)
    κ, _ = bend_of(vehicle, q)
    arm = vehicle.arm
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
    """q̈ (8,) of Eq. (12) with M and C multiplied by a mask, G and external forces untouched.

    tau: generalised forces (8,) or 0. tip_wrench: force and moment (6,) or 0, world axes, through
    the untwisted J_t; tip_wrench_sign 1 lets it act on the tip, -1 is the paper's -J_tᵀ F_e.
    mask: "coupled", "block" (the paper's decoupled model), "diagonal" or an (8, 8) array.
    """
    q, qd, kept = np.asarray(q, float), np.asarray(qd, float), _mask(mask)
    M = kept * mass_matrix(vehicle, q, nodes)
    C = kept * coriolis_matrix(vehicle, q, qd, nodes)
    G = gravity_vector(vehicle, q, gravity, nodes)
    F = tip_wrench_sign * np.broadcast_to(np.asarray(tip_wrench, float), 6)
    pushed = tau + jacobian(vehicle, q, vehicle.arm.length).T @ F
    rhs = pushed - C @ qd - G - damping_vector(vehicle, q, qd)
    return np.linalg.solve(M, rhs)


def _sections(vehicle: Vehicle, nodes: int) -> tuple[Array, Array, Array, Array]:
    """Arc length, mass, transverse and axial inertia of every backbone node and disk."""
    arm = vehicle.arm
    x, weight = np.polynomial.legendre.leggauss(nodes)
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
            raise InputError(f"mask is {shown(mask)}; use {', '.join(MASKS)} or an 8x8 array.")
        return MASKS[mask]
    kept = np.asarray(mask, float)
    if kept.shape != (8, 8):
        raise InputError(f"mask has shape {kept.shape}; give an 8x8 array of factors on M and C.")
    return kept
