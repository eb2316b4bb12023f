"""Designs: the runs of a sweep, from a TOML file or an xarray Dataset."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.errors import InputError, shown
from continuair.files import printed, read_toml, user_path
from continuair.kernels.dynamics import REFERENCE
from continuair.sweeps.pairs import METRICS
from continuair.sweeps.readers import check_read
from continuair.sweeps.sampling import flat, values, values_along
from continuair.sweeps.tables import Base, changed, check_field
from continuair.typing import Array, Model
from continuair.vehicle.fields import is_title
from continuair.vehicle.vehicle import Vehicle, load_vehicle

RESERVED = ("run", "model", "quantity", "axis", "quaternion")
"""Names of dimensions that results use."""

_PROBES = 4


@dataclass(frozen=True)
class Variable:
    """A field that varies: its dimensions, and its values over them."""

    dims: tuple[str, ...]
    values: Array

    def at(self, indices: Mapping[str, int | NDArray[np.intp]]) -> Array:
        """Return the values at indices along its dimensions."""
        return np.asarray(self.values[tuple(indices[dim] for dim in self.dims)])


@dataclass(frozen=True)
class Design:
    """The runs of a sweep: a base, and variables over a grid of dimensions.

    Run r is the r-th point of the grid over `sizes`, the last dimension changing fastest.

    Parameters
    ----------
    base : Base
        Fields that all runs share.
    vehicle : Vehicle
        The vehicle of the base.
    variables : mapping of str to Variable
        Fields that vary, by dotted name.
    sizes : mapping of str to int
        Dimensions and their sizes.
    labels : mapping of str to ndarray, optional
        Labels of dimensions, which results keep.
    """

    base: Base
    vehicle: Vehicle
    variables: Mapping[str, Variable]
    sizes: Mapping[str, int]
    labels: Mapping[str, Array] = field(default_factory=dict)

    @property
    def runs(self) -> int:
        """Number of runs."""
        return math.prod(self.sizes.values())

    @property
    def models(self) -> tuple[Model, ...]:
        """Models of every run, the reference first."""
        return (REFERENCE, *dict.fromkeys(self.base.models))

    @property
    def metrics(self) -> tuple[str, ...]:
        """Metrics that are kept."""
        return self.base.metrics or self.possible_metrics

    @property
    def possible_metrics(self) -> tuple[str, ...]:
        """Metrics that the scenario has."""
        closed = self.base.target is not None
        return tuple(name for name in METRICS if closed or not name.endswith("_px"))

    def rows(self, runs: NDArray[np.intp]) -> dict[str, Array]:
        """Return the values of every variable in some runs.

        Parameters
        ----------
        runs : ndarray of int, shape (n,)
            Indices of runs.

        Returns
        -------
        dict of str to ndarray
            Variable to values (n,).
        """
        # A design without variables has no dimension, and one run.
        shape = tuple(self.sizes.values())
        along = np.unravel_index(runs, shape) if shape else ()
        at = dict(zip(self.sizes, along, strict=True))
        return {
            name: np.broadcast_to(variable.at(at), len(runs))
            for name, variable in self.variables.items()
        }

    def probes(self) -> list[int]:
        """Return a few runs to test a design with.

        Returns
        -------
        list of int
            Indices of evenly spread runs, and one for every text value, such as a law's name.
        """
        spread = np.linspace(0, self.runs - 1, _PROBES).astype(int)
        shape, found = tuple(self.sizes.values()), set(spread.tolist())
        for variable in self.variables.values():
            if variable.values.dtype.kind == "U":
                for indices in _extremes(variable):
                    at = dict.fromkeys(self.sizes, 0) | indices
                    found.add(int(np.ravel_multi_index(tuple(at.values()), shape)) if shape else 0)
        return sorted(found)

    def describe(self) -> dict[str, object]:
        """Return the base and the vehicle for JSON.

        Returns
        -------
        dict
            Fields of `base` and `vehicle`.
        """
        return {"base": self.base.model_dump(), "vehicle": self.vehicle.describe()}

    @property
    def digest(self) -> str:
        """Hash of everything that determines the runs."""
        content: dict[str, Any] = {**self.describe(), "sizes": list(self.sizes.items())}
        content["variables"] = {
            name: [variable.dims, str(variable.values.dtype), _hash(variable.values.tobytes())]
            for name, variable in self.variables.items()
        }
        return _hash(json.dumps(content, sort_keys=True).encode())


def load_design(
    design: str | os.PathLike[str] | xr.Dataset | Design, metrics: Iterable[str] | None = None
) -> Design:
    """Load the design of a sweep.

    Parameters
    ----------
    design : str, path, xarray.Dataset or Design
        A TOML file, or a Dataset whose variables are fields (docs/howto/sweeps.md).
    metrics : iterable of str, optional
        Metrics to keep instead of the design's.

    Returns
    -------
    Design
        The design.

    Raises
    ------
    InputError
        If the design cannot be used.
    """
    if isinstance(design, Design):
        found = design
    elif isinstance(design, xr.Dataset):
        found = _from_dataset(design)
    elif isinstance(design, (str, os.PathLike)):
        found = _from_file(user_path("design", design))
    else:
        raise InputError("design", f"is {shown(design)}", "give a .toml file or an xarray Dataset")
    if metrics is not None:
        found = replace(found, base=changed(found.base, {"metrics": metrics}))
    for name in found.metrics:
        if name not in found.possible_metrics:
            raise InputError(
                "metrics",
                f"has {shown(name)}, which this design does not have",
                f"use {', '.join(found.possible_metrics)}",
            )
    return found


def _from_file(path: Path) -> Design:
    """Return the design of a TOML file."""
    tables = read_toml(path)
    try:
        return _from_tables(tables, path.parent)
    except InputError as error:
        raise error.located(printed(path)) from None


def _from_tables(tables: dict[str, Any], folder: Path) -> Design:
    """Return the design of tables."""
    vary, fixed = tables.pop("vary", []), tables.pop("set", {})
    if not isinstance(vary, list) or any(not isinstance(table, dict) for table in vary):
        raise InputError("vary", "is not a list of tables", "write [[vary]] above each of them")
    if not isinstance(fixed, dict):
        raise InputError("set", f"is {shown(fixed)}", "give a table of fields ([set])")
    base = Base(**tables)
    variables = {
        name: Variable((), np.asarray(values(name, [value])[0]))
        for name, value in flat(fixed).items()
    }
    sizes: dict[str, int] = {}
    for index, table in enumerate(vary):
        given = {name: value for name, value in table.items() if name != "dimension"}
        found = values_along(given, [base.seed, index])
        dimension = table.get("dimension", next(iter(found)).rpartition(".")[2])
        if "dimension" in table and not is_title(dimension):
            raise InputError("dimension", f"is {shown(dimension)}", "give one line of text")
        if dimension in sizes:
            raise InputError(
                "dimension",
                f"{shown(dimension)} is that of two vary tables",
                "merge them if their fields vary together, or rename one dimension",
            )
        for name, column in found.items():
            if name in variables:
                raise InputError(name, "varies in two tables", "remove it from one")
            variables[name] = Variable((dimension,), column)
        sizes[dimension] = len(next(iter(found.values())))
    return _design(base, _vehicle(base, folder), variables, sizes)


def _from_dataset(dataset: xr.Dataset) -> Design:
    """Return the design of a Dataset."""
    base = Base(**{str(name): value for name, value in dataset.attrs.items()})
    variables, labels = {}, {}
    for name, variable in dataset.variables.items():
        array = variable.to_numpy()
        array = array.astype(str) if array.dtype.kind == "O" else array
        if name in dataset.dims and "." not in str(name):
            labels[str(name)] = _labels(str(name), array)
            continue
        flattened = values(str(name), array.ravel().tolist())
        dims = tuple(str(dim) for dim in variable.dims)
        variables[str(name)] = Variable(dims, flattened.reshape(array.shape))
    sizes = {str(name): size for name, size in dataset.sizes.items()}
    return replace(_design(base, _vehicle(base, Path()), variables, sizes), labels=labels)


def _labels(name: str, given: Array) -> Array:
    """Return labels of a dimension; InputError for those that a store cannot hold."""
    are_numbers = given.dtype.kind in "biuf" and np.isfinite(given).all()
    if not are_numbers and given.dtype.kind != "U":
        raise InputError(
            "design",
            f"labels its dimension {shown(name)} with {shown(given.tolist())}",
            "give finite numbers or texts, or no labels",
        )
    return given


def _vehicle(base: Base, folder: Path) -> Vehicle:
    """Return the vehicle of a base, a preset or a file."""
    name = base.vehicle
    return load_vehicle(folder / name if name.endswith(".toml") else name)


def _design(
    base: Base, vehicle: Vehicle, variables: dict[str, Variable], sizes: dict[str, int]
) -> Design:
    """Return a checked design."""
    design = Design(base, vehicle, variables, sizes)
    for name in variables:
        if not name.startswith("vehicle."):
            check_field(name, base)
        for indices in _extremes(variables[name]):
            _check_value(design, name, indices)
    check_read(base, {name: variable.values for name, variable in variables.items()})
    for name in sizes:
        if not name or name in RESERVED:
            raise InputError(
                "dimension", f"is {shown(name)}, which results use themselves", "give another name"
            )
    return design


def _extremes(variable: Variable) -> list[dict[str, int]]:
    """Return the indices of the smallest and largest value, or of every text."""
    if not variable.dims:
        return [{}]
    flattened = variable.values.ravel()
    if flattened.dtype.kind == "U":
        places = np.unique(flattened, return_index=True)[1]
    else:
        places = np.array([flattened.argmin(), flattened.argmax()])
    at = np.unravel_index(places, variable.values.shape)
    return [
        dict(zip(variable.dims, (int(i) for i in row), strict=True)) for row in np.transpose(at)
    ]


def _check_value(design: Design, name: str, indices: dict[str, int]) -> None:
    """Raise InputError for a value that is invalid both in its run and with the base alone.

    A value that is invalid only together with other variables makes a row with a status.
    """
    at = dict.fromkeys(design.sizes, 0) | indices
    table = name.partition(".")[0]
    fields = {
        field.removeprefix(f"{table}."): variable.at(at).item()
        for field, variable in design.variables.items()
        if field.startswith(f"{table}.")
    }
    owner = design.vehicle if table == "vehicle" else getattr(design.base, table)
    own = name.removeprefix(f"{table}.")
    try:
        changed(owner, fields)
    except InputError:
        try:
            changed(owner, {own: fields[own]})
        except InputError as error:
            raise error.within(f"{table}.") from None


def _hash(content: bytes) -> str:
    """Return the SHA-256 of content."""
    return hashlib.sha256(content).hexdigest()
