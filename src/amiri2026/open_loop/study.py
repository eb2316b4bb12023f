"""The open-loop tests A to D of Amiri et al.: differences of simpler models from the coupled one.

Every run is repeated within a tenth of its tolerance, so that a difference between models can be
told apart from an error of the integration.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS, open_loop_flight
from continuair import MODELS, Scenario, Vehicle, checks, simulate
from continuair.analysis import (
    RTOL,
    SAMPLE,
    Entries,
    Flown,
    at_camera,
    compared_models,
    differences,
    entries_of,
    percent,
    samples,
)
from continuair.kernels import REFERENCE
from continuair.progress import Progress, Steps
from continuair.studies import by_model
from continuair.typing import Model
from continuair.vehicle import check_has_arms, check_single_vehicle, is_paper
from continuair.warning import untold

PRINTED = {
    "A": {"nrmse_t": 0.0124, "nrmse_r": 1.0404},
    "B": {"nrmse_t": 0.2378, "nrmse_r": 0.2751},
    "C": {"nrmse_t": 0.3576, "nrmse_r": 0.5369},
    "D": {"nrmse_t": 0.2464, "nrmse_r": 0.3002},
}
"""Printed errors of decoupled against coupled, Amiri et al.; the parameters are not printed."""

NOTE = (
    "Amiri et al. print neither the vehicle's parameters nor the reading of the metric behind "
    "their table, so no match with it is claimed."
)

KAPPA_S_FACTORS = (0.5, 2.0)
"""Factors on the arm's kappa_s with which Test C is repeated."""


@dataclass(frozen=True)
class OpenLoop:
    """Results of the study.

    results: JSON-able; results["tests"][test][model] holds the metrics against the coupled run, of
    the arm that carries the camera. Of several arms results["arms"][test][arm] holds those of each.
    datasets: test -> trajectories of all models, leading dimension `model`.
    """

    results: dict[str, Any]
    datasets: dict[str, xr.Dataset]


def open_loop(
    vehicle: Vehicle,
    tests: Iterable[str] = OPEN_LOOP_TESTS,
    models: Iterable[str] = MODELS,
    *,
    f1: float = 1.0,
    progress: Progress | None = None,
) -> OpenLoop:
    """Run open-loop tests with several models and compare them with the coupled one.

    Every section of every arm starts with the bend, and has the torques of Test C, of the paper's
    one section. The tip wrench of Test D acts on the arm that carries the camera. Both are our
    choice; the paper has one section.

    tests: letters A to D, e.g. "AC". models: names; `coupled` is added as the reference. f1: what
    Test D's chirp, of which 1 s is flown, would reach at 10 s [Hz]. progress: called with (done,
    total, what) before each flight. Raises InputError for unknown tests or models, and for a
    batched vehicle and one without an arm.
    """
    check_has_arms(check_single_vehicle(vehicle))
    given = [str(letter).strip().upper() for letter in tests]
    letters = sorted(checks.choices("tests", given, OPEN_LOOP_TESTS))
    chosen = compared_models(models)
    scenarios = {letter: open_loop_flight(vehicle, letter, f1) for letter in letters}
    others = _other_kappa_s(vehicle) if "C" in letters else []
    flights = _Flights(progress, chosen, len(scenarios) + len(others))
    results: dict[str, Any] = {
        "study": "open_loop",
        "vehicle": vehicle.describe(),
        "f1_hz": f1,
        "reference": REFERENCE,
        "printed": PRINTED if _as_printed(vehicle, letters, chosen, f1) else {},
        "note": NOTE,
        "rtol": RTOL,
        "tests": {},
        "kappa_s": [],
    }
    datasets = {}
    for letter, scenario in scenarios.items():
        flown = flights.fly(vehicle, scenario)
        results["tests"][letter] = _entries(_at_camera(flown, vehicle), vehicle, scenario)
        if len(vehicle.arms) > 1:
            results.setdefault("arms", {})[letter] = _of_arms(flown, vehicle, scenario)
        if letter == "C":
            results["kappa_s"] = _vary_kappa_s(others, flights, vehicle, scenario)
        datasets[letter] = by_model(flown)
    return OpenLoop(results, datasets)


def _as_printed(vehicle: Vehicle, letters: Sequence[str], models: Sequence[str], f1: float) -> bool:
    """Whether the paper's numbers, of its decoupled model and a chirp up to 1 Hz, belong here."""
    same = "D" not in letters or f1 == 1.0
    return is_paper(vehicle) and "decoupled" in models and same


class _Flights:
    """Simulates all chosen models, and reports progress."""

    def __init__(self, progress: Progress | None, models: Sequence[Model], rounds: int) -> None:
        self.models = models
        self._steps = Steps(progress, rounds * len(models))

    @untold("error_estimate")
    def fly(self, vehicle: Vehicle, scenario: Scenario, note: str = "") -> Flown:
        """Return trajectories of all models."""
        flown: Flown = {}
        for model in self.models:
            self._steps.begin(f"{scenario.name}{note}, {model}")
            flown[model] = simulate(
                vehicle, scenario, model=model, sample=SAMPLE, rtol=RTOL, check=True
            )
        return flown


def _at_camera(flown: Flown, vehicle: Vehicle) -> Flown:
    """Flights with the tip of the arm that carries the camera alone."""
    return {model: at_camera(data, vehicle) for model, data in flown.items()}


def _of_arms(flown: Flown, vehicle: Vehicle, scenario: Scenario) -> dict[str, Entries]:
    """Entries of each arm, by its name."""
    return {
        arm.name: _entries(
            {model: data.isel(arm=index) for model, data in flown.items()}, vehicle, scenario
        )
        for index, arm in enumerate(vehicle.arms)
    }


def _entries(flown: Flown, vehicle: Vehicle, scenario: Scenario) -> Entries:
    """Return entries with the reason why a flight has not converged."""
    entries = entries_of(flown, float(vehicle.reach))
    for model, entry in entries.items():
        entry["reason"] = _reason(entry, scenario, vehicle, flown[model])
        if entries[REFERENCE]["status"] and not entry["status"]:
            entry["reason"] = f"{REFERENCE}, which it is compared with, ended early"
    return entries


def _is_singular(scenario: Scenario) -> bool:
    """Return whether Q_psi_a acts, which is divided by the bend."""
    return callable(scenario.tau)


def _reason(
    entry: dict[str, Any], scenario: Scenario, vehicle: Vehicle, dataset: xr.Dataset
) -> str:
    """Return why a flight has not converged; nothing if it has."""
    if entry["converged"]:
        return ""
    if entry["status"]:
        end = float(dataset["end_time"])
        return f"the run ended at {end:g} s with status {entry['status']}"
    text = f"its error may be {percent(entry['relative_error'])} of it"
    if _is_singular(scenario):
        where, threshold, closest = _straightest(vehicle, dataset)
        text += (
            "; Q_psi_a is divided by the bend (by kappa_s = "
            f"{threshold:g} 1/m below it) and is nearly singular where {where} passes "
            f"straight, here at {closest:.2g} 1/m or less"
        )
    return text


def _straightest(vehicle: Vehicle, dataset: xr.Dataset) -> tuple[str, float, float]:
    """The section that comes closest to straight, in words, its κ_s and its least bend [1/m]."""
    bends = np.linalg.norm(samples(dataset, "bend", "bend_axis"), axis=-1)
    least = np.atleast_1d(bends.min(axis=-1))
    section = int(np.argmin(least))
    name = f"section {dataset['section'][section].item()}" if vehicle.has_arm_list else "the arm"
    return name, float(vehicle.kappa_s[0, section]), float(least[section])


def _other_kappa_s(vehicle: Vehicle) -> list[dict[str, float]]:
    """Changes of the thresholds κ_s, below which Q_psi_a is divided by κ_s instead."""
    own = dict(zip(_kappa_s_fields(vehicle), vehicle.kappa_s[0].tolist(), strict=True))
    return [
        {field: factor * value for field, value in own.items()}
        for factor in KAPPA_S_FACTORS
        if any(own.values())
    ]


def _kappa_s_fields(vehicle: Vehicle) -> list[str]:
    """The field of κ_s of each section, arm by arm."""
    if not vehicle.has_arm_list:
        return ["arm.kappa_s"]
    return [
        f"arm.{arm.name}.section.{section.name}.kappa_s"
        for arm in vehicle.arms
        for section in arm.section
    ]


def _vary_kappa_s(
    others: Sequence[dict[str, float]], flights: _Flights, vehicle: Vehicle, scenario: Scenario
) -> list[dict[str, Any]]:
    """Metrics, of the arm that carries the camera, with other thresholds kappa_s.

    kappa_s of a row is that of all sections, or a list of theirs where they differ.
    """
    rows = []
    for changes in others:
        changed = vehicle.replace(changes)
        kappa_s = told_kappa_s(changed)
        varied = flights.fly(changed, scenario, f", kappa_s {words_of(kappa_s)} 1/m")
        tips = _at_camera(varied, vehicle)
        # The remarks say once of each flight that it ended early.
        metrics = {model: differences(tips[REFERENCE], tips[model]) for model in flights.models}
        rows.append({"kappa_s": kappa_s, "models": metrics})
    return rows


def told_kappa_s(vehicle: Vehicle) -> float | list[float]:
    """Return κ_s of all sections [1/m], or a list of theirs where they differ."""
    each = vehicle.kappa_s[0].tolist()
    return each[0] if len(set(each)) == 1 else each


def words_of(kappa_s: float | list[float]) -> str:
    """Return κ_s in words."""
    each = kappa_s if isinstance(kappa_s, list) else [kappa_s]
    return ", ".join(f"{value:g}" for value in each)
