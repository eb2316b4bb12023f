"""The polar Lagrange equations in mpmath, with digits enough to come as near to κ = 0 as one likes.

Same answers as `tests.oracles.bend_vector`, but from other coordinates (Euler angles, polar bend),
other formulas (closed forms) and other mechanics (mass matrix and Christoffel symbols).
"""

from functools import cache
from typing import Any

import numpy as np
from mpmath import mp, mpc, mpf

from continuair.vehicle.vehicle import Vehicle

_DIGITS = 120
_STEP = mpf(10) ** -100
# Stands for κ = 0: the limit along its direction, missed by 1e-25 of the slope.
_NEARLY_STRAIGHT = mpf(10) ** -25


def accelerations(
    vehicle: Vehicle,
    euler: np.ndarray,
    bend: np.ndarray,
    omega: np.ndarray,
    bend_rate: np.ndarray,
    force_world: np.ndarray,
    moment_body: np.ndarray,
    bend_moment: np.ndarray,
    tip_wrench: np.ndarray,
    model: str,
    nodes: int = 24,
) -> np.ndarray:
    """(a_o, ω̇, k̈) (8,) in body axes, rounded to float64; axes and units as in `bend_vector`."""
    with mp.workdps(_DIGITS):
        euler, omega, kd = _exact(euler), _exact(omega), _exact(bend_rate)
        kx, ky = _exact(bend)
        κ = mp.hypot(kx, ky) or _NEARLY_STRAIGHT
        ψ = mp.atan2(ky, kx)
        along = np.array([mp.cos(ψ), mp.sin(ψ)])
        across = np.array([-along[1], along[0]])
        R, T = _attitude(euler)
        rates = _solve(T, R @ omega)
        q = np.array([mpf(0)] * 3 + [*euler, κ, ψ])
        qd = np.array([mpf(0)] * 3 + [*rates, kd @ along, kd @ across / κ])
        Q = _exact(bend_moment)
        tau = np.array(
            [*_exact(force_world), *(T.T @ R @ _exact(moment_body)), Q @ along, κ * (Q @ across)]
        )
        tau = tau + _tip_jacobian(vehicle, q).T @ _exact(tip_wrench)
        qdd = _lagrange(vehicle, q, qd, tau, model, nodes)
        T_rate = _imag(_attitude(euler + 1j * _STEP * rates)[1]) / _STEP
        radial = qdd[6] - κ * qd[7] ** 2
        circular = κ * qdd[7] + 2 * qd[6] * qd[7]
        omega_rate = R.T @ (T @ qdd[3:6] + T_rate @ rates)
        found = [*(R.T @ qdd[:3]), *omega_rate, *(radial * along + circular * across)]
        return np.array([float(x) for x in found])


def _lagrange(
    vehicle: Vehicle, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, model: str, nodes: int
) -> np.ndarray:
    """q̈ (8,), with UAV-arm blocks of M and of the Christoffel matrix zero if decoupled."""
    M = _mass(vehicle, q, nodes)
    dM = np.zeros((8, 8, 8), dtype=object)
    G = np.zeros(8, dtype=object)
    for i in range(8):
        shifted = q + np.array([mpc(0, _STEP) if j == i else mpf(0) for j in range(8)])
        G[i] = mp.im(_potential(vehicle, shifted, nodes)) / _STEP
        if i >= 3:
            dM[i] = _imag(_mass(vehicle, shifted, nodes)) / _STEP
    flow = np.tensordot(qd, dM, axes=(0, 0))
    cross = dM @ qd
    C = (flow + cross.T - cross) / 2
    if model == "decoupled":
        for X in (M, C):
            X[:6, 6:] = X[6:, :6] = mpf(0)
    arm = vehicle.arm
    damping = np.array([mpf(0)] * 6 + [qd[6], q[6] ** 2 * qd[7]])
    damping = damping * mpf(arm.structural_damping) * mpf(arm.length)
    return _solve(M, tau - C @ qd - G - damping)


def _mass(vehicle: Vehicle, q: np.ndarray, nodes: int) -> np.ndarray:
    """M (8, 8): sums over sections in body axes, then from body axes to Euler rates and world."""
    M = np.zeros((8, 8), dtype=object)
    M[:3, :3] = np.eye(3, dtype=int).astype(object) * mpf(vehicle.uav.mass)
    M[3:6, 3:6] = _exact(vehicle.uav.inertia)
    for s, mass, transverse, axial in _sections(vehicle, nodes):
        P, W, tangent = _section_jacobian(vehicle, q[6], q[7], s)
        spin = tangent @ W
        M = M + mass * (P.T @ P) + transverse * (W.T @ W)
        M = M + (axial - transverse) * np.outer(spin, spin)
    R, T = _attitude(q[3:6])
    B = np.zeros((8, 8), dtype=object)
    B[:3, :3], B[3:6, 3:6] = R.T, R.T @ T
    B[6, 6] = B[7, 7] = mpf(1)
    return B.T @ M @ B


def _potential(vehicle: Vehicle, q: np.ndarray, nodes: int) -> Any:
    R, _ = _attitude(q[3:6])
    weight = mpf(9.81)
    energy = weight * mpf(vehicle.uav.mass) * q[2]
    for s, mass, _, _ in _sections(vehicle, nodes):
        height = q[2] + R[2] @ _place(vehicle, q[6], q[7], s)
        energy = energy + weight * mass * height
    arm = vehicle.arm
    E, l_a, radius = mpf(arm.youngs_modulus), mpf(arm.length), mpf(arm.radius)
    return energy + E * mp.pi * radius**4 / 4 * l_a * q[6] ** 2 / 2


def _place(vehicle: Vehicle, κ: Any, ψ: Any, s: Any) -> np.ndarray:
    out = (1 - mp.cos(κ * s)) / κ
    at = np.array([out * mp.cos(ψ), out * mp.sin(ψ), -mp.sin(κ * s) / κ])
    return _exact(vehicle.uav.mount) + at


def _section_jacobian(vehicle: Vehicle, κ: Any, ψ: Any, s: Any) -> tuple[np.ndarray, ...]:
    """Velocity and spin (3, 8) per (v, ω, κ̇, ψ̇a) in body axes, and the tangent (3,)."""
    sine, cosine, sψ, cψ = mp.sin(κ * s), mp.cos(κ * s), mp.sin(ψ), mp.cos(ψ)
    x, y, z = _place(vehicle, κ, ψ, s)
    out, out_rate = (1 - cosine) / κ, s * sine / κ - (1 - cosine) / κ**2
    drop_rate = s * cosine / κ - sine / κ**2
    P = np.array(
        [
            [1, 0, 0, 0, z, -y, out_rate * cψ, -out * sψ],
            [0, 1, 0, -z, 0, x, out_rate * sψ, out * cψ],
            [0, 0, 1, y, -x, 0, -drop_rate, 0],
        ],
        dtype=object,
    )
    W = np.array(
        [
            [0, 0, 0, 1, 0, 0, s * sψ, sine * cψ],
            [0, 0, 0, 0, 1, 0, -s * cψ, sine * sψ],
            [0, 0, 0, 0, 0, 1, 0, 1 - cosine],
        ],
        dtype=object,
    )
    return P, W, np.array([sine * cψ, sine * sψ, -cosine])


def _tip_jacobian(vehicle: Vehicle, q: np.ndarray) -> np.ndarray:
    """J (6, 8) in world axes, for the paper's rates."""
    R, T = _attitude(q[3:6])
    P, W, _ = _section_jacobian(vehicle, q[6], q[7], mpf(vehicle.arm.length))
    J = np.vstack([R @ P, R @ W])
    J[:, 3:6] = J[:, 3:6] @ R.T @ T
    J[:3, :3] = J[:3, :3] @ R.T
    return J


def _sections(vehicle: Vehicle, nodes: int) -> list[tuple[Any, Any, Any, Any]]:
    arm = vehicle.arm
    l_a, radius, density = mpf(arm.length), mpf(arm.radius), mpf(arm.density)
    μ, ρI = density * mp.pi * radius**2, density * mp.pi * radius**4 / 4
    rod = [(l_a * x, l_a * w * μ, l_a * w * ρI, 2 * l_a * w * ρI) for x, w in _gauss(nodes)]
    return rod + [(mpf(d.position), mpf(d.mass), *map(mpf, d.inertia)) for d in arm.disks]


@cache
def _gauss(nodes: int) -> list[tuple[Any, Any]]:
    """Gauss-Legendre nodes and weights on [0, 1]: NumPy's nodes, polished by Newton's method."""
    pairs = []
    for start in np.polynomial.legendre.leggauss(nodes)[0]:
        x = mpf(float(start))
        for _ in range(4):
            value, slope = _legendre(nodes, x)
            x = x - value / slope
        slope = _legendre(nodes, x)[1]
        pairs.append(((1 + x) / 2, 1 / ((1 - x**2) * slope**2)))
    return pairs


def _legendre(n: int, x: Any) -> tuple[Any, Any]:
    before, here = mpf(1), x
    for j in range(2, n + 1):
        before, here = here, ((2 * j - 1) * x * here - (j - 1) * before) / j
    return here, n * (before - x * here) / (1 - x**2)


def _attitude(euler: Any) -> tuple[np.ndarray, np.ndarray]:
    """R, body to world, and T, Euler rates to angular velocity in world axes."""
    (sφ, sθ, sψ), (cφ, cθ, cψ) = map(mp.sin, euler), map(mp.cos, euler)
    R = np.array(
        [
            [cψ * cθ, cψ * sθ * sφ - sψ * cφ, cψ * sθ * cφ + sψ * sφ],
            [sψ * cθ, sψ * sθ * sφ + cψ * cφ, sψ * sθ * cφ - cψ * sφ],
            [-sθ, cθ * sφ, cθ * cφ],
        ]
    )
    return R, np.array([[cψ * cθ, -sψ, mpf(0)], [sψ * cθ, cψ, mpf(0)], [-sθ, mpf(0), mpf(1)]])


def _exact(values: Any) -> np.ndarray:
    return np.vectorize(mpf, otypes=[object])(np.asarray(values, float))


def _imag(values: np.ndarray) -> np.ndarray:
    return np.vectorize(mp.im, otypes=[object])(values)


def _solve(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array(list(mp.lu_solve(mp.matrix(A.tolist()), mp.matrix(b.tolist()))))
