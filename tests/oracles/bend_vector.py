"""Kane's equations on nodes with the bend vector: an oracle without the singularity at κ = 0.

It shares no code with the kernels nor with continuair.equations. Each node is a small rigid body;
its velocity and acceleration come from the backbone's Taylor series in k, so it holds for
|k| s well below 1 (twelve terms: below rounding for |k| s <= 0.5).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.vehicle import Vehicle

_TERMS = 12
_E = np.eye(3)


def accelerations(
    vehicle: Vehicle, k: Any, kd: Any, omega: Any, model: str, gravity: float = 9.81
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(a_o - g in body axes, ω̇, k̈) of a level vehicle at rest in the world but for ω and k̇."""
    k, kd, w = (np.asarray(x, float) for x in (k, kd, omega))
    g = np.array([0.0, 0.0, -gravity])
    M, on_base, on_arm = np.zeros((8, 8)), np.zeros(6), np.zeros(2)
    uav = np.asarray(vehicle.uav.inertia)
    M[:3, :3], M[3:6, 3:6] = vehicle.uav.mass * _E, uav
    on_base[3:] = -np.cross(w, uav @ w)
    on_base[:3] = vehicle.uav.mass * g
    half = 0.5 if model == "decoupled" else 1.0
    for s, mass, transverse, axial in _nodes(vehicle):
        r, rd, r_rel, J, W, spin, spin_rel, tangent = _node(vehicle, k, kd, s)
        P = np.hstack([_E, -_cross(r), J])
        Ω = np.hstack([np.zeros((3, 3)), _E, W])
        inertia = transverse * _E + (axial - transverse) * np.outer(tangent, tangent)
        M += mass * P.T @ P + Ω.T @ inertia @ Ω
        base = np.cross(w, np.cross(w, r)) + 2 * half * np.cross(w, rd) - g
        arm = r_rel + 2 * half * np.cross(w, rd) - g
        full = w + spin
        turn = inertia @ (np.cross(w, spin) + spin_rel) + np.cross(full, inertia @ full)
        own_base = np.cross(w, inertia @ w)
        own_arm = inertia @ spin_rel + np.cross(spin, inertia @ spin)
        if model == "coupled":
            base = base + r_rel
            arm = arm + np.cross(w, np.cross(w, r))
            turn_base = turn_arm = turn
        else:
            turn_base = 0.5 * (turn + own_base - own_arm)
            turn_arm = 0.5 * (turn + own_arm - own_base)
        on_base[:3] -= mass * base
        on_base[3:] -= mass * np.cross(r, base) + turn_base
        on_arm -= J.T @ (mass * arm) + W.T @ turn_arm
    arm = vehicle.arm
    on_arm -= arm.length * (arm.bending_stiffness * k + arm.structural_damping * kd)
    if model == "decoupled":
        M[:6, 6:] = M[6:, :6] = 0.0
    solved = np.linalg.solve(M, np.concatenate([on_base, on_arm]))
    return solved[:3] - g, solved[3:6], solved[6:]


def _nodes(vehicle: Vehicle) -> list[tuple[float, float, float, float]]:
    arm = vehicle.arm
    x, weight = np.polynomial.legendre.leggauss(24)
    rod = [
        (
            0.5 * arm.length * (1 + xi),
            0.5 * arm.length * wi * arm.mass_per_length,
            0.5 * arm.length * wi * arm.transverse_inertia_per_length,
            0.5 * arm.length * wi * arm.axial_inertia_per_length,
        )
        for xi, wi in zip(x, weight, strict=True)
    ]
    return rod + [(d.position, d.mass, d.inertia[0], d.inertia[1]) for d in arm.disks]


def _node(vehicle: Vehicle, k: np.ndarray, kd: np.ndarray, s: float) -> tuple[np.ndarray, ...]:
    """r, ṙ, the part of r̈ quadratic in k̇, ∂r/∂k, ∂spin/∂k̇, spin, spin rate at k̈ = 0, tangent."""
    u, ud, udd = k @ k, 2 * k @ kd, 2 * kd @ kd
    a, a1, a2 = _power(2, s, u)
    b, b1, b2 = _power(1, s, u)
    c, _, _ = _power(0, s, u)
    g3, g31, _ = _power(3, s, u)
    at = np.array([*(a * k), -b])
    rate = np.array([*(a * kd + a1 * ud * k), -b1 * ud])
    quadratic = np.array(
        [*(2 * a1 * ud * kd + (a2 * ud**2 + a1 * udd) * k), -(b2 * ud**2 + b1 * udd)]
    )
    J = np.vstack([a * np.eye(2) + 2 * a1 * np.outer(k, k), -2 * b1 * k])
    normal = np.array([-k[1], k[0]])
    W = np.vstack([s * np.array([[0, 1], [-1, 0]]) - g3 * np.outer(k, normal), a * normal])
    # At k̈ = 0, (k × k̇)_z is constant: only a and Γ k change.
    cz = normal @ kd
    spin_rate = np.array([*(-cz * (g31 * ud * k + g3 * kd)), cz * a1 * ud])
    tangent = np.array([*(b * k), -c])
    return np.asarray(vehicle.uav.mount) + at, rate, quadratic, J, W, W @ kd, spin_rate, tangent


def _power(m: int, s: float, u: float) -> tuple[float, float, float]:
    """s^m Σ (-u s²)^j / (2j + m)! and its first two derivatives in u."""
    total = first = second = 0.0
    term = s**m / float(np.prod(np.arange(1.0, m + 1)))
    for j in range(_TERMS):
        total += term * u**j
        if j >= 1:
            first += j * term * u ** (j - 1)
        if j >= 2:
            second += j * (j - 1) * term * u ** (j - 2)
        term *= -(s**2) / ((2 * j + m + 1) * (2 * j + m + 2))
    return total, first, second


def _cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
