"""Accelerations of vehicles with sections of any kind, by Eq. (10) with numerical derivatives.

The readable form of what the kernels do for sections whose strain varies. Coordinates are B's
position, the Euler angles, and those of the sections, as in a state. Derivatives of M and of the
weight are central differences of the sixth order.
"""

from __future__ import annotations

import numpy as np

from continuair.equations.dynamics import Mask, check_without_drag, masked, of_shape
from continuair.equations.kinematics import Array, euler_rate_matrix, rotation
from continuair.equations.level import level_inertia
from continuair.equations.regular import checked_rotation, spin_rate
from continuair.equations.turns import euler_angles
from continuair.typing import ArrayLike
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

_FAR = 0.02
"""Step of the differences [rad], and for the sections in parts of their natural units."""

_GAUSS = 8
"""Nodes along a section at which its stiffness is taken."""

_WEIGHTS = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
_PLACES = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])


def rod_accelerations(
    vehicle: Vehicle,
    *,
    strain: ArrayLike,
    attitude: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    velocity: ArrayLike = 0.0,
    angular_velocity: ArrayLike = 0.0,
    strain_rate: ArrayLike = 0.0,
    force: ArrayLike = 0.0,
    moment: ArrayLike = 0.0,
    strain_force: ArrayLike = 0.0,
    gravity: float = 9.81,
    mask: Mask = "coupled",
) -> tuple[Array, Array, Array]:
    """Return the accelerations of a state, for comparison with `continuair.accelerations`.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch) without drag or terms of its own.
    strain : array_like (n,)
        Coordinates of all sections, as in `continuair.accelerations`; bend vectors of arcs [1/m].
    attitude : array_like (4,), default (0, 0, 0, 1)
        Quaternion x y z w, body to world, of any length above 0.
    velocity : array_like (3,) or 0, default 0
        Velocity of B's origin, world axes [m/s].
    angular_velocity : array_like (3,) or 0, default 0
        Angular velocity, body axes [rad/s].
    strain_rate : array_like (n,) or 0, default 0
        Rates of the coordinates.
    force : array_like (3,) or 0, default 0
        Force at B's origin, world axes [N].
    moment : array_like (3,) or 0, default 0
        Moment, body axes [N m].
    strain_force : array_like (n,) or 0, default 0
        Generalised forces conjugate to the coordinates.
    gravity : float, default 9.81
        Gravitational acceleration, downwards [m/s²].
    mask : {"coupled", "block", "diagonal"} or array_like, default "coupled"
        Factors of M and C, as in `forward_dynamics`.

    Returns
    -------
    velocity_rate : array (3,)
        Acceleration of B's origin, world axes [m/s²].
    angular_velocity_rate : array (3,)
        Angular acceleration, body axes [rad/s²].
    strain_acceleration : array (n,)
        Second derivatives of the coordinates.

    Raises
    ------
    InputError
        If a shape differs, the mask is unknown, or the vehicle has drag or terms of its own.

    Notes
    -----
    Eq. (10) of Amiri et al. (2026) for other coordinates of the arm. At a pitch of ±90° the Euler
    angles have no rates. The differences leave errors of some 1e-10.
    """
    check_without_drag(vehicle)
    n = vehicle.layout.bends
    v, ω, F, N = (
        of_shape(name, value, (3,), or_zero=True)
        for name, value in (
            ("velocity", velocity),
            ("angular_velocity", angular_velocity),
            ("force", force),
            ("moment", moment),
        )
    )
    b, b_rate, Q = (
        of_shape(name, value, (n,), or_zero=True)
        for name, value in (
            ("strain", strain), ("strain_rate", strain_rate), ("strain_force", strain_force),
        )
    )  # fmt: skip
    R = checked_rotation(attitude)
    q = np.concatenate([np.zeros(3), euler_angles(R), b])
    T = euler_rate_matrix(q[:6])
    qd = np.concatenate([v, np.linalg.solve(T, R @ ω), b_rate])
    M = _mass_matrix(vehicle, q)
    slopes, G = _slopes(vehicle, q, gravity)
    C = 0.5 * np.einsum("kij,k->ij", slopes, qd)
    C += 0.5 * np.einsum("jik,k->ij", slopes - slopes.transpose(1, 0, 2), qd)
    kept, stiff = masked(mask, len(q)), _stiffness(vehicle)
    pushed = np.concatenate([F, T.T @ R @ N, Q - stiff[0] @ b - stiff[1] @ b_rate])
    qdd = np.linalg.solve(kept * M, pushed - (kept * C) @ qd - G)
    return qdd[:3], spin_rate(q, qd, qdd), qdd[6:]


def _mass_matrix(vehicle: Vehicle, q: Array) -> Array:
    """Return M for the rates of q."""
    return _in_coordinates(level_inertia(vehicle, q[6:]), rotation(q[:6]), euler_rate_matrix(q[:6]))


def _in_coordinates(M: Array, R: Array, T: Array) -> Array:
    """Return M for the rates of q; M: for velocities in body axes."""
    A = np.eye(len(M))
    A[:3, :3], A[3:6, 3:6] = R.T, R.T @ T
    return np.asarray(A.T @ M @ A)


def _slopes(vehicle: Vehicle, q: Array, gravity: float) -> tuple[Array, Array]:
    """Return ∂M/∂q_k, k first, and the derivatives of the weight's potential energy."""
    slopes, G = np.zeros((len(q), len(q), len(q))), np.zeros(len(q))
    G[2] = vehicle.mass * gravity
    far = np.concatenate([np.zeros(3), np.full(3, _FAR), _FAR * _natural(vehicle)])
    for k in range(3, len(q)):
        for place, weight in zip(_PLACES, _WEIGHTS, strict=True):
            at = q.copy()
            at[k] += place * far[k]
            M = level_inertia(vehicle, at[6:])
            R, T = rotation(at[:6]), euler_rate_matrix(at[:6])
            slopes[k] += weight / far[k] * _in_coordinates(M, R, T)
            # The first moment of mass is in the block of M between velocity and turning.
            first = np.array([M[1, 5], M[2, 3], M[0, 4]])
            G[k] += weight / far[k] * gravity * (R @ first)[2]
    return slopes, G


def _natural(vehicle: Vehicle) -> Array:
    """Return 1/l of each coordinate that turns cross-sections, and 1 of the others."""
    return np.array([
        1.0 / part.length if index < part.orders.turning else 1.0
        for arm in vehicle.arms for part in arm.section for index in range(part.coordinates)
    ])  # fmt: skip


def _stiffness(vehicle: Vehicle) -> Array:
    """Return the matrices of stiffness and damping (2, n, n): ∫ k P_p P_q ds of a stiffness k."""
    found, first = np.zeros((2, vehicle.layout.bends, vehicle.layout.bends)), 0
    x, weights = np.polynomial.legendre.leggauss(_GAUSS)
    for part in (part for arm in vehicle.arms for part in arm.section):
        time = part.structural_damping / part.bending_stiffness
        for j, (component, order) in enumerate(part.orders.coordinates):
            for k, (other, power) in enumerate(part.orders.coordinates):
                if component == other:
                    values = np.polynomial.legendre.legval(x, np.eye(6)[[order, power]].T)
                    along = weights * _rigidity(part, component, 0.5 * (1.0 + x))
                    stiff = 0.5 * part.length * float(along @ values.prod(0))
                    found[:, first + j, first + k] = stiff, stiff * time
        first += part.coordinates
    return found


def _rigidity(part: Section, component: int, shares: Array) -> Array:
    """Return the stiffness of a component of the strain at shares of the length."""
    if not part.tapered:
        return np.full(len(shares), part.rigidities()[component])
    base, tip = part.radii()
    r = base + (tip - base) * shares
    modulus, bulk = part.youngs_modulus, 2.0 * (1.0 + (part.poisson_ratio or 0.0))
    twisted = np.pi / 2.0 * modulus / bulk * r**4
    bent, pulled, sheared = np.pi / 4.0 * modulus * r**4, np.pi * modulus * r**2, np.pi * r**2
    return np.asarray((bent, bent, twisted, pulled, *2 * (modulus / bulk * sheared,))[component])
