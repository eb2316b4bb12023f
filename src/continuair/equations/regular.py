"""Accelerations in coordinates without singularities, by way of the paper's.

To q and q̇, through the equation of motion, Eq. (10), and back: what the kernels, which know no
Euler angles and no polar bend, are compared with.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.equations.dynamics import forward_dynamics, of_shape
from continuair.equations.kinematics import Array, euler_rate_matrix
from continuair.equations.turns import of_quaternion
from continuair.errors import InputError
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
    (N, 2) over all sections, arm by arm from the base out [1/m, 1/(m s), N m²]. velocity of B's
    origin and force at it: (3,), world axes; angular velocity and moment: (3,), body axes.
    tip_wrench: (arms, 6), world axes. All but attitude and bend may be 0 for none. mask, nodes: as
    in `forward_dynamics`. Returns v̇ (3,) in world axes, ω̇ (3,) in body axes and k̈ (N, 2).

    Polar bend and Euler angles cost digits, as 1/κ² and 1/cos θ. Raises InputError where they fail,
    at a bend of 0 and a pitch of a quarter turn, and for a wrong shape.
    """
    vectors = {"velocity": velocity, "angular_velocity": angular_velocity}
    vectors |= {"force": force, "moment": moment}
    v, ω, F, M = (of_shape(*each, (3,), or_zero=True) for each in vectors.items())
    bends = {"bend": bend, "bend_rate": bend_rate, "bend_moment": bend_moment}
    per_section = (vehicle.sections, 2)
    k, k_rate, Q = (of_shape(*each, per_section, or_zero=True) for each in bends.items())
    wrenches = of_shape("tip_wrench", tip_wrench, (len(vehicle.arms), 6), or_zero=True).ravel()
    R = of_quaternion(of_shape("attitude", attitude, (4,)))
    κ, along, across = _polar(k)
    q = np.concatenate([np.zeros(3), _euler_angles(R), _pairs(κ, np.arctan2(k[:, 1], k[:, 0]))])
    T = euler_rate_matrix(q)
    euler_rate = np.linalg.solve(T, R @ ω)
    κ_rate, ψ_rate = _dot(k_rate, along), _dot(k_rate, across) / κ
    qd = np.concatenate([v, euler_rate, _pairs(κ_rate, ψ_rate)])
    tau = np.concatenate([F, T.T @ R @ M, _pairs(_dot(Q, along), κ * _dot(Q, across))])
    qdd = forward_dynamics(vehicle, q, qd, tau, wrenches, mask=mask, gravity=gravity, nodes=nodes)
    T_rate = euler_rate_matrix(q + 1j * _COMPLEX_STEP * qd).imag / _COMPLEX_STEP
    ω_rate = R.T @ (T @ qdd[3:6] + T_rate @ euler_rate)
    radial = qdd[6::2] - κ * ψ_rate**2
    circular = κ * qdd[7::2] + 2.0 * κ_rate * ψ_rate
    return qdd[:3], ω_rate, radial[:, None] * along + circular[:, None] * across


def _polar(bend: Array) -> tuple[Array, Array, Array]:
    """|κ| (N,), and unit vectors (N, 2) along the bends and across them."""
    κ = np.hypot(bend[:, 0], bend[:, 1])
    if not κ.all():
        raise InputError(
            "bend holds a section with bend 0, which has no polar coordinates; give it a bend, or "
            "use continuair.accelerations."
        )
    along = bend / κ[:, None]
    return κ, along, np.stack([-along[:, 1], along[:, 0]], axis=-1)


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
