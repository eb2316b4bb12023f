"""The variables of a flight, component by component, with the unit of each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from continuair.analysis.motion import Motion

_OF_COORDINATE = {"roll": "rad", "pitch": "rad", "yaw": "rad", "psi": "rad", "kappa": "1/m"}
"""Units of the paper's coordinates, by the start of their names; lengths else."""


@dataclass(frozen=True)
class Column:
    """Numbers over time (n,): of which variable, of which arm, section or axis, and their unit."""

    variable: str
    labels: tuple[str, ...]
    unit: str
    values: np.ndarray


def columns_of(motion: Motion) -> Iterator[Column]:
    """Return all signals logged over time."""
    for name, variable in motion.dataset.data_vars.items():
        if variable.dims[:1] != ("time",):
            continue
        values = variable.to_numpy().reshape(len(motion.time), -1)
        for index, column in enumerate(values.T):
            at = np.unravel_index(index, variable.shape[1:])
            dims = map(str, variable.dims[1:])
            labels = tuple(_label(variable, d, int(i)) for d, i in zip(dims, at, strict=True))
            yield Column(str(name), labels, _unit(variable, labels, index), column)


def _unit(variable: xr.DataArray, labels: tuple[str, ...], index: int) -> str:
    """Return the unit of a component; where they differ, the variable's attribute lists them."""
    units = str(variable.attrs.get("units", "1")).split(", ")
    if variable.name == "q":
        return next((u for start, u in _OF_COORDINATE.items() if labels[0].startswith(start)), "m")
    if variable.name in ("command", "camera_twist"):
        return units[min(index // 3, len(units) - 1)]
    return units[0]


def _label(variable: xr.DataArray, dimension: str, index: int) -> str:
    if dimension in variable.coords:
        return str(variable.coords[dimension].to_numpy()[index])
    return str(index + 1)
