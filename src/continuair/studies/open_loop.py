"""The open-loop tests A to D of Amiri et al.: how far simpler models are from the coupled one.

Every flight is simulated with the automatic step h and with h/2, so that a difference between
models can be told from an error of the integration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair.errors import InputError, nearest, shown
from continuair.metrics import compare, geodesic_angle
from continuair.scenarios import OPEN_LOOP_TESTS, Scenario, open_loop_test
from continuair.simulate import simulate
from continuair.vehicle import Vehicle

MODELS = ("coupled", "decoupled", "independent")
"""The models that the study knows; the first is the reference."""

PRINTED = {
    "A": {"nrmse_t": 0.0124, "nrmse_r": 1.0404},
    "B": {"nrmse_t": 0.2378, "nrmse_r": 0.2751},
    "C": {"nrmse_t": 0.3576, "nrmse_r": 0.5369},
    "D": {"nrmse_t": 0.2464, "nrmse_r": 0.3002},
}
"""What Amiri et al. print for coupled against decoupled; the vehicle's parameters are not."""

CONVERGED = 0.01
"""Largest step-halving error, as a share of what is concluded from, that counts as converged."""

KAPPA_S_FACTORS = (0.5, 2.0)
"""Factors on the arm's kappa_s with which Test C is repeated."""

GRAVITY = 9.81

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class OpenLoop:
    """Results of the study.

    results: JSON-able; results["tests"][test][model] holds the metrics against the coupled run.
    datasets: test -> trajectories of all models at the automatic step, leading dimension `model`.
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

    tests: letters A to D, e.g. "AC". models: names; `coupled` is added as the reference. f1: final
    frequency of Test D's chirp [Hz]. progress: called with (done, total, what) before each flight.
    Raises InputError for unknown tests or models, and for a batched vehicle.
    """
    if vehicle.runs is not None:
        problem = f"vehicle {shown(vehicle.name)} holds {vehicle.runs} runs, but must be of one run"
        raise InputError(f"{problem}; choose one with vehicle.select(run).")
    chosen = _chosen_models(models)
    scenarios = {letter: open_loop_test(letter, f1) for letter in _chosen_tests(tests)}
    repeats = len(KAPPA_S_FACTORS) if "C" in scenarios and vehicle.arm.kappa_s > 0 else 0
    flights = _Flights(progress, len(chosen) * (2 * len(scenarios) + repeats))
    results: dict[str, Any] = {}
    datasets: dict[str, xr.Dataset] = {}
    for letter, scenario in scenarios.items():
        coarse, fine = _halved(flights, vehicle, scenario, chosen)
        results[letter] = {model: _entry(model, coarse, fine) for model in chosen}
        if letter == "C" and repeats:
            results[letter]["kappa_s"] = _kappa_s_study(flights, vehicle, scenario, chosen)
        _explain(results[letter], chosen, scenario, vehicle, coarse)
        datasets[letter] = xr.concat(
            [coarse[model].expand_dims(model=[model]) for model in chosen],
            dim="model",
            combine_attrs="drop_conflicts",
        )
    return OpenLoop({"study": "open_loop", **_provenance(vehicle, f1), "tests": results}, datasets)


def _chosen_models(models: Iterable[str]) -> list[str]:
    names = list(dict.fromkeys([models] if isinstance(models, str) else models))
    for name in names:
        if name not in MODELS:
            problem = f"model is {shown(name)}, which is not known"
            raise InputError(f"{problem}; {nearest(str(name), MODELS)}.")
    return [model for model in MODELS if model in names or model == MODELS[0]]


def _chosen_tests(tests: Iterable[str]) -> list[str]:
    letters = [str(letter).strip().upper() for letter in tests]
    known = ", ".join(OPEN_LOOP_TESTS)
    if not letters:
        raise InputError(f"tests is empty, but must name at least one test; use some of: {known}.")
    for letter in letters:
        if letter not in OPEN_LOOP_TESTS:
            problem = f"tests holds {letter!r}, which is not a test"
            raise InputError(f"{problem}; use some of: {known}.")
    return [letter for letter in OPEN_LOOP_TESTS if letter in letters]


class _Flights:
    """Simulates, and tells how many of the flights are done."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress = progress
        self._total = total
        self._done = 0

    def fly(
        self, vehicle: Vehicle, scenario: Scenario, model: str, note: str = "", **policy: Any
    ) -> xr.Dataset:
        if self._progress is not None:
            self._progress(self._done, self._total, f"{scenario.name}, {model}{note}")
        dataset: xr.Dataset = simulate(vehicle, scenario, model=model, **policy)
        self._done += 1
        return dataset


Flown = dict[str, xr.Dataset]


def _halved(
    flights: _Flights, vehicle: Vehicle, scenario: Scenario, models: Sequence[str]
) -> tuple[Flown, Flown]:
    coarse, fine = {}, {}
    for model in models:
        coarse[model] = flights.fly(vehicle, scenario, model)
        step = float(coarse[model].attrs["step"]) / 2
        fine[model] = flights.fly(vehicle, scenario, model, ", half step", step=step)
    return coarse, fine


def _entry(model: str, coarse: Flown, fine: Flown) -> dict[str, Any]:
    """Metrics of one model against the coupled one, and the share of them that the step explains.

    For a simpler model: the largest change of its tip's difference from the coupled one between h
    and h/2, over the RMS of that difference. For the coupled model: the largest change of its tip,
    over the largest distance of the tip from free fall (position) or from its start (attitude).
    """
    reference = coarse[MODELS[0]]
    metrics = compare(reference, coarse[model])
    position = _change(coarse, fine, model)
    turn = _turn(coarse, fine, model)
    if model == MODELS[0]:
        scale_t, scale_r = _extent(reference)
    else:
        scale_t, scale_r = metrics["rmse_t_m"], metrics["angle_rad"]
    error_t, error_r = _share(position, scale_t), _share(turn, scale_r)
    error = float(np.fmax(error_t, error_r)) if np.isfinite(error_t + error_r) else np.inf
    status = int(coarse[model]["status"])
    return metrics | {
        "step_s": float(coarse[model].attrs["step"]),
        "step_halving_error_t": error_t,
        "step_halving_error_r": error_r,
        "step_halving_error": error,
        "status": status,
        "converged": bool(error <= CONVERGED and status == 0),
        "reason": "",
    }


def _change(coarse: Flown, fine: Flown, model: str) -> float:
    """Largest change of the tip's path, or of its difference from the coupled one [m]."""

    def path(flown: Flown) -> Any:
        tip = flown[model]["tip_position"].transpose("time", "axis").to_numpy()
        if model == MODELS[0]:
            return tip
        return tip - flown[MODELS[0]]["tip_position"].transpose("time", "axis").to_numpy()

    return float(np.max(np.linalg.norm(path(fine) - path(coarse), axis=-1)))


def _turn(coarse: Flown, fine: Flown, model: str) -> float:
    """Largest geodesic angle between h and h/2, of this model and the coupled one together [rad]."""
    return sum(
        float(np.max(geodesic_angle(_attitude(coarse[name]), _attitude(fine[name]))))
        for name in dict.fromkeys((MODELS[0], model))
    )


def _extent(dataset: xr.Dataset) -> tuple[float, float]:
    """Largest distance of the tip from free fall [m], and from its first attitude [rad]."""
    tip = dataset["tip_position"].transpose("time", "axis").to_numpy()
    time = dataset["time"].to_numpy()
    falling = tip[0] - 0.5 * GRAVITY * time[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    attitude = _attitude(dataset)
    turned = geodesic_angle(attitude, attitude[:1])
    return float(np.max(np.linalg.norm(tip - falling, axis=-1))), float(np.max(turned))


def _attitude(dataset: xr.Dataset) -> Any:
    return dataset["tip_attitude"].transpose("time", "quaternion").to_numpy()


def _share(change: float, scale: float) -> float:
    if change == 0:
        return 0.0
    return change / scale if scale else float("inf")


def _kappa_s_study(
    flights: _Flights, vehicle: Vehicle, scenario: Scenario, models: Sequence[str]
) -> list[dict[str, Any]]:
    """Metrics with other thresholds kappa_s, below which Q_psi_a is divided by kappa_s instead."""
    rows = []
    for factor in KAPPA_S_FACTORS:
        kappa_s = factor * vehicle.arm.kappa_s
        changed = vehicle.replace({"arm.kappa_s": kappa_s})
        note = f", kappa_s x {factor:g}"
        flown = {model: flights.fly(changed, scenario, model, note) for model in models}
        metrics = {model: compare(flown[MODELS[0]], flown[model]) for model in models[1:]}
        rows.append({"kappa_s": kappa_s, "factor": factor, "models": metrics})
    return rows


def _explain(
    entries: dict[str, Any],
    models: Sequence[str],
    scenario: Scenario,
    vehicle: Vehicle,
    flown: Flown,
) -> None:
    """Say of every entry that has not converged why that is."""
    for model in models:
        entry = entries[model]
        if entry["status"]:
            end = float(flown[model]["end_time"])
            entry["reason"] = f"the run ended at {end:g} s with status {entry['status']}"
        elif not entry["converged"]:
            share = f"{100 * entry['step_halving_error']:.3g} %"
            entry["reason"] = f"halving the step changes the result by {share}"
            if scenario.tau is not None and callable(scenario.tau):
                closest = min(float(_bend(flown[name]).min()) for name in {MODELS[0], model})
                entry["reason"] += (
                    "; Q_psi_a is divided by the bend (by kappa_s = "
                    f"{vehicle.arm.kappa_s:g} 1/m below it), and the arm passes straight at "
                    f"{closest:.2g} 1/m, where this torque is nearly singular"
                )


def _bend(dataset: xr.Dataset) -> Any:
    return np.linalg.norm(dataset["bend"].transpose("time", "bend_axis").to_numpy(), axis=-1)


def _provenance(vehicle: Vehicle, f1: float) -> dict[str, Any]:
    return {
        "vehicle": vehicle.describe(),
        "f1_hz": f1,
        "reference": MODELS[0],
        "printed": PRINTED,
        "note": (
            "Amiri et al. print neither the vehicle's parameters nor the reading of the metric "
            "behind their table, so no match with it is claimed."
        ),
    }
