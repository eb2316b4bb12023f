"""Accelerations in coordinates without singularities, by way of the paper's.

To q and q̇, through the equation of motion, Eq. (10), and back: what the kernels, which know no
Euler angles and no polar bend, are compared with.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.equations.dynamics import forward_dynamics, of_shape
from continuair.equations.kinematics import Array, euler_rate_matrix, rotation, unbounded
from continuair.equations.turns import of_quaternion
from continuair.errors import InputError
from continuair.vehicle.arc import bend_vectors, polar_of
from continuair.vehicle.vehicle import Vehicle

_COMPLEX_STEP = 1e-30


def accelerations(
    vehicle: Vehicle,
    *,
    bend: Any,
    attitude: Any = (0.0, 0.0, 0.0, 1.0),
    velocity: Any = 0.0,
    angular_velocity: Any = 0.0,
    bend_rate: Any = 0.0,
    force: Any = 0.0,
    moment: Any = 0.0,
    bend_moment: Any = 0.0,
    tip_wrench: Any = 0.0,
    gravity: float = 9.81,
    mask: Any = "coupled",
    nodes: int = 24,
) -> tuple[Array, Array, Array]:
    """(v̇, ω̇, k̈) of a state: what `continuair.accelerations` says of one run, by Eq. (10).

    attitude: (4,) x y z w, body to world, of any length above 0. bend, bend_rate, bend_moment:
    (N, 2) over all sections, arm by arm from the base out [1/m, 1/(m s), N m²]. velocity, force:
    (3,) of B's origin and at it, world axes. angular_velocity, moment: (3,), body axes.
    tip_wrench: (arms, 6), world axes. mask, nodes: as in `forward_dynamics`.

    All but attitude and bend may be 0 for none. Returns v̇ (3,) in world axes, ω̇ (3,) in body axes
    and k̈ (N, 2).

    Polar bend and Euler angles cost digits, as 1/κ² and 1/cos θ. Raises InputError where they fail,
    at a bend of 0 and a pitch of a quarter turn, for a wrong shape, and for a vehicle with drag.
    """
    vectors = {"velocity": velocity, "angular_velocity": angular_velocity}
    vectors |= {"force": force, "moment": moment}
    v, ω, F, M = (of_shape(*each, (3,), or_zero=True) for each in vectors.items())
    bends = {"bend": bend, "bend_rate": bend_rate, "bend_moment": bend_moment}
    per_section = bend_vectors(np.zeros(vehicle.layout.bends)).shape
    k, k_rate, Q = (of_shape(*each, per_section, or_zero=True) for each in bends.items())
    wrenches = of_shape("tip_wrench", tip_wrench, (len(vehicle.arms), 6), or_zero=True).ravel()
    turned = of_shape("attitude", attitude, (4,))
    if not turned.any():
        raise InputError("attitude has length 0; give a quaternion x y z w.")
    R = of_quaternion(turned)
    # Bend vectors need no Remark 1, whose κ_s in M, C and G contradicts the κ that q and q̇ are of.
    vehicle = unbounded(vehicle)
    q, qd = _paper_motion(R, v, ω, k, k_rate)
    tau = np.concatenate([F, euler_rate_matrix(q).T @ R @ M, _polar_forces(q, Q)])
    qdd = forward_dynamics(vehicle, q, qd, tau, wrenches, mask=mask, gravity=gravity, nodes=nodes)
    return _regular_rates(q, qd, qdd)


def _paper_motion(R: Array, v: Array, ω: Array, k: Array, k_rate: Array) -> tuple[Array, Array]:
    """q and q̇ of a vehicle whose B is at the world's origin; R: body to world."""
    κ = np.hypot(k[:, 0], k[:, 1])
    if not κ.all():
        raise InputError(
            "bend holds a section with bend 0, which has no polar coordinates; give it a bend, or "
            "use continuair.accelerations."
        )
    q = np.concatenate([np.zeros(3), _euler_angles(R), _pairs(κ, np.arctan2(k[:, 1], k[:, 0]))])
    along, across = _directions(q)
    euler_rate = np.linalg.solve(euler_rate_matrix(q), R @ ω)
    polar_rate = _pairs(_dot(k_rate, along), _dot(k_rate, across) / κ)
    return q, np.concatenate([v, euler_rate, polar_rate])


def _polar_forces(q: Array, bend_moment: Array) -> Array:
    """(Q_κ, Q_ψa) of every section (2N,) [N m², N m] of bend moments (N, 2) [N m²]."""
    along, across = _directions(q)
    return _pairs(_dot(bend_moment, along), polar_of(q)[0] * _dot(bend_moment, across))


def _regular_rates(q: Array, qd: Array, qdd: Array) -> tuple[Array, Array, Array]:
    """(v̇, ω̇, k̈): of B in world axes, of the body in its own axes, of the bend vectors (N, 2)."""
    T_rate = euler_rate_matrix(q + 1j * _COMPLEX_STEP * qd).imag / _COMPLEX_STEP
    # The rate of ω is the same vector seen from body and world, as ω × ω is 0.
    ω_rate = rotation(q).T @ (euler_rate_matrix(q) @ qdd[3:6] + T_rate @ qd[3:6])
    along, across = _directions(q)
    (κ, _), (κ_d, ψ_d), (κ_dd, ψ_dd) = polar_of(q), polar_of(qd), polar_of(qdd)
    radial = κ_dd - κ * ψ_d**2
    circular = κ * ψ_dd + 2.0 * κ_d * ψ_d
    return qdd[:3], ω_rate, radial[:, None] * along + circular[:, None] * across


def _directions(q: Array) -> tuple[Array, Array]:
    """Unit vectors (N, 2) along the bends and across them."""
    _, ψ = polar_of(q)
    sine, cosine = np.sin(ψ), np.cos(ψ)
    return np.stack([cosine, sine], axis=-1), np.stack([-sine, cosine], axis=-1)


def _euler_angles(R: Array) -> Array:
    """(φ, θ, ψ) of a rotation, body to world, Eq. (7)."""
    cosine = np.hypot(R[2, 1], R[2, 2])
    if cosine < 1e-9:
        raise InputError(
            "attitude is a pitch of a quarter turn, which has no Euler rates; give another, or use "
            "continuair.accelerations."
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
    """Two numbers of each section (N,), in the order of q (2N,)."""
    return np.column_stack([κ, ψ]).ravel()
