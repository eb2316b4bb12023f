"""Sweeps of one parameter for more vehicles than the study's.

They contain the values that the checks of `findings` need. Runs that are not resolved are left out
of the values between, and flagged among those compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from amiri2026.sensitivity.measures import apart, by_second, measures, range_of, rms
from amiri2026.sensitivity.study import ERROR_SHARE, fly_all
from amiri2026.sensitivity.swing import swings_apart
from amiri2026.sensitivity.task import PARAMETERS, batch, flight
from continuair import Scenario, Vehicle
from continuair.analysis import CONVERGED, Flown, straight_arm_inertia
from continuair.kernels import PLANTS, REFERENCE

Array = np.ndarray

VALUES = 13
"""Values flown from the least to the largest, beside those that the paper compares."""

DECOUPLED = "decoupled"


def scenario_of(hertz: bool, straight: bool) -> Scenario:
    """Return the scenario of the sweeps. straight: with an arm that is straight at the start."""
    scenario = flight(hertz)
    if not straight:
        return scenario
    q = np.array(scenario.q, float)
    q[6] = 0.0
    return scenario.replace(q=q)


def sweep_once(
    vehicle: Vehicle, name: str, *, hertz: bool = False, straight: bool = False
) -> dict[str, Any]:
    """Return a sweep as `Sensitivity.results` has it, of the coupled and the decoupled model.

    hertz: whether f counts in Hz. straight: whether the arm is straight at the start.
    """
    parameter = PARAMETERS[name]
    values = parameter.between(VALUES)
    vehicles, starts = batch(vehicle, scenario_of(hertz, straight), parameter, values)
    compared = np.isin(values, parameter.values)
    flown = fly_all(vehicles, starts, PLANTS)
    inertia = np.array([straight_arm_inertia(vehicles.select(run)) for run in range(len(values))])
    columns = {"arm_inertia_kg_m2": inertia} | measures(vehicles, flown[REFERENCE])
    distances = apart(flown[REFERENCE], flown[DECOUPLED])
    errors = np.array([rms(distance) for distance in distances])
    usable = _resolved(vehicles, flown, np.where(compared, CONVERGED, ERROR_SHARE) * errors)
    rows = [
        {"value": value, "label": parameter.label(value)}
        | {"mass_kg": float(vehicles.select(run).mass)}
        | {key: float(column[run]) for key, column in columns.items()}
        | {"range_m": range_of(flown[REFERENCE].isel(run=[run]))}
        | {"models": _models(distances[run], bool(usable[run]))}
        for run, value in enumerate(values)
        if compared[run]
    ]
    if name == "arm length":
        _add_swings(rows, vehicles, flown, values)
    kept = {"value": values, "rmse_xy_m": errors} | columns
    between: dict[str, Any] = {key: column[usable].tolist() for key, column in kept.items()}
    between["rmse_xy_m"] = {DECOUPLED: between["rmse_xy_m"]}
    between |= {"ended_early": [], "unresolved": values[~usable].tolist()}
    described = {"units": parameter.units, "scale": parameter.scale}
    return described | {"rows": rows, "between": between}


def _models(distance: Array, usable: bool) -> dict[str, dict[str, Any]]:
    found = {"rmse_xy_m": rms(distance), "rmse_xy_by_second_m": by_second(distance)}
    return {REFERENCE: {"converged": usable}, DECOUPLED: {"converged": usable} | found}


def _add_swings(rows: list[dict[str, Any]], vehicles: Vehicle, flown: Flown, values: Array) -> None:
    """Add `swing.differences` to the rows; they take as long as the flights."""
    for row in rows:
        run = int(np.flatnonzero(values == row["value"])[0])
        one = {model: flights.isel(run=[run]) for model, flights in flown.items()}
        (swings,) = swings_apart(vehicles.select(run), one, REFERENCE)[DECOUPLED]
        row["models"][DECOUPLED] |= swings


def _resolved(vehicles: Vehicle, flown: Flown, most: Array) -> Array:
    """Which runs flew to the end with tips that are off by at most `most` (runs,) [m]."""
    length = np.asarray(vehicles.arm.length)
    error = sum(length * flights["error_estimate"].to_numpy() for flights in flown.values())
    ended = np.any([flights["status"].to_numpy() != 0 for flights in flown.values()], axis=0)
    return np.asarray(~ended & (error <= most))
