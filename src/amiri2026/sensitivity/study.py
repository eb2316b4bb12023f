"""The parameter sensitivity study of Amiri et al.: six parameters, one at a time.

The paper compares a few values of each parameter. Those, or as few about a vehicle's own, are
simulated with their trajectories kept. Many values between are simulated too, because a few cannot
distinguish a trend from scatter.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from amiri2026.sensitivity.claims import verdicts
from amiri2026.sensitivity.measures import (
    VARIABLES,
    apart,
    by_second,
    measures,
    range_of,
    rms,
)
from amiri2026.sensitivity.swing import swings_apart
from amiri2026.sensitivity.task import PARAMETERS, Parameter, about, batch, flight
from continuair import MODELS, Scenario, Vehicle, checks, simulate
from continuair.analysis import RTOL, SAMPLE, Entries, Flown, entries_of, straight_arm_inertia
from continuair.flight import still
from continuair.kernels import REFERENCE, SIMPLER
from continuair.progress import Progress, Steps
from continuair.studies import by_model
from continuair.typing import Model
from continuair.vehicle import as_rod, check_one_section, per_run
from continuair.warning import untold

Array = NDArray[np.float64]

ERROR_SHARE = 0.1
"""A value between is left out if errors may make more than this share of its differences."""


@dataclass(frozen=True)
class Sensitivity:
    """Results of the study.

    results: JSON-able; results["sweeps"][parameter]["rows"] holds a value each, ["between"] lists
    over many values; results["claims"] the paper's sentences and their verdicts, none about a
    vehicle's own values. datasets: parameter -> trajectories of the values compared, dimensions
    `model`, `run` (with the coordinate `value`, SI units) and `time`.
    """

    results: dict[str, Any]
    datasets: dict[str, xr.Dataset]


def sensitivity(
    vehicle: Vehicle,
    parameters: Iterable[str] | None = None,
    *,
    own: bool = False,
    hertz: bool = False,
    progress: Progress | None = None,
) -> Sensitivity:
    """Vary one parameter of a vehicle or of its start at a time, and compare all models.

    parameters: names in PARAMETERS, or in `about(vehicle)`, all by default. own: whether values are
    about the vehicle's own instead of the paper's, to which its sentences apply. hertz: the paper's
    f = 10 counts as 10 Hz, sin(2 pi 10 t), not as sin(10 t). progress: called with (done, total,
    what) before each batch. Raises InputError.
    """
    check_one_section(vehicle)
    vehicle = vehicle if own else as_rod(vehicle)
    known = about(vehicle) if own else PARAMETERS
    chosen = _chosen(known if parameters is None else parameters, known)
    scenario = flight(hertz).replace(**still(vehicle))
    # Every batch is made before the first flight, so that errors are reported at once.
    for parameter in chosen:
        batch(vehicle, scenario, parameter, parameter.between())
    results: dict[str, Any] = {
        "study": "sensitivity",
        "vehicle": vehicle.describe(),
        "reading_of_f": "sin(2 pi f t)" if hertz else "sin(f t)",
        "reference": REFERENCE,
        "values": "own" if own else "paper",
        "sweeps": {},
    }
    datasets = {}
    steps = Steps(progress, 2 * len(chosen))
    for parameter in chosen:
        steps.begin(f"{parameter.name}, the values compared")
        flown = _fly(vehicle, scenario, parameter, parameter.values)
        steps.begin(f"{parameter.name}, values between")
        results["sweeps"][parameter.name] = _sweep(vehicle, scenario, parameter, flown)
        values = ("run", np.array(parameter.values))
        datasets[parameter.name] = by_model(flown).assign_coords(value=values)
    results["claims"] = [] if own else verdicts(results)
    return Sensitivity(results, datasets)


def _chosen(parameters: Iterable[str], known: Mapping[str, Parameter]) -> list[Parameter]:
    names = checks.choices("parameters", parameters, known)
    return [parameter for name, parameter in known.items() if name in names]


def _fly(vehicle: Vehicle, scenario: Scenario, parameter: Parameter, values: Any) -> Flown:
    vehicles, starts = batch(vehicle, scenario, parameter, values)
    return fly_all(vehicles, starts, MODELS)


@untold("error_estimate")
def fly_all(vehicles: Vehicle, scenario: Scenario, models: Iterable[Model]) -> Flown:
    """Return flights by model over (run, time), with their error estimates."""
    return {
        model: simulate(
            vehicles,
            scenario,
            model=model,
            sample=SAMPLE,
            variables=VARIABLES,
            rtol=RTOL,
            check=True,
        )
        for model in models
    }


def _sweep(
    vehicle: Vehicle, scenario: Scenario, parameter: Parameter, flown: Flown
) -> dict[str, Any]:
    return {
        "units": parameter.units,
        "scale": parameter.scale,
        "values_chosen_here": parameter.chosen,
        "rows": _rows(vehicle, scenario, parameter, flown),
        "between": _between(vehicle, scenario, parameter),
    }


def _rows(
    vehicle: Vehicle,
    scenario: Scenario,
    parameter: Parameter,
    flown: Flown,
) -> list[dict[str, Any]]:
    """A row per value: measures of the coupled flight, and the models' metrics against it."""
    vehicles, _ = batch(vehicle, scenario, parameter, parameter.values)
    measured = measures(vehicles, flown[REFERENCE])
    # The independent UAV carries its arm frozen.
    frozen = measures(vehicles, flown["independent"])["displacement_m"]
    measured["displacement_frozen_m"] = frozen
    distances = {model: apart(flown[REFERENCE], flown[model]) for model in SIMPLER}
    swings = swings_apart(vehicles, flown, REFERENCE)
    entries = _entries(vehicles, flown)
    rows = []
    for run, value in enumerate(parameter.values):
        one = vehicles.select(run)
        for model, distance in distances.items():
            entries[run][model] |= {
                "rmse_xy_m": rms(distance[run]),
                "rmse_xy_by_second_m": by_second(distance[run]),
            } | swings[model][run]
        rows.append(
            {"value": value, "label": parameter.label(value), "mass_kg": float(one.mass)}
            | {"arm_mass_kg": float(one.arm.mass), "arm_inertia_kg_m2": straight_arm_inertia(one)}
            | {name: float(array[run]) for name, array in measured.items()}
            | {"range_m": range_of(flown[REFERENCE].isel(run=[run]))}
            | {"models": entries[run]}
        )
    return rows


def _entries(vehicles: Vehicle, flown: Flown) -> list[Entries]:
    """Return metrics of every model, by run."""
    runs = flown[REFERENCE].sizes["run"]
    each = [{model: data.isel(run=run) for model, data in flown.items()} for run in range(runs)]
    reach = per_run(vehicles.reach, runs)
    return [entries_of(*pair) for pair in zip(each, reach, strict=True)]


def _between(vehicle: Vehicle, scenario: Scenario, parameter: Parameter) -> dict[str, Any]:
    """Return measures and horizontal differences of many values, as lists over the resolved ones.

    The lists include, for each but the first, whether the value before it is among them.
    """
    values = parameter.between()
    vehicles, _ = batch(vehicle, scenario, parameter, values)
    flown = _fly(vehicle, scenario, parameter, values)
    inertia = np.array([straight_arm_inertia(vehicles.select(run)) for run in range(len(values))])
    columns = {"value": values, "arm_inertia_kg_m2": inertia}
    columns |= measures(vehicles, flown[REFERENCE])
    errors = {
        model: np.array([rms(distance) for distance in apart(flown[REFERENCE], flown[model])])
        for model in SIMPLER
    }
    ended = np.any([flown[model]["status"] != 0 for model in MODELS], axis=0)
    coarse = ~ended & _is_unresolved(vehicles, flown, errors)
    kept = np.flatnonzero(~ended & ~coarse)
    return {
        "ended_early": values[ended].tolist(),
        "unresolved": values[coarse].tolist(),
        "follows": (np.diff(kept) == 1).tolist(),
        **{name: column[kept].tolist() for name, column in columns.items()},
        "rmse_xy_m": {model: column[kept].tolist() for model, column in errors.items()},
    }


def _is_unresolved(vehicles: Vehicle, flown: Flown, errors: Mapping[Model, Array]) -> Array:
    """Whether errors may make more than ERROR_SHARE of some model's difference, of each value."""
    length = np.asarray(vehicles.arm.length)
    of = {model: length * flown[model]["error_estimate"].to_numpy() for model in MODELS}
    return np.any(
        [of[REFERENCE] + of[each] > ERROR_SHARE * errors[each] for each in SIMPLER], axis=0
    )
