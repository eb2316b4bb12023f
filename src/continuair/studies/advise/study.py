"""Advice on a vehicle: which model is good enough for which task, up to what frequency or speed.

The vehicle itself is flown, on the standard excitations and on visual tracking; nothing is looked
up or fitted. An error is the larger of the tip's RMSE over the arm's length and the RMS angle
between the tips [rad].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from continuair import checks
from continuair.analysis.beam import curvature_error
from continuair.analysis.convergence import REFERENCE
from continuair.analysis.couplings import COUPLINGS, fly_without
from continuair.analysis.groups import place
from continuair.analysis.limits import find_limits
from continuair.analysis.metrics import geodesic_angle, rmse
from continuair.controllers.gain_files import Gains, load_gains
from continuair.flight.simulate import simulate
from continuair.scenario.letters import LETTERS
from continuair.scenario.scenarios import Scenario
from continuair.studies.advise.tracking import tracking_limit
from continuair.studies.progress import Progress, Steps
from continuair.studies.standard_excitations import (
    EXCITATIONS,
    sample_time,
    standard_scenario,
)
from continuair.studies.timing import median_times
from continuair.sweeps import run_pairs
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

TASKS = {
    "hover": ("bend", "moment", "release"),
    "fast-flight": ("force", "fall"),
    "contact": ("tip",),
}
"""Standard excitations that stand for a task; `track:M` tracks the letter M, or another."""

MODELS = ("decoupled", "independent")
MODERATE = 0.5
"""Frequency over the clamped one at which errors are quoted and couplings are told apart."""

SCAN = np.geomspace(0.05, 3.0, 20)
"""Frequencies over the clamped one that are tried."""

_ONCE = {"release": "when the bent arm is let go", "fall": "in free fall"}

_STEPS, _REPEATS = 50_000, 5

REFINED = 8
"""Frequencies of the round that halves in on a limit."""


@dataclass(frozen=True)
class Tolerance:
    """Largest errors that count as good enough: of the tip [share of l, rad], and of DS [px]."""

    tip: float = 0.02
    pixels: float = 0.7

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tip)
        checks.positive("pixels", self.pixels)


def chosen_tasks(tasks: Sequence[str]) -> list[str]:
    """The tasks asked for, all by default, or InputError."""
    known = [*TASKS, *(f"track:{letter}" for letter in LETTERS)]
    return checks.choices("task", tasks or [*TASKS, "track:M"], known)


def advise(
    vehicle: Vehicle,
    tasks: Sequence[str] = (),
    tolerance: Tolerance = Tolerance(),
    gains: Gains | None = None,
    *,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Errors, limits, costs and a verdict for each task. JSON-able; raises InputError."""
    check_single_vehicle(vehicle)
    chosen = chosen_tasks(tasks)
    flown = [task for task in chosen if task in TASKS]
    names = list(dict.fromkeys(name for task in flown for name in TASKS[task]))
    steps = Steps(progress, len(names) + len(chosen) - len(flown) + 1 + bool(names))
    excitations: dict[str, Any] = {}
    for name in names:
        steps.begin(f"excitation {name}")
        excitations[name] = excite(vehicle, name, tolerance.tip)
    if names:
        steps.begin("couplings, one at a time")
        for name, found in attribute(vehicle, names).items():
            excitations[name]["couplings"] = found
            error = excitations[name]["models"]["decoupled"]["error"]
            excitations[name]["responsible"] = responsible(found, error)
    tracked = {}
    for task in chosen:
        if task not in TASKS:
            steps.begin(task)
            letter = task.split(":")[1]
            law = gains or load_gains("paper")
            tracked[task] = tracking_limit(vehicle, letter, law, MODELS, tolerance.pixels)
    steps.begin("cost of a step")
    results: dict[str, Any] = {
        "study": "advise",
        "vehicle": vehicle.describe(),
        "tolerance": tolerance.tip,
        "pixels": tolerance.pixels,
        "clamped_hz": float(vehicle.arm.clamped_frequency) / (2.0 * np.pi),
        "groups": {name: float(value) for name, value in place(vehicle).items()},
        "excitations": excitations,
        "tracking": tracked,
        "step_over_coupled": step_cost(vehicle),
        "curvature_error": curvature_error(vehicle),
    }
    results["verdicts"] = {
        task: {model: verdict(results, task, model) for model in MODELS} for task in chosen
    }
    results["verdict"] = "; ".join(
        f"{task}: {results['verdicts'][task]['decoupled']['text']}" for task in chosen
    )
    return results


def excite(vehicle: Vehicle, name: str, tolerance: float) -> dict[str, Any]:
    """Error of each model at the moderate load, and the frequency up to which it is tolerable.

    limit_hz: NaN where no frequency tried is, inf where all are, None for a release or a fall.
    """
    excitation = EXCITATIONS[name]
    errors = {model: float(e[0]) for model, e in _errors(vehicle, name, [MODERATE]).items()}
    models: dict[str, dict[str, Any]] = {
        model: {"error": error, "tolerable": error <= tolerance, "limit_hz": None}
        for model, error in errors.items()
    }
    if excitation.on is not None:
        clamped = float(vehicle.arm.clamped_frequency) / (2.0 * np.pi)

        def finer(ratios: np.ndarray, model: str) -> np.ndarray:
            return _errors(vehicle, name, ratios)[model]

        scanned = _errors(vehicle, name, SCAN)
        for model, found in find_limits(SCAN, scanned, tolerance, finer, REFINED).items():
            models[model] |= {
                "limit_hz": found.last * clamped,
                "hz": (found.places * clamped).tolist(),
                "errors": found.errors.tolist(),
            }
    return {
        "meaning": excitation.meaning,
        "load": excitation.load,
        "load_ratio": excitation.moderate,
        "models": models,
    }


def _errors(vehicle: Vehicle, name: str, frequencies: Any) -> dict[str, np.ndarray]:
    """Error of each model at each frequency; infinite where a flight ended early."""
    scenario = standard_scenario(name, vehicle, frequency=np.asarray(frequencies))
    found = run_pairs(vehicle, scenario, MODELS, sample=sample_time(vehicle))
    errors = {}
    for model in MODELS:
        of_model = found.sel(model=model)
        tip = of_model["rmse_t_m"].to_numpy() / float(vehicle.arm.length)
        angle = of_model["angle_rad"].to_numpy()
        errors[model] = np.nan_to_num(np.maximum(tip, angle), nan=np.inf)
    return errors


def attribute(vehicle: Vehicle, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """Error of the coupled model without one coupling, by excitation and coupling."""
    scenario = _together([standard_scenario(name, vehicle, frequency=MODERATE) for name in names])
    sample = sample_time(vehicle)
    coupled = simulate(vehicle, scenario, sample=sample, variables=["tip_position", "tip_attitude"])
    without = fly_without(vehicle, scenario, sample=sample)
    found: dict[str, dict[str, float]] = {name: {} for name in names}
    for coupling in COUPLINGS:
        part = without.sel(coupling=coupling)
        turn = geodesic_angle(part["tip_attitude"], coupled["tip_attitude"])
        tip = rmse(coupled["tip_position"], part["tip_position"]) / float(vehicle.arm.length)
        angle = np.sqrt(np.mean(turn**2, axis=1))
        worst = np.nan_to_num(np.maximum(tip, angle), nan=np.inf)
        for name, value in zip(names, worst, strict=True):
            found[name][coupling] = float(value)
    return found


def responsible(couplings: dict[str, float], error: float) -> str:
    """The coupling whose loss errs most, or recoil where two of them cancel in part."""
    if min(couplings["inertia"], couplings["coriolis"]) > error:
        return "recoil, inertial and Coriolis coupling together"
    return max(couplings, key=lambda key: couplings[key])


def _together(scenarios: Sequence[Scenario]) -> Scenario:
    """One batch of single scenarios, each with its own start and inputs."""

    def rows(name: str, width: int) -> Callable[[float], np.ndarray]:
        values = [getattr(scenario, name) for scenario in scenarios]

        def at(t: float) -> np.ndarray:
            given = [value(t) if callable(value) else value for value in values]
            return np.stack([np.zeros(width) if v is None else np.ravel(v) for v in given])

        return at

    widths = {"force": 3, "moment": 3, "bend_moment": 2, "tip_wrench": 6}
    inputs: dict[str, Any] = {name: rows(name, width) for name, width in widths.items()}
    start = np.stack([np.ravel(scenario.q) for scenario in scenarios])
    return replace(scenarios[0], name="standard excitations", q=start, **inputs)


def step_cost(vehicle: Vehicle) -> dict[str, float]:
    """Median time of a model's step over that of the coupled one's, flown in turns."""
    scenario = standard_scenario("release", vehicle)
    options: dict[str, Any] = {
        "step": scenario.duration / _STEPS,
        "sample": scenario.duration,
        "variables": ["position"],
    }
    flights = {
        model: partial(simulate, vehicle, scenario, model=model, **options)
        for model in (REFERENCE, *MODELS)
    }
    times = median_times(flights, _REPEATS)
    return {model: times[model] / times[REFERENCE] for model in MODELS}


def verdict(results: dict[str, Any], task: str, model: str) -> dict[str, Any]:
    """What follows for a task and a model: a sentence, and its scope and exceptions.

    scope: "all" frequencies or speeds tried, those "below" the limit, "none", or "undecided";
    except: excitations of the task, of no frequency, for which it does not hold.
    """
    if task in results["tracking"]:
        found = results["tracking"][task]
        limit = found["models"][model]["limit_m_s"]
        if np.isnan(found["rms_px"]):
            text = f"cannot be decided: with the gains {found['gains']} the target is lost"
            return {"scope": "undecided", "limit": limit, "unit": "m/s", "text": text}
        text = _sentence(limit, "a target slower than {:.2g} m/s", "a target as fast as was tried")
        return {"scope": _scope(limit), "limit": limit, "unit": "m/s", "text": text}
    parts = {name: results["excitations"][name] for name in TASKS[task]}
    once = [name for name, part in parts.items() if part["models"][model]["limit_hz"] is None]
    bad = [name for name in once if not parts[name]["models"][model]["tolerable"]]
    limits = {
        name: part["models"][model]["limit_hz"] for name, part in parts.items() if name not in once
    }
    worst = min(limits, key=lambda name: _rank(limits[name]))
    limit = limits[worst]
    text = _sentence(limit, "motion below {:.2g} Hz", "motion at every frequency tried")
    if bad and not np.isnan(limit):
        text += ", but not " + " or ".join(_ONCE[name] for name in bad)
    if bad or not np.isinf(limit):
        culprit = parts[bad[0] if bad and np.isinf(limit) else worst]["responsible"]
        text += f" (what is missed: {culprit})"
    return {"scope": _scope(limit), "except": bad, "limit": limit, "unit": "Hz", "text": text}


def _scope(limit: float) -> str:
    if np.isnan(limit):
        return "none"
    return "all" if np.isinf(limit) else "below"


def _rank(limit: float) -> float:
    return -1.0 if np.isnan(limit) else limit


def _sentence(limit: float, below: str, everywhere: str) -> str:
    if np.isnan(limit):
        return "do not decouple"
    if np.isinf(limit):
        return f"decouple for {everywhere}"
    return f"decouple for {below.format(limit)}"
