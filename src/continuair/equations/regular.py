"""Accelerations in coordinates without singularities, computed in the paper's coordinates.

The state is converted to q and q̇, Eq. (10) is solved, and q̈ is converted back. Tests compare the
kernels with this, which use neither Euler angles nor polar bends.
"""

from __future__ import annotations

import numpy as np

from continuair.equations.dynamics import Mask, forward_dynamics, of_shape
from continuair.equations.kinematics import Array, euler_rate_matrix, rotation, unbounded
from continuair.equations.turns import of_quaternion
from continuair.errors import InputError
from continuair.typing import ArrayLike
from continuair.vehicle.arc import bend_vectors, polar_of
from continuair.vehicle.vehicle import Vehicle

_COMPLEX_STEP = 1e-30


def accelerations(
    vehicle: Vehicle,
    *,
    bend: ArrayLike,
    attitude: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    velocity: ArrayLike = 0.0,
    angular_velocity: ArrayLike = 0.0,
    bend_rate: ArrayLike = 0.0,
    force: ArrayLike = 0.0,
    moment: ArrayLike = 0.0,
    bend_moment: ArrayLike = 0.0,
    tip_wrench: ArrayLike = 0.0,
    gravity: float = 9.81,
    mask: Mask = "coupled",
    nodes: int = 24,
) -> tuple[Array, Array, Array]:
    """Return the accelerations of a state by Eq. (10), for comparison with the kernels.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch) without drag or terms of its own.
    bend : array_like (N, 2)
        Bend vectors of all sections, arm by arm from the base out [1/m].
    attitude : array_like (4,), default (0, 0, 0, 1)
        Quaternion x y z w, body to world, of any length above 0.
    velocity : array_like (3,) or 0, default 0
        Velocity of B's origin, world axes [m/s].
    angular_velocity : array_like (3,) or 0, default 0
        Angular velocity, body axes [rad/s].
    bend_rate : array_like (N, 2) or 0, default 0
        Rates of the bend vectors [1/(m s)].
    force : array_like (3,) or 0, default 0
        Force at B's origin, world axes [N].
    moment : array_like (3,) or 0, default 0
        Moment, body axes [N m].
    bend_moment : array_like (N, 2) or 0, default 0
        Generalised forces conjugate to the bend vectors [N m²].
    tip_wrench : array_like (arms, 6) or 0, default 0
        Force [N] and moment [N m] on each arm's tip, world axes.
    gravity : float, default 9.81
        Gravitational acceleration, downwards [m/s²].
    mask : {"coupled", "block", "diagonal"} or array_like (6 + 2N, 6 + 2N), default "coupled"
        Factors of M and C, as in `forward_dynamics`.
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    velocity_rate : array (3,)
        Acceleration v̇ of B's origin, world axes [m/s²].
    angular_velocity_rate : array (3,)
        Angular acceleration ω̇, body axes [rad/s²].
    bend_acceleration : array (N, 2)
        Second derivatives k̈ of the bend vectors [1/(m s²)].

    Raises
    ------
    InputError
        If a bend is 0, the pitch is ±90°, a shape differs, or the vehicle has drag.

    See Also
    --------
    continuair.accelerations : The same quantities from the kernels.

    Notes
    -----
    Eq. (10) of Amiri et al. (2026) without Remark 1. Polar bends and Euler angles lose digits as
    1/κ² and 1/cos θ.
    """
    vectors = {"velocity": velocity, "angular_velocity": angular_velocity}
    vectors |= {"force": force, "moment": moment}
    v, ω, F, M = (of_shape(*each, (3,), or_zero=True) for each in vectors.items())
    bends = {"bend": bend, "bend_rate": bend_rate, "bend_moment": bend_moment}
    per_section = bend_vectors(np.zeros(vehicle.layout.bends)).shape
    k, k_rate, Q = (of_shape(*each, per_section, or_zero=True) for each in bends.items())
    wrenches = of_shape("tip_wrench", tip_wrench, (len(vehicle.arms), 6), or_zero=True).ravel()
    R = checked_rotation(attitude)
    # Bend vectors need no Remark 1, whose κ_s in M, C and G contradicts the κ that q and q̇ are of.
    vehicle = unbounded(vehicle)
    q, qd = _paper_motion(R, v, ω, k, k_rate)
    tau = np.concatenate([F, euler_rate_matrix(q).T @ R @ M, _polar_forces(q, Q)])
    qdd = forward_dynamics(vehicle, q, qd, tau, wrenches, mask=mask, gravity=gravity, nodes=nodes)
    return _regular_rates(q, qd, qdd)


def checked_rotation(attitude: ArrayLike) -> Array:
    """Return the rotation (3, 3) of a quaternion (4,), or raise InputError."""
    turned = of_shape("attitude", attitude, (4,))
    if not turned.any():
        raise InputError("attitude", "has length 0", "give a quaternion x y z w")
    return of_quaternion(turned)


def _paper_motion(R: Array, v: Array, ω: Array, k: Array, k_rate: Array) -> tuple[Array, Array]:
    """Return q and q̇ of a vehicle whose B is at the world's origin; R: body to world."""
    κ = np.hypot(k[:, 0], k[:, 1])
    if not κ.all():
        raise InputError(
            "bend",
            "holds a section with bend 0, which has no polar coordinates",
            "give it a bend, or use continuair.accelerations",
        )
    q = np.concatenate([np.zeros(3), _euler_angles(R), _pairs(κ, np.arctan2(k[:, 1], k[:, 0]))])
    along, across = _directions(q)
    euler_rate = np.linalg.solve(euler_rate_matrix(q), R @ ω)
    polar_rate = _pairs(_dot(k_rate, along), _dot(k_rate, across) / κ)
    return q, np.concatenate([v, euler_rate, polar_rate])


def _polar_forces(q: Array, bend_moment: Array) -> Array:
    """Return (Q_κ, Q_ψa) of every section (2N,) [N m², N m] from bend moments (N, 2) [N m²]."""
    along, across = _directions(q)
    return _pairs(_dot(bend_moment, along), polar_of(q)[0] * _dot(bend_moment, across))


def _regular_rates(q: Array, qd: Array, qdd: Array) -> tuple[Array, Array, Array]:
    """Return v̇ of B in world axes, ω̇ in body axes, and k̈ of the bend vectors (N, 2)."""
    ω_rate = spin_rate(q, qd, qdd)
    along, across = _directions(q)
    (κ, _), (κ_d, ψ_d), (κ_dd, ψ_dd) = polar_of(q), polar_of(qd), polar_of(qdd)
    radial = κ_dd - κ * ψ_d**2
    circular = κ * ψ_dd + 2.0 * κ_d * ψ_d
    return qdd[:3], ω_rate, radial[:, None] * along + circular[:, None] * across


def spin_rate(q: Array, qd: Array, qdd: Array) -> Array:
    """Return ω̇ (3,) in body axes, from the paper's coordinates and their first two derivatives."""
    T_rate = euler_rate_matrix(q + 1j * _COMPLEX_STEP * qd).imag / _COMPLEX_STEP
    # The rate of ω is the same vector seen from body and world, as ω × ω is 0.
    turned = euler_rate_matrix(q) @ qdd[3:6] + T_rate @ qd[3:6]
    return np.asarray(rotation(q).T @ turned)


def _directions(q: Array) -> tuple[Array, Array]:
    """Return unit vectors (N, 2) along the bends and across them."""
    _, ψ = polar_of(q)
    sine, cosine = np.sin(ψ), np.cos(ψ)
    return np.stack([cosine, sine], axis=-1), np.stack([-sine, cosine], axis=-1)


def _euler_angles(R: Array) -> Array:
    """Return (φ, θ, ψ) of a rotation, body to world, Eq. (7)."""
    cosine = np.hypot(R[2, 1], R[2, 2])
    if cosine < 1e-9:
        raise InputError(
            "attitude",
            "is a pitch of a quarter turn, which has no Euler rates",
            "give another, or use continuair.accelerations",
        )
    return np.array(
        [
            np.arctan2(R[2, 1], R[2, 2]),
            np.arctan2(-R[2, 0], cosine),
            np.arctan2(R[1, 0], R[0, 0]),
        ]
    )


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(-1))


def _pairs(κ: Array, ψ: Array) -> Array:
    """Return two numbers of each section (N,) in the order of q (2N,)."""
    return np.column_stack([κ, ψ]).ravel()
