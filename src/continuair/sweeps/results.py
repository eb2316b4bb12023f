"""Results of a sweep as a labelled Dataset over the dimensions of its design."""

from __future__ import annotations

import json
import os
from typing import Any

import xarray as xr

from continuair import checks
from continuair.files import user_path
from continuair.flight.resolution import (
    warn_of_errors,
    warn_of_lost_angles,
    warn_of_overstated_angles,
    warn_of_saturation,
)
from continuair.sweeps.design import Design
from continuair.sweeps.pairs import lost_angles
from continuair.sweeps.units import MEANINGS
from continuair.typing import Array
from continuair.vehicle.layout import EULER_DEVIATIONS
from continuair.warning import warn

_PROVENANCE = ("design_hash", "seed", "machine", "device", "unit_size", "done")


def open_sweep(out: str | os.PathLike[str]) -> xr.Dataset:
    """Return the results of a store, finished or not.

    Parameters
    ----------
    out : str or path
        The store.

    Returns
    -------
    xarray.Dataset
        Over the design's dimensions and `model`: the metrics, the tip's final position, status,
        end_time, steps or step and, with `check`, error_estimate; NaN for runs that are not done.
        Coordinates are the fields that varied; they label dimensions of the same name. Attributes
        are the provenance; `done` and `runs` count runs.

    Raises
    ------
    InputError
        If there is no store, or it is damaged.
    """
    checks.installed("zarr", "sweep")
    from continuair.sweeps.store import open_store

    store = open_store(user_path("out", out).absolute(), any_version=True)
    attributes = store.attributes
    values, done = store.results()
    return labelled(store.design, values, attributes | {"done": done})


def labelled(design: Design, results: Array, attributes: dict[str, Any]) -> xr.Dataset:
    """Return a Dataset from quantities (runs, models, quantities)."""
    dims, shape = list(design.sizes), list(design.sizes.values())
    grid = results.reshape(*shape, *results.shape[1:])
    data: dict[str, Any] = {}
    for index, name in enumerate(attributes["quantities"]):
        units, meaning = MEANINGS[name]
        data[name] = ([*dims, "model"], grid[..., index], {"units": units, "long_name": meaning})
    names = list(attributes["quantities"])
    if "error_estimate" in names:
        warn_of_errors(results[..., names.index("error_estimate")], stacklevel=4)
    if "largest_saturation" in names:
        largest = results[..., names.index("largest_saturation")]
        warn_of_saturation(design.vehicle, largest, stacklevel=4)
    status = results[..., names.index("status")]
    for name in [name for name in EULER_DEVIATIONS if name in names][:1]:
        lost = lost_angles(results[..., names.index(name)], status)
        warn_of_lost_angles(lost, design.base.sample, stacklevel=4)
    if {"rmse_r_rad", "angle_rad"} <= set(names):
        euler, angle = (results[..., names.index(name)] for name in ("rmse_r_rad", "angle_rad"))
        warn_of_overstated_angles(euler, angle, stacklevel=4)
    _warn_of_still_rotors(design)
    coordinates: dict[str, Any] = {
        name: (list(variable.dims), variable.values) for name, variable in design.variables.items()
    }
    coordinates |= {name: (name, labels) for name, labels in _labels(design).items()}
    coordinates["model"] = list(design.models)
    kept = {name: json.dumps(attributes[name]) for name in ("design", "versions")}
    kept |= {name: attributes[name] for name in _PROVENANCE}
    return xr.Dataset(data, coordinates, {"name": design.base.name, "runs": design.runs, **kept})


def _labels(design: Design) -> dict[str, Array]:
    """Return labels of dimensions: the design's, or the values of the field of the same name.

    Without labels, a value could be mistaken for an index.
    """
    named = {
        variable.dims[0]: variable.values
        for name, variable in design.variables.items()
        if variable.dims == (name.rpartition(".")[2],)
    }
    return named | dict(design.labels)


def _warn_of_still_rotors(design: Design) -> None:
    """Warn that rotors rest in the paper's tests, while `simulate` would let them hover."""
    tests = design.base.scenario.test is not None or "scenario.test" in design.variables
    if tests and design.vehicle.uav.rotors is not None:
        warn(
            "scenario.test stops the rotors, and its forces act on the UAV directly, as in the "
            "paper; use an excitation for hovering rotors.",
            stacklevel=5,
        )
