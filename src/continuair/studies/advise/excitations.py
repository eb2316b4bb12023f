"""Errors of the models on the standard excitations, and which coupling makes them."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.analysis.couplings import attribution
from continuair.analysis.excited import excited_arm
from continuair.analysis.limits import find_limits
from continuair.flight.resolution import RESOLVED, angles_unread, steps_told_of
from continuair.kernels.dynamics import COUPLINGS, SIMPLER
from continuair.studies.standard_excitations import EXCITATIONS, sample_time, standard_scenario
from continuair.sweeps import run_pairs
from continuair.vehicle.vehicle import Vehicle

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
        clamped = float(excited_arm(vehicle).frequency) / (2.0 * np.pi)

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
    """Error of each model at each frequency; infinite where a flight ended early.

    Where steps do not resolve a flight, it is at least what they err by.
    """
    scenario = standard_scenario(name, vehicle, frequency=np.asarray(frequencies))
    with steps_told_of(), angles_unread():
        found = run_pairs(vehicle, scenario, SIMPLER, sample=sample_time(vehicle))
    by_steps = found["step_error"].max("model").to_numpy()
    least = np.where(by_steps > RESOLVED, by_steps, 0.0)
    return {model: np.maximum(_error(found.sel(model=model), vehicle), least) for model in SIMPLER}


def attribute(vehicle: Vehicle, name: str) -> dict[str, float]:
    """Error of the coupled model without one coupling, at the moderate load."""
    scenario = standard_scenario(name, vehicle, frequency=MODERATE)
    found = attribution(vehicle, scenario, sample_time(vehicle))
    return {coupling: float(_error(found[coupling], vehicle)) for coupling in COUPLINGS}


def _error(found: Any, vehicle: Vehicle) -> np.ndarray:
    """The larger of the tip's RMSE over the arm's length and the RMS angle; infinite if it ended
    early."""
    tip = np.asarray(found["rmse_t_m"]) / float(excited_arm(vehicle).length)
    return np.nan_to_num(np.maximum(tip, found["angle_rad"]), nan=np.inf)


def missed(couplings: dict[str, float], error: float) -> str:
    """The coupling whose loss errs most, or recoil where two of them cancel in part.

    couplings: of `attribute`; error: without all of them. `responsible` of analysis/couplings.py
    knows one coupling only, whose shares of many flights it counts.
    """
    if min(couplings["inertia"], couplings["coriolis"]) > error:
        return "recoil, inertial and Coriolis coupling together"
    return max(couplings, key=lambda key: couplings[key])
