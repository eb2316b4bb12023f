"""Flights of a law from many starts before a target at rest, and how they end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from continuair import Controller, Scenario, Target, Vehicle, paths, simulate
from continuair.progress import Steps
from continuair.typing import Model
from continuair.warning import untold

Array = np.ndarray

DURATION, JUDGED = 10.0, 1.0
"""How long flights last, and the part at their end in which they are judged [s]."""

TARGET = Target(paths.hold())
"""A square at rest, the camera's place 2 m above it."""

_SAMPLE, _AT_ONCE = 0.01, 256


@dataclass(frozen=True)
class Case:
    """A law, the plant that it flies on, and its control rate [Hz]."""

    law: str
    model: Model
    rate: float

    def __str__(self) -> str:
        return f"{self.law}, {self.model}, {self.rate:g} Hz"


def kept_of(vehicle: Vehicle) -> tuple[str, ...]:
    """Return the recorded values of a flight.

    They are its status, its end [s], its final largest feature error [px] (NaN if it ended early),
    its error estimate, and the largest command to rotors, if any, beyond their limits.
    """
    saturation = () if vehicle.uav.rotors is None else ("largest_saturation",)
    return ("status", "end_time", "error", "error_estimate", *saturation)


def batches(runs: int) -> list[slice]:
    """Yield runs that are simulated at once; progress is reported after each."""
    return [slice(first, first + _AT_ONCE) for first in range(0, runs, _AT_ONCE)]


@untold("error_estimate")
def fly(vehicle: Vehicle, case: Case, law: Controller, q: Array, steps: Steps) -> Array:
    """Simulate a law from starts q (runs, 8) at rest; return the recorded values (kept, runs)."""
    found = []
    for batch in batches(len(q)):
        steps.begin(str(case))
        scenario = Scenario(
            "region of operation", q[batch], controller=law, target=TARGET,
            control_period=1.0 / case.rate, duration=DURATION,
        )  # fmt: skip
        data = simulate(
            vehicle,
            scenario,
            model=case.model,
            sample=_SAMPLE,
            variables=["feature_error"],
            check=True,
        )
        late = abs(data["feature_error"]).sel(time=slice(DURATION - JUDGED, None))
        data["error"] = late.max(("time", "pixel"), skipna=False)
        found.append([data[name] for name in kept_of(vehicle)])
    return np.concatenate(found, axis=1).astype(float)
