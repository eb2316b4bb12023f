"""The paper's model as printed, in its own coordinates: to read beside the paper, and to fly.

q = [x y z φ θ ψ κ ψa]. Plain NumPy on top of `continuair.equations`, integrated by SciPy with
tolerances: a flight of a second takes seconds. `compiled` flies the same formulas compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS, bend_torques, tip_chirp
from amiri2026.table.points import point_jacobian, points_of
from amiri2026.table.reading import MODELS, Reading, masks
from continuair import Vehicle, checks
from continuair.equations import check_without_drag
from continuair.errors import InputError
from continuair.vehicle import check_one_section

Array = np.ndarray

NODES = 8
"""Gauss nodes on the backbone: the integrals err by 3e-7 at a full circle."""

GRAVITY = 9.81
"""[m/s²]; the paper prints no value."""

FULL_CIRCLE = 2.0 * np.pi
"""Bend angle |κ| l from which on the arm passes through itself [rad]."""

FLOWN, CURLED, SINGULAR, STOPPED = 0, 1, 2, 3
STATUS = {
    FLOWN: "flown to the end",
    CURLED: "the arm curls past a full circle",
    SINGULAR: "no step is short enough, as where the mass matrix is singular",
    STOPPED: "the step limit is reached",
}

ALL, _IN_PLANE = tuple(range(8)), (0, 2, 4, 6)

_COMPLEX_STEP = 1e-30


@dataclass(frozen=True)
class Flight:
    """Samples of a flight: time (n,) [s], q and q̇ (n, 8), NaN from an early end on; its status."""

    time: Array
    q: Array
    qd: Array
    status: int


def check_flight(test: str, model: str, tolerance: float) -> None:
    """Raise InputError for an unknown test or model, and a tolerance outside (0, 0.01]."""
    checks.choice("test", test, OPEN_LOOP_TESTS)
    checks.choice("model", model, MODELS)
    if checks.positive("tolerance", tolerance) > 1e-2:
        raise InputError("tolerance", f"is {tolerance:g}", "give at most 0.01")


def sample_times(sample: float, duration: float) -> Array:
    """Return times (n,) from 0 to the duration; InputError unless the sample divides it [s]."""
    checks.positive("duration", duration, " [s]")
    count = round(duration / checks.positive("sample", sample, " [s]"))
    if count < 1 or abs(count * sample / duration - 1.0) > 1e-9:
        raise InputError(
            "sample", f"is {sample:g} s, which does not divide {duration:g} s", "change it"
        )
    return np.linspace(0.0, duration, count + 1)


class PrintedModel:
    """Eq. (10) under a reading, M q̈ + C q̇ + G = τ - J_tᵀ F_e, of a UAV with one section.

    Remark 1 puts κ_s for κ, |κ| <= κ_s, into M, C, G and J_t; the spring keeps κ. Raises InputError
    for a vehicle with several sections or arms, with drag, or with κ_s beyond a full circle.
    """

    def __init__(self, vehicle: Vehicle, reading: Reading, nodes: int = NODES) -> None:
        check_one_section(vehicle)
        check_without_drag(vehicle)
        if reading.remark1 and vehicle.arm.kappa_s * vehicle.arm.length > FULL_CIRCLE:
            raise InputError(
                "arm.kappa_s",
                f"is {vehicle.arm.kappa_s:g} 1/m, which bends the arm past a full circle",
                "give a smaller one",
            )
        self.vehicle, self.reading = vehicle, reading
        self.points = points_of(vehicle, rotary_inertia=reading.rotary_inertia, nodes=nodes)
        self.mount = np.asarray(vehicle.arms[0].mount, float)
        self.threshold = vehicle.arm.kappa_s if reading.remark1 else 0.0

    def side(self, κ: float) -> int:
        """Return 0 where Remark 1 replaces κ, else the sign of κ."""
        return 0 if abs(κ) <= self.threshold else int(np.sign(κ))

    def in_kinematics(self, q: Array, side: int | None = None) -> Array:
        """Return q with κ_s for κ where Remark 1, Eq. (6), replaces it: at `side` 0."""
        if (self.side(q[6]) if side is None else side) != 0:
            return q
        return np.concatenate([q[:6], [self.threshold], q[7:]])

    def matrices(self, q: Array, qd: Array, side: int | None = None) -> tuple[Array, Array, Array]:
        """Return M (8, 8), C (8, 8) and G (8,) of Eq. (10), spring included, without masks."""
        points = self.points
        # A complex step along q̇ gives J, and its rate exactly to rounding.
        along = self.in_kinematics(q, side) + 1j * _COMPLEX_STEP * qd
        found = point_jacobian(along, points.s, points.offset, self.mount)
        J, J_rate = found.real, found.imag / _COMPLEX_STEP
        M = np.einsum("n,nki,nkj->ij", points.mass, J, J)
        C = np.einsum("n,nki,nkj->ij", points.mass, J, J_rate)
        G = GRAVITY * np.einsum("n,ni->i", points.mass, J[:, 2])
        arm = self.vehicle.arm
        G[6] += arm.bending_stiffness * arm.length * q[6]
        return M, C, G

    def tip_jacobian(self, q: Array, side: int | None = None) -> Array:
        """Return J_t (3, 8), linear rows, world axes."""
        length = np.array(self.vehicle.arm.length)
        return point_jacobian(self.in_kinematics(q, side), length, np.zeros(3), self.mount)

    def damping(self, q: Array, qd: Array, side: int | None = None) -> Array:
        """Return structural damping (8,), which the paper does not print."""
        found = np.zeros(8)
        found[6] = qd[6]
        if self.reading.damping == "bend vector":
            found[7] = self.in_kinematics(q, side)[6] ** 2 * qd[7]
        return self.vehicle.arm.structural_damping * self.vehicle.arm.length * found

    def accelerations(
        self,
        q: Array,
        qd: Array,
        tau: Any = 0.0,
        tip_force: Any = (0.0, 0.0, 0.0),
        model: str = "coupled",
        side: int | None = None,
        moving: tuple[int, ...] = ALL,
    ) -> Array:
        """Return q̈ (8,) of "coupled", or of a decoupled model as `Reading` names them.

        tau: (8,), conjugate to q. tip_force: F_e (3,), world axes [N]. moving: indices of the
        coordinates that are not held at rest.
        """
        M, C, G = self.matrices(q, qd, side)
        on_M, on_C = masks(model)
        pushed = tau + self.reading.force_sign * self.tip_jacobian(q, side).T @ np.asarray(
            tip_force
        )
        rest = pushed - (on_C * C) @ qd - G - self.damping(q, qd, side)
        free = np.array(moving)
        qdd = np.zeros(8)
        qdd[free] = np.linalg.solve((on_M * M)[np.ix_(free, free)], rest[free])
        return qdd

    def moving(self, test: str) -> tuple[int, ...]:
        """Return indices of the coordinates that move.

        In Tests A and B these are x, z, θ and κ for a vehicle that is its mirror image in y. The
        others stay 0 by symmetry. With Remark 1 rounding errors in them would grow without bound,
        and at θ = π/2 M is singular in φ and ψ.
        """
        inertia = np.asarray(self.vehicle.uav.inertia)
        mirrored = not inertia[[0, 1], [1, 2]].any() and self.mount[1] == 0.0
        return _IN_PLANE if test in "AB" and mirrored else ALL

    def start(self) -> Array:
        """Return q (8,) of all tests, with 0.1 in the unit that the reading gives it."""
        κ = 0.1 if self.reading.kappa == "1/m" else 0.1 / self.vehicle.arm.length
        return np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0, κ, 0.0])

    def inputs(self, test: str, t: float) -> tuple[Array, Array]:
        """Return τ (8,) and F_e (3,) of Tests A to D as printed."""
        tau, force = np.zeros(8), np.zeros(3)
        if test == "A":
            tau[0] = 100.0
        if test == "C":
            tau += bend_torques(t)
            if self.reading.kappa == "bend angle":
                # The force conjugate to κ l is 1/l of that conjugate to κ.
                tau[6] *= self.vehicle.arm.length
        if test == "D":
            force += tip_chirp(t)[:3]
        return tau, force

    def fly(
        self,
        test: str,
        model: str = "coupled",
        *,
        tolerance: float = 1e-8,
        sample: float = 1e-3,
        duration: float = 1.0,
        most: int = 100_000,
    ) -> Flight:
        """Fly a test from rest with SciPy's DOP853, which takes seconds to minutes.

        Where κ crosses the jump of Remark 1, a step ends. most: steps after which the flight stops.
        """
        # SciPy's integrators are slow to import.
        from scipy.integrate import DOP853

        time = sample_times(sample, duration)
        check_flight(test, model, tolerance)
        states = np.full((len(time), 16), np.nan)
        states[0] = np.concatenate([self.start(), np.zeros(8)])
        t, y, filled, status = 0.0, states[0], 1, FLOWN
        side = self.side(y[6])
        while filled < len(time) and status == FLOWN:
            flow = DOP853(
                self._rate(test, model, side), t, y, duration, rtol=tolerance, atol=tolerance
            )
            crossed = False
            while flow.status == "running" and not crossed:
                flow.step()
                most -= 1
                status = self._status(flow.y, flow.status == "failed", most < 0)
                if status != FLOWN:
                    break
                end, passed = flow.t, flow.dense_output()
                crossed = self._left(flow.y[6], side)
                if crossed:
                    end = self._crossing(passed, side, flow.t_old, flow.t)
                while filled < len(time) and time[filled] <= end + 1e-12:
                    states[filled] = passed(min(time[filled], end))
                    filled += 1
                t, y = end, passed(end)
            side = int(np.sign(y[6])) if side == 0 else 0
        return Flight(time, states[:, :8], states[:, 8:], status)

    def _rate(self, test: str, model: str, side: int) -> Callable[[float, Array], Array]:
        moving = self.moving(test)

        def rate(t: float, y: Array) -> Array:
            q, qd = y[:8], y[8:]
            try:
                with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                    qdd = self.accelerations(q, qd, *self.inputs(test, t), model, side, moving)
            except np.linalg.LinAlgError:
                qdd = np.full(8, np.nan)
            return np.concatenate([qd, qdd])

        return rate

    def _left(self, κ: float, side: int) -> bool:
        """Return whether κ has left its side of the jump of Remark 1."""
        if side == 0:
            return abs(κ) > self.threshold
        return self.threshold > 0.0 and side * κ < self.threshold

    def _crossing(
        self, passed: Callable[[float], Array], side: int, begin: float, end: float
    ) -> float:
        """Return first time [s] after a step's begin at which κ has left its side, by bisection."""
        while end - begin > 4.0 * np.spacing(end):
            middle = 0.5 * (begin + end)
            if self._left(passed(middle)[6], side):
                end = middle
            else:
                begin = middle
        return end

    def _status(self, y: Array, failed: bool, stopped: bool) -> int:
        if failed or not np.isfinite(y).all():
            return SINGULAR
        if abs(y[6]) * self.vehicle.arm.length > FULL_CIRCLE:
            return CURLED
        return STOPPED if stopped else FLOWN
