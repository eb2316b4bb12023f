"""Flights read back from the files of studies and of `to_netcdf`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import xarray as xr

from continuair.analysis.motion import arm_variable
from continuair.errors import InputError, nearest
from continuair.files import printed
from continuair.flight.reading import opened, vehicle_of, vehicles_of
from continuair.studies.contents import Contents, read
from continuair.vehicle.vehicle import Vehicle

_OF_MODELS = ("coupled", "decoupled")
"""The model that is shown where a file has several, and the one beside it."""

_INSIDE = ("time", "section", "bend_axis", "strain_coordinate", "axis")
"""Dimensions of the bend of one flight."""


_STORE = "zarr.json"
"""Files of a sweep's store."""


class _NoFlight(InputError):
    """A file of ours that contains no flight."""


@dataclass(frozen=True)
class Recorded:
    """A flight of a file: its name, and its index in the file's leading dimensions."""

    name: str
    path: Path
    at: dict[str, int]

    def load(self) -> tuple[Vehicle, xr.Dataset, xr.Dataset | None]:
        """Return the vehicle, the flight, and that of the other model if there is one."""
        with opened(self.path) as file:
            one = file.isel(self.at)
            vehicle = vehicle_of(one)
            if "model" not in file.dims:
                return vehicle, one.load(), None
            models = [str(model) for model in file["model"].to_numpy()]
            first = _OF_MODELS[0] if _OF_MODELS[0] in models else models[0]
            others = [_OF_MODELS[1], *models]
            second = next((each for each in others if each in models and each != first), None)
            ghost = None if second is None else one.sel(model=second).load()
            return vehicle, one.sel(model=first).load(), ghost


def recorded(path: Path) -> list[Recorded]:
    """Return the flights of a netCDF file or of a study's folder; raises InputError."""
    if not path.is_dir():
        return list(_in_file(path, ""))
    if (path / _STORE).is_file():
        raise InputError(
            "result",
            f"is {printed(path)}, a sweep's store, which keeps metrics and no flights",
            "simulate the run of interest, and give that",
        )
    found = list(_in_folder(read(path), ""))
    if not found:
        raise InputError(
            "result",
            (
                f"is {printed(path)}, whose files hold no flight with position, attitude "
                "and bend over time"
            ),
            "name a folder of open-loop, sensitivity or tracking",
        )
    return found


def chosen(flights: list[Recorded], name: str | None) -> Recorded:
    """Return the flight of a name, the first by default; raises InputError."""
    if name is None:
        return flights[0]
    names = [each.name for each in flights]
    if name not in names:
        raise InputError("flight", f"is {name!r}, which does not exist", nearest(name, names))
    return flights[names.index(name)]


def _in_folder(contents: Contents, before: str) -> Iterator[Recorded]:
    """Yield flights of a study's own files, and of the studies in it."""
    for path in sorted(contents.path.glob(f"{contents.study}_*.nc")):
        own = path.stem.removeprefix(f"{contents.study}_")
        try:
            yield from _in_file(path, f"{before}{own}")
        except _NoFlight:
            continue
    for part in contents.parts:
        yield from _in_folder(part, f"{before}{part.study}/")


def _in_file(path: Path, name: str) -> Iterator[Recorded]:
    with opened(path) as file:
        armed = any(vehicle.arms for vehicle in vehicles_of(file))
        moving = arm_variable(file) if armed else "position"
        if moving not in file or "time" not in file[moving].dims:
            raise _NoFlight(
                "result",
                f"is {printed(path)}, which holds no {moving} over time",
                "simulate with position, attitude and bend among the variables",
            )
        dims = [str(dim) for dim in file[moving].dims if dim not in (*_INSIDE, "model")]
        labels = {dim: _labels(file, dim) for dim in dims}
        for at in product(*(range(file.sizes[dim]) for dim in dims)):
            words = [labels[dim][index] for dim, index in zip(dims, at, strict=True)]
            called = "/".join(([name] if name else []) + words) or path.stem
            yield Recorded(called, path, dict(zip(dims, at, strict=True)))


def _labels(file: xr.Dataset, dim: str) -> list[str]:
    """Return labels of the flights along a dimension: its coordinate, or their index."""
    said = file[dim].to_numpy() if dim in file.coords else range(file.sizes[dim])
    return [str(each) for each in said]
