"""Sweeps of the paper's parameter study for vehicles drawn from the ranges of all its sweeps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from amiri2026.paper.drawn import draw
from amiri2026.sensitivity.measures import apart, measures, rms
from amiri2026.sensitivity.once import DECOUPLED, scenario_of
from amiri2026.sensitivity.study import fly_all
from amiri2026.sensitivity.task import PARAMETERS
from continuair import Vehicle
from continuair.flight import RESOLVED
from continuair.kernels import PLANTS, REFERENCE
from continuair.typing import Model

Array = np.ndarray

VEHICLES = 32
"""A power of two, as Sobol points are drawn."""

MEASURED = slice(None, None, 4)
"""Samples that are measured: measuring all would take longer than the flights. Peaks of stiff arms
come out lower, such as by 8 % for `table1`, but the claims are about much larger changes."""


@dataclass(frozen=True)
class DrawnSweep:
    """A parameter at the paper's values for each random vehicle; vehicles lie along the first axis.

    fields: of the vehicles, before the parameter is varied. measured: (vehicles, values), the keys
    of `measures`, and "error", the horizontal RMSE of the decoupled tip [m] where available.
    usable: (vehicles,), simulated to the end at all values, and resolved.
    """

    fields: dict[str, Array]
    measured: dict[str, Array]
    usable: Array


def fly_drawn_sweep(
    vehicle: Vehicle,
    name: str,
    *,
    models: Sequence[Model] = PLANTS,
    hertz: bool = False,
    straight: bool = False,
) -> DrawnSweep:
    """Fly the paper's values of a parameter with VEHICLES vehicles; options as in `sweep_once`."""
    values, fields = PARAMETERS[name].values, draw(vehicle, VEHICLES)
    shape = VEHICLES, len(values)
    repeated = {key: np.repeat(column, len(values), axis=0) for key, column in fields.items()}
    repeated[str(PARAMETERS[name].field)] = np.tile(values, VEHICLES)
    vehicles = vehicle.replace(repeated)
    flown = fly_all(vehicles, scenario_of(hertz, straight), models)
    thinned = {model: flights.isel(time=MEASURED) for model, flights in flown.items()}
    measured = measures(vehicles, thinned[REFERENCE])
    if DECOUPLED in flown:
        distances = apart(thinned[REFERENCE], thinned[DECOUPLED])
        measured["error"] = np.array([rms(distance) for distance in distances])
    well = [(run["status"] == 0) & (run["error_estimate"] <= RESOLVED) for run in flown.values()]
    return DrawnSweep(
        fields,
        {key: column.reshape(shape) for key, column in measured.items()},
        np.all([each.to_numpy() for each in well], axis=0).reshape(shape).all(axis=1),
    )
