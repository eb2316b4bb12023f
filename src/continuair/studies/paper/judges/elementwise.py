"""Flights of the decoupled model read element by element, in the paper's coordinates q.

With all off-diagonal elements of M and C zero, what is left of the Christoffel matrix is
C_ii = ½ Ṁ_ii, and each coordinate moves alone: M_ii q̈_i + ½ Ṁ_ii q̇_i + G_i = τ_i − (J_tᵀ F_e)_i.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair import equations
from continuair.equations.kinematics import Array, tangents
from continuair.equations.masses import slices
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

_NODES = 8
"""On the backbone."""

_COMPLEX_STEP = 1e-30

_TOLERANCE = 1e-3
"""Of the integration, relative; where the arm passes straight ψa spins, and takes most steps."""


class Elementwise:
    """The model of a vehicle."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        # The tip, where the wrench acts, is the last of the places.
        self._s, *inertias = np.hstack(
            [slices(vehicle.arm, _NODES), [[vehicle.arm.length], [0.0], [0.0], [0.0]]]
        )
        self._mass, self._transverse, self._axial = inertias

    def accelerations(
        self, q: Array, qd: Array, tau: Any = 0.0, wrench: Any = 0.0, gravity: float = 9.81
    ) -> Array:
        """q̈ (8,) under generalised forces (8,) and a wrench (6,) on the tip, world axes; or 0."""
        # One complex step along q̇ gives M and its rate.
        ahead = q + 1j * _COMPLEX_STEP * qd
        J = equations.jacobian(self.vehicle, ahead, self._s)
        along = np.einsum("ni,nij->nj", tangents(self.vehicle, ahead, self._s), J[:, 3:])
        M = self._mass @ (J[:, :3] ** 2).sum(axis=1)
        M += self._transverse @ (J[:, 3:] ** 2).sum(axis=1)
        M += (self._axial - self._transverse) @ along**2
        turn = equations.rotation(ahead).T @ equations.euler_rate_matrix(ahead)
        M[3:6] += (turn * (np.asarray(self.vehicle.uav.inertia) @ turn)).sum(axis=0)
        M[:3] += self.vehicle.uav.mass
        weight = gravity * (self._mass @ J[:, 2].real)
        weight[2] += gravity * self.vehicle.uav.mass
        push = tau - weight - equations.elastic_vector(self.vehicle, q)
        push = push - equations.damping_vector(self.vehicle, q, qd)
        if np.any(wrench):
            push = push + J[-1].real.T @ wrench
        return (push - 0.5 * M.imag / _COMPLEX_STEP * qd) / M.real

    def tip_path(self, scenario: Scenario, times: Array) -> Array:
        """Positions (times, 3) of the tip in the world [m], from rest; to 1 % of its bending.

        NaN from where the integration does not get on.
        """
        # SciPy's integrators are slow to import.
        from scipy.integrate import solve_ivp

        def slope(t: float, y: Array) -> Array:
            wrench = scenario.tip_wrench_sign * np.asarray(_at(scenario.tip_wrench, t))
            q, qd = y[:8], y[8:]
            return np.concatenate(
                [qd, self.accelerations(q, qd, _at(scenario.tau, t), wrench, scenario.gravity)]
            )

        start = np.concatenate([np.asarray(scenario.q, float), np.zeros(8)])
        flown = solve_ivp(
            slope, times[[0, -1]], start, "RK45", times, rtol=_TOLERANCE, atol=0.1 * _TOLERANCE
        )
        path = np.full((len(times), 3), np.nan)
        for row, y in enumerate(flown.y.T):
            path[row] = equations.position(self.vehicle, y[:8], self.vehicle.arm.length)
        return path


def _at(given: Any, t: float) -> Any:
    """A scenario's input at a time: of a function of it, a constant, or 0 for nothing."""
    value = given(t) if callable(given) else given
    return 0.0 if value is None else np.asarray(value, float)
