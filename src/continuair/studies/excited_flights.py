"""Flights of the standard excitations, with or without a loop, for `advise` and the atlas.

In a loop a load grows over the first two fifths of a flight. The rest, at least three cycles, is
evaluated. Without a loop nothing settles, and the whole flight is evaluated. An error is the larger
of the tip's RMSE over the arm's length and the RMS angle between the tips [rad].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.analysis.excited import excited_arm
from continuair.controllers.controller import Controller
from continuair.flight.resolution import RESOLVED, angles_unread
from continuair.kernels.dynamics import REFERENCE, SIMPLER
from continuair.kernels.step import OK
from continuair.scenario.excitations import plus
from continuair.scenario.scenarios import Scenario
from continuair.studies.standard_excitations import (
    EXCITATIONS,
    PERIODS,
    sample_time,
    standard_scenario,
)
from continuair.studies.standard_loops import OWN
from continuair.sweeps import run_pairs
from continuair.typing import Model
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold

Array = np.ndarray

CYCLES = 3.0
"""Cycles that count of every flight in a loop, at the least."""

SWELL = 0.4
"""Share of a flight in a loop over which its load swells, and which does not count."""


MOST_SAMPLES = 4000
"""Of a flight: those of a hundred clamped periods. Longer flights are of slower loads."""


@dataclass(frozen=True)
class Loop:
    """One of LOOPS or OWN, and the bandwidth of its attitude [rad/s], or None for its default.

    held: its controller, where that is made already, as it must be for a batch of vehicles and is
    of OWN. asked: the bend moments that it asks for at the start (bends,) [N m²], which loads leave
    out of those that hold the arm; none by default.
    """

    name: str = "none"
    bandwidth: float | None = None
    held: Controller | None = None
    asked: tuple[float, ...] = ()

    @property
    def closed(self) -> bool:
        """Whether a controller holds the hover."""
        return self.name != "none"

    @property
    def settles(self) -> bool:
        """Whether it holds the position too, so that the response to a load becomes periodic."""
        return self.name in ("position", OWN)


NO_LOOP = Loop()
"""Nothing holds the hover."""


def least_periods(frequency: Any) -> Any:
    """Clamped periods that a flight in a loop must last, by its frequency over the clamped one."""
    return np.maximum(PERIODS, CYCLES / (1.0 - SWELL) / np.asarray(frequency))


def excited(
    vehicle: Vehicle, name: str, frequency: Any, loop: Loop, periods: float = PERIODS
) -> Scenario:
    """Return a standard excitation, by default moderate; in a loop it grows from zero."""
    scenario = standard_scenario(
        name,
        vehicle,
        frequency=frequency,
        periods=periods,
        loop=loop.held or loop.name,
        bandwidth=loop.bandwidth,
        swell=SWELL if loop.closed else 0.0,
    )
    if not any(loop.asked) or EXCITATIONS[name].on is None:
        return scenario
    return scenario.replace(bend_moment=plus(scenario.bend_moment, -np.asarray(loop.asked)))


def sampling(vehicle: Vehicle, scenario: Scenario) -> tuple[float, float]:
    """Return the time between samples that are compared, and the start of the comparison [s].

    In a loop, samples are at control instants or between them.
    """
    sample, period = max(sample_time(vehicle), scenario.duration / MOST_SAMPLES), scenario.period
    if period is None:
        return sample, 0.0
    even = period * (sample // period) if sample >= period else period / np.ceil(period / sample)
    oscillates = EXCITATIONS[scenario.name].on is not None
    return float(even), SWELL * scenario.duration * oscillates


@untold("error_estimate")
def flown_errors(
    vehicle: Vehicle,
    name: str,
    frequency: Any,
    loop: Loop,
    periods: float = PERIODS,
    models: Sequence[Model] = SIMPLER,
    *,
    check: bool = True,
) -> dict[str, Array]:
    """Error (runs,) of each model; infinite where its flight ended early, NaN where that of the
    coupled one did, beside which there is none.

    vehicle: plain or batched; frequency: a number or (runs,), over the clamped one. Where a flight
    is not resolved, its error is at least its error_estimate; without `check`, which takes half of
    the time, nobody asks.
    """
    scenario = excited(vehicle, name, frequency, loop, periods)
    sample, settle = sampling(vehicle, scenario)
    with angles_unread():
        found = run_pairs(vehicle, scenario, models, sample=sample, settle=settle, check=check)
    least = np.zeros(())
    if check:
        estimate = found["error_estimate"].max("model").to_numpy()
        least = np.where(estimate > RESOLVED, estimate, 0.0)
    lost = found["status"].sel(model=REFERENCE).to_numpy() != OK
    errors = {model: error_of(found.sel(model=model), vehicle) for model in models}
    return {model: np.where(lost, np.nan, np.maximum(e, least)) for model, e in errors.items()}


def error_of(found: Any, vehicle: Vehicle) -> Array:
    """Return the larger of the tip's RMSE over the arm's length and the RMS angle.

    It is infinite if the flight ended early.
    """
    tip = np.asarray(found["rmse_t_m"]) / np.asarray(excited_arm(vehicle).length)
    return np.nan_to_num(np.maximum(tip, found["angle_rad"]), nan=np.inf)
