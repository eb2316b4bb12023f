"""Complexity of the models: terms of their equations, and the time for the bending arm."""

from __future__ import annotations

import numpy as np

from continuair import Vehicle, equations
from continuair.equations import euler_rate_matrix, rotation
from continuair.studies import median_times

Array = np.ndarray

_SEED, _ROUNDS = 0, 25

_NOTHING = 1e-12
"""A term below this share of the largest of its matrix is zero."""

_STEP = 1e-30
"""Complex step of slopes."""


def terms(vehicle: Vehicle, mask: str) -> int:
    """Return the number of products in M q̈ and in C q̇ at a general state.

    mask: of `equations.forward_dynamics`. C is linear in the rates: the factor of q̇_j q̇_k in a
    row is one term, whether it comes from one element of C or from two.
    """
    q, _ = _general_state()
    factors = equations.MASKS[mask]
    M = factors * equations.mass_matrix(vehicle, q)
    slopes = [factors * equations.coriolis_matrix(vehicle, q, rate) for rate in np.eye(8)]
    Γ = np.stack(slopes, axis=-1)
    quadratic = np.triu(Γ + np.swapaxes(Γ, 1, 2))
    return sum(int(np.sum(np.abs(x) > _NOTHING * np.abs(x).max())) for x in (M, quadratic))


def readable_times(vehicle: Vehicle) -> dict[str, float]:
    """Return the median times [s] in NumPy: "whole" of Eq. (10), its "spring", the "UAV" alone."""
    q, qd = _general_state()
    cases = {
        "whole": lambda: equations.forward_dynamics(vehicle, q, qd),
        "spring": lambda: equations.elastic_vector(vehicle, q),
        "UAV": lambda: uav_alone(vehicle, q, qd),
    }
    return median_times(cases, _ROUNDS)


def uav_alone(vehicle: Vehicle, q: Array, qd: Array, gravity: float = 9.81) -> Array:
    """Return accelerations (6,) of Eq. (10) without an arm, by the same means as with one."""
    slopes = np.zeros((6, 6, 6))
    for k in range(3, 6):
        shifted = q.astype(complex)
        shifted[k] += 1j * _STEP
        slopes[k] = _uav_mass(vehicle, shifted).imag / _STEP
    rates = qd[:6]
    C = 0.5 * (
        np.einsum("kij,k->ij", slopes, rates)
        + np.einsum("jik,k->ij", slopes, rates)
        - np.einsum("ijk,k->ij", slopes, rates)
    )
    G = np.array([0.0, 0.0, vehicle.uav.mass * gravity, 0.0, 0.0, 0.0])
    accelerations: Array = np.linalg.solve(_uav_mass(vehicle, q), -C @ rates - G)
    return accelerations


def _uav_mass(vehicle: Vehicle, q: Array) -> Array:
    uav = vehicle.uav
    R, T = rotation(q), euler_rate_matrix(q)
    M = np.zeros((6, 6), dtype=np.result_type(q, float))
    M[:3, :3] = uav.mass * np.eye(3)
    M[3:, 3:] = T.T @ R @ np.asarray(uav.inertia) @ R.T @ T
    return M


def _general_state() -> tuple[Array, Array]:
    generator = np.random.default_rng(_SEED)
    q, qd = generator.uniform(0.3, 1.0, 8), generator.uniform(0.3, 1.0, 8)
    return q, qd
