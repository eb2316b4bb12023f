"""The four letters under choices that the paper does not print: start and compensation."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from amiri2026.paper.evidence import Evidence
from amiri2026.tracking.study import SAMPLE, ds_extremes, metrics
from amiri2026.verdicts import UNDECIDED, Case, Judgement, over_cases
from continuair import Gains, load_gains, simulate
from continuair.analysis import excited_arm, percent
from continuair.flight import RESOLVED
from continuair.kernels import OK, PLANTS
from continuair.scenario import SETTINGS, equipped, task
from continuair.studies import by_model
from continuair.warning import untold

Array = np.ndarray

NOMINAL = SETTINGS["nominal"]

OFF, ALIGNED = "start 0.1 m off", "start at the desired image"
GRAVITY, PRINTED_G = "gravity alone cancelled", "G as printed (elasticity cancelled too)"

OURS = "Camera, gains and start are ours, as the paper prints none"

_VARIABLES = (
    *("feature_error", "tip_position", "camera_position", "target_position", "target_velocity"),
    *("command", "in_view", "bend"),
)


@dataclass(frozen=True)
class Loop:
    """Letters with both plants under one choice of start and compensation.

    reading: the choice in words. entries: metrics by letter and plant, as in the results of the
    tracking study. flights: trajectories (model, letter, time).
    """

    reading: str
    entries: dict[str, Any]
    flights: xr.Dataset

    @property
    def ended(self) -> list[dict[str, Any]]:
        """Metrics of the flights that stopped early."""
        flown = [entry[plant] for entry in self.entries.values() for plant in PLANTS]
        return [flight for flight in flown if flight["status"] != OK]


def nominal(evidence: Evidence) -> Loop:
    """Return the letters of the tracking study."""
    study = evidence.tracking
    return Loop(
        reading(evidence, OFF, GRAVITY), study.results["letters"], study.datasets["nominal"]
    )


def reading(evidence: Evidence, *choices: str) -> str:
    """Return the choices in words, with the structural damping used."""
    damping = float(excited_arm(equipped(evidence.vehicle, NOMINAL)).damping_ratio)
    return ", ".join([*choices, f"{percent(damping)} damping"])


@functools.lru_cache(maxsize=4)
def varied(evidence: Evidence, start: str, compensation: str) -> Loop:
    """Return the four letters under another start or compensation."""
    letters = list(evidence.tracking.results["letters"])
    flights = fly(
        evidence,
        letters,
        NOMINAL.duration,
        off=start == OFF,
        compensation="gravity_only" if compensation == GRAVITY else "literal",
    )
    entries: dict[str, Any] = {}
    for name in letters:
        pair = {plant: flights.sel(letter=name, model=plant) for plant in PLANTS}
        entries[name] = {plant: metrics(each, NOMINAL.settled) for plant, each in pair.items()}
        early, late = ds_extremes(*(pair[plant] for plant in PLANTS))
        entries[name]["decoupled"] |= {"ds_max_px_before_2s": early, "ds_max_px_after_2s": late}
    return Loop(reading(evidence, start, compensation), entries, flights)


@untold("error_estimate")
def fly(
    evidence: Evidence,
    letters: list[str],
    duration: float,
    *,
    off: bool = True,
    compensation: str = "gravity_only",
) -> xr.Dataset:
    """Fly letters with both plants; return trajectories (model, letter, time)."""
    vehicle, gains = equipped(evidence.vehicle, NOMINAL), load_gains("paper")
    law = Gains(gains.name, {**gains.settings, "compensation": compensation}).controller(vehicle)
    scenario = task(vehicle, letters, law, duration, off=off)
    found: dict[str, xr.Dataset] = {
        plant: simulate(
            vehicle,
            scenario,
            model=plant,
            sample=SAMPLE,
            variables=_VARIABLES,
            check=True,
        )
        for plant in PLANTS
    }
    return by_model(found).rename(run="letter").assign_coords(letter=letters)


def over_loops(
    evidence: Evidence,
    view: Callable[[Loop], Judgement],
    *others: tuple[str, str],
    cases: tuple[Case, ...] = (),
    note: str = OURS,
) -> Judgement:
    """Return the judgement of a sentence from a view of the letters under several choices.

    others: start and compensation beside the nominal ones; left out if a nominal flight stops
    early. cases: further views.
    """
    first = nominal(evidence)
    rest = [] if first.ended else [varied(evidence, *other) for other in others]
    name = evidence.vehicle.name
    found = [Case(name, loop.reading, _if_resolved(loop, view(loop))) for loop in (first, *rest)]
    return over_cases([*found, *cases], note)


def _if_resolved(loop: Loop, found: Judgement) -> Judgement:
    errors = [entry[plant].get("error_estimate", 0.0) for entry in loop.entries.values()
              for plant in PLANTS]  # fmt: skip
    if max(errors) <= RESOLVED:
        return found
    told = f"{found.evidence}; these flights are not resolved"
    return replace(found, verdict=UNDECIDED, evidence=told)


def rms(values: Array) -> float:
    """Return the root mean square over samples (time, ...) of the norm at each."""
    squares = np.asarray(values, float) ** 2
    return float(np.sqrt(squares.sum() / len(squares)))
