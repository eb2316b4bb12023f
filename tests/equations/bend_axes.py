"""Between the paper's coordinates and body axes with the bend vector: motions and forces."""

import numpy as np

from continuair import equations as eq


def directions(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (2,) along the bend and across it."""
    along = np.array([np.cos(q[7]), np.sin(q[7])])
    return along, np.array([-along[1], along[0]])


def bend(q: np.ndarray) -> np.ndarray:
    """k (2,)."""
    return np.asarray(q[6] * directions(q)[0])


def velocities(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(v, ω, k̇), the first two in body axes."""
    R, (along, across) = eq.rotation(q), directions(q)
    omega = R.T @ eq.euler_rate_matrix(q) @ qd[3:6]
    return R.T @ qd[:3], omega, qd[6] * along + q[6] * qd[7] * across


def accelerations(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """(a_o, ω̇, k̈) in one array (8,); the body's own ω̇ is the world's, turned into body axes."""
    R, (along, across) = eq.rotation(q), directions(q)
    T_rate = eq.euler_rate_matrix(q + 1e-30j * qd).imag / 1e-30
    omega_rate = R.T @ (eq.euler_rate_matrix(q) @ qdd[3:6] + T_rate @ qd[3:6])
    radial = qdd[6] - q[6] * qd[7] ** 2
    circular = q[6] * qdd[7] + 2 * qd[6] * qd[7]
    return np.concatenate([R.T @ qdd[:3], omega_rate, radial * along + circular * across])


def generalised(
    q: np.ndarray, force_world: np.ndarray, moment_body: np.ndarray, bend_moment: np.ndarray
) -> np.ndarray:
    """τ (8,), conjugate to q, of forces on the UAV and of (Q_x, Q_y)."""
    along, across = directions(q)
    euler = eq.euler_rate_matrix(q).T @ eq.rotation(q) @ moment_body
    polar = [bend_moment @ along, q[6] * bend_moment @ across]
    return np.concatenate([force_world, euler, polar])
