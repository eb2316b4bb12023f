"""Errors of the models on the standard excitations, and which coupling makes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from continuair.analysis.couplings import fly_without
from continuair.analysis.limits import find_limits
from continuair.analysis.metrics import geodesic_angle, rmse
from continuair.flight.simulate import simulate
from continuair.kernels.dynamics import COUPLINGS
from continuair.scenario.scenarios import Scenario
from continuair.studies.standard_excitations import EXCITATIONS, sample_time, standard_scenario
from continuair.sweeps import run_pairs
from continuair.vehicle.vehicle import Vehicle

MODELS = ("decoupled", "independent")
MODERATE = 0.5
"""Frequency over the clamped one at which errors are quoted and couplings are told apart."""

SCAN = np.geomspace(0.05, 3.0, 20)
"""Frequencies over the clamped one that are tried."""

REFINED = 8
"""Frequencies of the round that halves in on a limit."""


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
    return scenarios[0].replace(name="standard excitations", q=start, **inputs)
