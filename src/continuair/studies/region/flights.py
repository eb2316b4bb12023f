"""Flights of a law from many starts before a target at rest, and how they end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from continuair.controllers.classic import classic
from continuair.controllers.controller import Controller
from continuair.controllers.gain_files import Gains, load_gains
from continuair.flight.resolution import steps_told_of
from continuair.flight.simulate import simulate
from continuair.progress import Steps
from continuair.scenario import paths
from continuair.scenario.scenarios import Scenario
from continuair.scenario.targets import Target
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

LAWS = {
    "constant": "the paper's law with gains made for the desired image",
    "current": "the paper's law with gains made anew for the image of now",
    "classic": "classic servoing, v = λ L⁺ e, with an inner loop",
}
"""Law -> what it is."""

RATE, INNER = 1.5, 6.0
"""Rates of classic servoing and of its inner loop [1/s]."""

DURATION, JUDGED = 10.0, 1.0
"""How long flights last, and the part at their end in which they are judged [s]."""

TARGET = Target(paths.hold())
"""A square at rest, the camera's place 2 m above it."""

_PRESETS = {"constant": "paper", "current": "current"}
_SAMPLE, _AT_ONCE = 0.01, 256


@dataclass(frozen=True)
class Case:
    """A law, the plant that it flies on, and its control rate [Hz]."""

    law: str
    model: str
    rate: float

    def __str__(self) -> str:
        return f"{self.law}, {self.model}, {self.rate:g} Hz"


ENDED = ("status", "end_time", "error")
"""What is kept of a flight: its status, when it ended [s], and its largest feature error at the end
[px], NaN of one that ended early."""


def gains_for(gains: Gains) -> str:
    """The law that gains are for."""
    return "constant" if gains.constant else "current"


def law_of(name: str, vehicle: Vehicle, gains: Gains | None) -> Controller:
    """A law by its name, with given gains if they are for it, else with those of its preset."""
    if name == "classic":
        return classic(vehicle, RATE, INNER)
    if gains is None or gains_for(gains) != name:
        gains = load_gains(_PRESETS[name])
    return gains.controller(vehicle)


def batches(runs: int) -> list[slice]:
    """Runs that fly at once, after each of which progress is told."""
    return [slice(first, first + _AT_ONCE) for first in range(0, runs, _AT_ONCE)]


def fly(vehicle: Vehicle, case: Case, law: Controller, q: Array, steps: Steps) -> Array:
    """Fly a law from starts q (runs, 8) at rest; ENDED of each flight (3, runs)."""
    found = []
    for batch in batches(len(q)):
        steps.begin(str(case))
        scenario = Scenario(
            "region of operation", q[batch], controller=law, target=TARGET,
            control_period=1.0 / case.rate, duration=DURATION,
        )  # fmt: skip
        with steps_told_of():
            data = simulate(
                vehicle, scenario, model=case.model, sample=_SAMPLE, variables=["feature_error"]
            )
        late = abs(data["feature_error"]).sel(time=slice(DURATION - JUDGED, None))
        error = late.max(("time", "pixel"), skipna=False)
        found.append([data["status"], data["end_time"], error])
    return np.concatenate(found, axis=1).astype(float)
