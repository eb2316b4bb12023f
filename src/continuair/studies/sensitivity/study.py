"""The parameter sensitivity study of Amiri et al.: six fields, one at a time.

The paper compares a few values of each parameter. Those are flown with their trajectories kept, and
many values between them too, because a few cannot tell a trend from scatter.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair import checks
from continuair.analysis.convergence import (
    REFERENCE,
    SAMPLE,
    Flown,
    settled,
    step_errors,
    step_of,
)
from continuair.analysis.metrics import compare
from continuair.errors import ContinuairWarning
from continuair.flight.simulate import MODELS, simulate
from continuair.scenario.scenarios import Scenario
from continuair.studies.sensitivity.claims import verdicts
from continuair.studies.sensitivity.measures import VARIABLES, apart, measures
from continuair.studies.sensitivity.task import PARAMETERS, Parameter, batch, flight
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

Array = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

MAX_HALVINGS = 4
"""Steps tried at most in search of a converged one."""

OTHERS = tuple(model for model in MODELS if model != REFERENCE)
"""The models that are compared with the coupled one."""


@dataclass(frozen=True)
class Sensitivity:
    """Results of the study.

    results: JSON-able; results["sweeps"][parameter]["rows"] holds a value each, ["between"] lists
    over many values; results["claims"] the paper's sentences and their verdicts. datasets:
    parameter -> trajectories of the paper's values, dimensions `model`, `run` (with the coordinate
    `value`, SI units) and `time`.
    """

    results: dict[str, Any]
    datasets: dict[str, xr.Dataset]


def sensitivity(
    vehicle: Vehicle,
    parameters: Iterable[str] = tuple(PARAMETERS),
    *,
    hertz: bool = False,
    progress: Progress | None = None,
) -> Sensitivity:
    """Vary one parameter of a vehicle or of its start at a time, and compare all models.

    parameters: names in PARAMETERS. hertz: the paper's f = 10 counts as 10 Hz, sin(2 pi 10 t), not
    as sin(10 t). progress: called with (done, total, what) before each batch. Raises InputError.
    """
    check_single_vehicle(vehicle)
    chosen = _chosen(parameters)
    scenario = flight(hertz)
    # Every batch is made before the first flight: one that cannot be is told at once.
    for parameter in chosen:
        batch(vehicle, scenario, parameter, parameter.between())
    results: dict[str, Any] = {
        "study": "sensitivity",
        "vehicle": vehicle.describe(),
        "reading_of_f": "sin(2 pi f t)" if hertz else "sin(f t)",
        "reference": REFERENCE,
        "sweeps": {},
    }
    datasets = {}
    for index, parameter in enumerate(chosen):
        tell = _teller(progress, 2 * index, 2 * len(chosen), parameter.name)
        tell("the values compared", 0)
        flown, entries = _converge(vehicle, scenario, parameter)
        tell("values between", 1)
        step = step_of(flown[REFERENCE])
        results["sweeps"][parameter.name] = {
            "units": parameter.units,
            "scale": parameter.scale,
            "values_chosen_here": parameter.chosen,
            "rows": _rows(vehicle, scenario, parameter, flown, entries),
            "between": _between(vehicle, scenario, parameter, step),
        }
        datasets[parameter.name] = _joined(parameter, flown)
    results["claims"] = verdicts(results)
    return Sensitivity(results, datasets)


def _chosen(parameters: Iterable[str]) -> list[Parameter]:
    names = checks.choices("parameters", parameters, PARAMETERS)
    return [PARAMETERS[name] for name in PARAMETERS if name in names]


def _teller(
    progress: Progress | None, done: int, total: int, name: str
) -> Callable[[str, int], None]:
    def tell(what: str, more: int) -> None:
        if progress is not None:
            progress(done + more, total, f"{name}, {what}")

    return tell


def _fly(
    vehicle: Vehicle,
    scenario: Scenario,
    parameter: Parameter,
    values: Any,
    step: float | str = "auto",
) -> Flown:
    vehicles, starts = batch(vehicle, scenario, parameter, values)
    return {
        model: simulate(
            vehicles, starts, model=model, step=step, sample=SAMPLE, variables=VARIABLES
        )
        for model in MODELS
    }


def _converge(
    vehicle: Vehicle, scenario: Scenario, parameter: Parameter
) -> tuple[Flown, list[dict[str, dict[str, Any]]]]:
    """Halve the step until every run has converged; return flights and entries[run][model]."""
    coarse = _fly(vehicle, scenario, parameter, parameter.values)
    histories: list[list[dict[str, dict[str, Any]]]] = []
    while True:
        fine = _fly(vehicle, scenario, parameter, parameter.values, step_of(coarse[REFERENCE]) / 2)
        level = [_entries(coarse, fine, run) for run in range(len(parameter.values))]
        histories.append(level)
        for run, entries in enumerate(level):
            for model, entry in entries.items():
                errors = [before[run][model]["step_halving_error"] for before in histories]
                # A run that settled early is halved on with the others, down to its rounding.
                early = any(settled(errors[: n + 1], singular=False) for n in range(len(errors)))
                entry["converged"] = entry["status"] == 0 and early
        every = [entry for entries in level for entry in entries.values()]
        done = all(entry["converged"] or entry["status"] for entry in every)
        if done or len(histories) == MAX_HALVINGS:
            return coarse, level
        coarse = fine


def _entries(coarse: Flown, fine: Flown, run: int) -> dict[str, dict[str, Any]]:
    """Metrics of every model in one run, and what share of them is the step's."""
    flights, finer = (
        {model: flown.isel(run=run) for model, flown in batches.items()}
        for batches in (coarse, fine)
    )
    entries = {}
    for model in MODELS:
        with warnings.catch_warnings():
            # The row has its own word for a run that ended early.
            warnings.simplefilter("ignore", ContinuairWarning)
            metrics = compare(flights[REFERENCE], flights[model])
        error_t, error_r = step_errors(model, flights, finer, metrics)
        entries[model] = metrics | {
            "step_s": step_of(coarse[model]),
            "step_halving_error_t": error_t,
            "step_halving_error_r": error_r,
            "step_halving_error": max(error_t, error_r),
            "status": int(flights[model]["status"]),
        }
    return entries


def _rows(
    vehicle: Vehicle,
    scenario: Scenario,
    parameter: Parameter,
    flown: Flown,
    entries: list[dict[str, dict[str, Any]]],
) -> list[dict[str, Any]]:
    """A row per value: measures of the coupled flight, and the models' metrics against it."""
    vehicles, _ = batch(vehicle, scenario, parameter, parameter.values)
    measured = measures(vehicles, flown[REFERENCE])
    distances = {model: apart(flown[REFERENCE], flown[model]) for model in OTHERS}
    rows = []
    for run, value in enumerate(parameter.values):
        one = vehicles.select(run)
        for model, distance in distances.items():
            entries[run][model] |= {
                "rmse_xy_m": _rms(distance[run]),
                "rmse_xy_by_second_m": _by_second(distance[run]),
            }
        rows.append(
            {"value": value, "label": parameter.label(value), "mass_kg": float(one.mass)}
            | {"arm_mass_kg": float(one.arm.mass), "arm_inertia_kg_m2": _arm_inertia(one)}
            | {name: float(array[run]) for name, array in measured.items()}
            | {"models": entries[run]}
        )
    return rows


def _between(
    vehicle: Vehicle, scenario: Scenario, parameter: Parameter, step: float
) -> dict[str, Any]:
    """Measures and horizontal differences of many values, as lists over those flown to the end."""
    values = parameter.between()
    vehicles, _ = batch(vehicle, scenario, parameter, values)
    flown = _fly(vehicle, scenario, parameter, values, step)
    ended = [int(run) for run in np.flatnonzero(sum(flown[model]["status"] for model in MODELS))]
    kept = np.setdiff1d(np.arange(len(values)), ended)
    inertia = np.array([_arm_inertia(vehicles.select(run)) for run in range(len(values))])
    columns = {"value": values, "arm_inertia_kg_m2": inertia}
    columns |= measures(vehicles, flown[REFERENCE])
    errors = {
        model: np.array([_rms(distance) for distance in apart(flown[REFERENCE], flown[model])])
        for model in OTHERS
    }
    return {
        "ended_early": values[ended].tolist(),
        **{name: column[kept].tolist() for name, column in columns.items()},
        "rmse_xy_m": {model: column[kept].tolist() for model, column in errors.items()},
    }


def _arm_inertia(vehicle: Vehicle) -> float:
    """Inertia of the straight arm about its base, across its axis [kg m²]."""
    arm = vehicle.arm
    disks = sum(disk.mass * disk.position**2 for disk in arm.disks)
    return float(arm.backbone_mass * arm.length**2 / 3 + disks)


def _rms(distance: Array) -> float:
    return float(np.sqrt(np.mean(distance**2)))


def _by_second(distance: Array) -> list[float]:
    """RMS within each second of the flight."""
    per_second = round(1 / SAMPLE)
    return [
        _rms(distance[first : first + per_second + 1])
        for first in range(0, len(distance) - 1, per_second)
    ]


def _joined(parameter: Parameter, flown: Flown) -> xr.Dataset:
    joined = xr.concat(
        [flown[model].expand_dims(model=[model]) for model in MODELS],
        dim="model",
        combine_attrs="drop_conflicts",
    )
    return joined.assign_coords(value=("run", np.array(parameter.values)))
