"""Stability of a flight controller's loop around the hovering vehicle, and its delay margin.

The loop is sampled: actuator wrenches are held for a period and act after a latency, and rotors
follow them with a lag of first order. Its poles are those of the exact discrete system.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.linalg import expm

from continuair.controllers.hover import Hover
from continuair.equations.kinematics import skew

Array = np.ndarray

STEADY = 1e-3
"""Growth that counts as none, as that of an arm without damping [1/s]."""

_LONGEST = 0.25
"""Latency up to which margins are searched [s]."""

_FINER = 1.05
"""Latencies that are tried one after the other, as a ratio: a mode that is swung up between two of
them, as its phase turns by, is missed."""


class LinearLoop:
    """A flight controller around a hovering vehicle.

    gains: of controllers/flight.py by name; feedforward: one of FEEDFORWARD; lag: of the rotors
    [s].
    """

    def __init__(
        self, hover: Hover, gains: Mapping[str, Any], feedforward: str, lag: float = 0.0
    ) -> None:
        self.hover, self.period = hover, float(gains["period"])
        self.A, self.B = _with_lag(hover, lag)
        self.K, self.memory = _law(hover, gains, feedforward)

    def matrix(self, latency: float) -> Array:
        """Return the step of state, actuators, memory and delayed wrenches over one sample."""
        late, n, m = int(latency / self.period + 1e-9), *self.B.shape
        rest = max(0.0, latency - late * self.period)
        through, first, second = self._held(rest)
        width = self.hover.A.shape[0]
        known = n + len(self.memory)
        size = known + m * (late + 1)
        own = np.r_[:width, n:known]
        push = np.zeros((m, size))
        push[:, own] = self.K
        # Wrenches that act in the first part of a period, and in the rest of it.
        queue = [push, *(np.eye(m, size, known + m * k) for k in range(late + 1))]
        found = np.zeros((size, size))
        found[:n, :n] = through
        found[:n] += first @ queue[late + 1] + second @ queue[late]
        found[n:known, own] = self.memory
        for k in range(late + 1):
            found[known + m * k : known + m * (k + 1)] = queue[k]
        return found

    def growth(self, latency: float) -> float:
        """Return the growth rate of the loop's least stable mode [1/s], negative if it decays."""
        radius = np.abs(np.linalg.eigvals(self.matrix(latency))).max()
        return float(np.log(radius) / self.period)

    def stable(self, latency: float) -> bool:
        """Return whether no mode grows."""
        return self.growth(latency) <= STEADY

    def longest_latency(self, latency: float = 0.0) -> float:
        """Return the latency up to which the loop is stable [s], at most max(0.25, 1.5 latency).

        It is negative if the loop is unstable without latency.
        """
        most = max(_LONGEST, 1.5 * latency)
        if not self.stable(0.0):
            return -1.0
        low, high = 0.0, 0.25 * self.period
        while self.stable(high):
            low, high = high, _FINER * high
            if low > most:
                return most
        while high - low > 1e-3 * high:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.stable(middle) else (low, middle)
        return low

    def _held(self, rest: float) -> tuple[Array, Array, Array]:
        """Return Φ of a period, and Γ of an input in its first `rest` seconds, and after them."""
        n, m = self.B.shape
        both = np.zeros((n + m, n + m))
        both[:n, :n], both[:n, n:] = self.A, self.B
        early, late = expm(both * rest), expm(both * (self.period - rest))
        return late[:n, :n] @ early[:n, :n], late[:n, :n] @ early[:n, n:], late[:n, n:]


def _with_lag(hover: Hover, lag: float) -> tuple[Array, Array]:
    """Return A and B with the rotors' lag of thrust and moment."""
    if lag == 0.0:
        return hover.A, hover.B
    n, m = hover.B.shape
    A, B = np.zeros((n + 4, n + 4)), np.zeros((n + 4, m))
    A[:n, :n], A[:n, n:] = hover.A, hover.B[:, :4]
    A[n:, n:] = -np.eye(4) / lag
    B[:n, 4:], B[n:, :4] = hover.B[:, 4:], np.eye(4) / lag
    return A, B


def _law(hover: Hover, gains: Mapping[str, Any], feedforward: str) -> tuple[Array, Array]:
    """Return the law about hover, as matrices on the state and the memory.

    They give wrenches (4 + bends, …) and the next memory (3 + bends, …): the integral and the
    low-pass filtered bend rates.
    """
    n, m, g = hover.bends, hover.mass, hover.gravity
    states = np.eye(15 + 3 * n)
    p, turn, b = states[:3], states[3:6], states[6 : 6 + n]
    v, w, db = states[6 + n : 9 + n], states[9 + n : 12 + n], states[12 + n : 12 + 2 * n]
    integral, washed = states[12 + 2 * n : 15 + 2 * n], states[15 + 2 * n :]
    miss = -gains["position"][:, None] * p - v
    asked = gains["velocity"][:, None] * miss + integral
    held = (gains["bend_limit"] > 0.0).astype(float)
    servo = gains["bend_inertia"] @ (-gains["bend_stiffer"] * b - gains["bend_damper"] * db)
    thrust, F, L = m * asked[2], hover.M[:3, 6:], hover.M[3:6, 6:]
    moment, bend = np.zeros_like(asked), servo
    if feedforward != "none":
        moment = -g * skew(np.array([0.0, 0.0, 1.0])) @ (F @ b)
        moment = moment + np.outer(skew(hover.moment)[:, 2], thrust / m)
        bend = servo + held[:, None] * (hover.weight @ b + np.outer(F[2], thrust / m))
    ddb = gains["bend_washout"] * (db - washed)
    if feedforward == "reaction":
        asked, thrust = asked + F @ ddb / m, thrust + F[2] @ ddb
        moment = moment + L @ ddb - skew(hover.moment) @ (F @ ddb) / m
    tilt = np.stack([-asked[1] / g, asked[0] / g, 0.0 * asked[2]])
    turning = gains["attitude"][:, None] * (tilt - turn) - gains["spin"][:, None] * w
    K = np.vstack([thrust, gains["inertia"] @ turning + moment, bend])
    integral = integral + gains["period"] * gains["integral"][:, None] * miss
    return K, np.vstack([integral, washed + gains["period"] * ddb])
