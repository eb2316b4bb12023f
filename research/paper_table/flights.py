"""Flying batches of candidate vehicles through the paper's four tests, reduced to their tips."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import continuair as ca
from research.paper_table.readings import Flight, Tips

Array = np.ndarray

_MODELS = {"block": "decoupled"}
_WANTED = ("tip_position", "tip_attitude", "q")


@dataclass(frozen=True)
class Accuracy:
    """phase: largest product of fastest rate and step; largest: step [s]; sample: between them."""

    phase: float
    largest: float
    sample: float


SEARCH = Accuracy(0.4, 2e-3, 4e-3)
"""While searching: errors of some percent of a metric, which the objective hardly sees."""

FINAL = Accuracy(0.1, 2.5e-4, 1e-3)
"""For what is reported."""

STEEPEST = 2e3
"""Vehicles of a faster bend [rad/s] are not flown: an arm so stiff hardly bends."""


def steps_of(vehicle: ca.Vehicle, accuracy: Accuracy) -> tuple[Array, Array]:
    """Steps [s] and whether there is a usable one, (runs,); the same whatever else is in the batch.

    A step is a sample's length over a power of two, so that runs share their time grids.
    """
    fastest = _fastest_rate(vehicle)
    usable = np.isfinite(fastest) & (fastest < STEEPEST)
    step = np.minimum(accuracy.largest, accuracy.phase / np.where(usable, fastest, 1.0))
    return accuracy.sample / 2 ** np.ceil(np.log2(accuracy.sample / step) - 1e-9), usable


def _fastest_rate(vehicle: ca.Vehicle) -> Array:
    """Largest |λ| (runs,) [1/s] of λ² + 2 γ λ + ω² = 0, the bend of the tests' start let go."""
    q, push = np.array([ca.open_loop_test("B").q]), np.zeros((1, 8))
    push[0, 6] = 1e-3
    let_go, out, back = (
        ca.forward_dynamics(vehicle, q, qd, gravity=0.0)[:, 6] for qd in (0.0 * push, push, -push)
    )
    frequency = np.sqrt(np.maximum(-let_go / q[0, 6], 0.0))
    # What is even in the rate is no damping.
    decay = (back - out) / (4.0 * push[0, 6])
    return np.maximum(frequency, decay + np.sqrt(np.maximum(decay**2 - frequency**2, 0.0)))


class Flights:
    """Flies one batch of vehicles; remembers what it has flown."""

    def __init__(self, vehicle: ca.Vehicle, accuracy: Accuracy) -> None:
        self.vehicle, self.sample = vehicle, accuracy.sample
        self.steps, self.usable = steps_of(vehicle, accuracy)
        self._flown: dict[tuple[Any, ...], Tips] = {}

    def fly(self, model: str, flight: Flight, test: str) -> Tips:
        """Tips of a model ("coupled", or as in `Flight`) in a test; NaN where a run fails."""
        read = test, flight.arm, flight.bend, flight.force_signs if test == "D" else None
        if (model, read) not in self._flown:
            self._flown[model, read] = self._tips(_MODELS.get(model, model), *read)
        return self._flown[model, read]

    def _tips(self, model: str, test: str, arm: str, *read: Any) -> Tips:
        with warnings.catch_warnings():
            # The search takes longer steps than the automatic one, and knows.
            warnings.simplefilter("ignore", ca.ContinuairWarning)
            found = ca.simulate(
                self.vehicle,
                read_test(test, arm, *read),
                model=model,
                step=self.steps,
                sample=self.sample,
                variables=_WANTED,
            )
        position, attitude, q = (found[name].to_numpy() for name in _WANTED)
        failed = ~self.usable | (found["status"].to_numpy() != 0)
        position[failed] = attitude[failed] = np.nan
        (x, y, z, w), twist = np.moveaxis(attitude, -1, 0), q[..., 7]
        if arm == "down":
            return Tips(position, np.stack([-w, -z, y, x], -1), twist)
        # Seen from a world that was pitched with the vehicle.
        return Tips(position * [-1.0, 1.0, -1.0], np.stack([y, x, w, z], -1), twist)


@lru_cache(maxsize=128)
def read_test(
    test: str, arm: str, bend: int, force_signs: tuple[float, float] | None
) -> ca.Scenario:
    """One of the paper's tests, as a `Flight` reads it.

    bend: sign of the initial bend. force_signs: of the tip force at the hanging arm, across and
    along z. A standing arm is a hanging one pitched by half a turn, with all that acts on it.
    """
    scenario = ca.open_loop_test(test)
    turned = 1.0 if arm == "down" else -1.0
    q = np.array(scenario.q)
    # About y, so that Tests A and B stay in their plane to the last bit.
    q[4] = 0.0 if arm == "down" else np.pi
    q[6] *= bend
    if test == "A":
        scenario = scenario.replace(tau=turned * np.array(scenario.tau))
    if force_signs is None:
        return scenario.replace(q=q)
    across, along = force_signs
    given: Any = scenario.tip_wrench
    signs = np.array([turned * across, across, turned * along, 0.0, 0.0, 0.0])
    # Every flight of a search asks for the same times.
    wrench = lru_cache(1 << 16)(lambda t: (signs * given(t)).tolist())
    return scenario.replace(q=q, tip_wrench=wrench, tip_wrench_sign=1)
