"""Flights read back from the files of studies and of `to_netcdf`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import xarray as xr

from continuair.errors import InputError, nearest
from continuair.files import check_regular, printed, reason
from continuair.report.contents import DAMAGE, Contents, numbers_of, read
from continuair.vehicle.vehicle import Vehicle, load_vehicle
from continuair.viewer.scene import vehicle_of

_OF_MODELS = ("coupled", "decoupled")
"""The model that is shown where a file has several, and the one beside it."""

_INSIDE = ("time", "section", "bend_axis")
"""Dimensions of the bend of one flight."""


@dataclass(frozen=True)
class Recorded:
    """A flight of a file: what it is called, and which of the file's leading dimensions it is."""

    name: str
    path: Path
    at: dict[str, int]

    def load(self) -> tuple[Vehicle, xr.Dataset, xr.Dataset | None]:
        """Return the vehicle, the flight, and that of the other model if there is one."""
        with _opened(self.path) as file:
            one = file.isel(self.at)
            vehicle = _vehicle(file, self.at)
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
    found = list(_in_folder(read(path), ""))
    if not found:
        raise InputError(
            f"result is {printed(path)}, whose files hold no flight with position, attitude and "
            "bend over time; name a folder of open-loop, sensitivity or tracking."
        )
    return found


def chosen(flights: list[Recorded], name: str | None) -> Recorded:
    """Return the flight of a name, the first by default; raises InputError."""
    if name is None:
        return flights[0]
    names = [each.name for each in flights]
    if name not in names:
        raise InputError(f"flight is {name!r}, but there is none of that name; "
                         f"{nearest(name, names)}.")  # fmt: skip
    return flights[names.index(name)]


def _in_folder(contents: Contents, before: str) -> Iterator[Recorded]:
    """Flights of a study's own files, and of the studies in it."""
    for path in sorted(contents.path.glob(f"{contents.study}_*.nc")):
        own = path.stem.removeprefix(f"{contents.study}_")
        try:
            yield from _in_file(path, f"{before}{own}")
        except _NoFlight:
            continue
    for part in contents.parts:
        yield from _in_folder(part, f"{before}{part.study}/")


def _in_file(path: Path, name: str) -> Iterator[Recorded]:
    with _opened(path) as file:
        dims = [str(dim) for dim in file["bend"].dims if dim not in (*_INSIDE, "model")]
        labels = {dim: _labels(file, dim) for dim in dims}
        for at in product(*(range(file.sizes[dim]) for dim in dims)):
            words = [labels[dim][index] for dim, index in zip(dims, at, strict=True)]
            called = "/".join(([name] if name else []) + words) or path.stem
            yield Recorded(called, path, dict(zip(dims, at, strict=True)))


def _labels(file: xr.Dataset, dim: str) -> list[str]:
    """What the flights along a dimension are called: by its coordinate, or by their index."""
    said = file[dim].to_numpy() if dim in file.coords else range(file.sizes[dim])
    return [str(each) for each in said]


class _NoFlight(InputError):
    """A file of ours that holds something else."""


@contextmanager
def _opened(path: Path) -> Iterator[xr.Dataset]:
    check_regular("result", path)
    try:
        with xr.open_dataset(path, engine="h5netcdf") as file:
            _check(path, file)
            yield file
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"result is {printed(path)}, but there is no such file; correct the "
                         "path, or name a preset.") from None  # fmt: skip
    except DAMAGE as error:
        why = reason(error) if isinstance(error, (OSError, ValueError)) else repr(error)
        raise InputError(
            f"result is {printed(path)}, which cannot be read as netCDF ({why}); it is damaged or "
            "something else: write it again with to_netcdf or a study."
        ) from None


def _check(path: Path, file: xr.Dataset) -> None:
    """Raise InputError for what no continuair, or one to come, has written."""
    if "versions" not in file.attrs:
        raise InputError(
            f"result is {printed(path)}, which continuair has not written; name a flight of "
            "continuair.simulate that to_netcdf or a study wrote."
        )
    made = str(json.loads(file.attrs["versions"]).get("continuair", "0"))
    if numbers_of(made) > numbers_of(version("continuair")):
        raise InputError(
            f"result is {printed(path)}, which continuair {made} has written, and this is "
            f"{version('continuair')}; update it."
        )
    if "vehicle" not in file.attrs:
        raise InputError(
            f"result is {printed(path)}, which does not say which vehicle flew; keep the "
            "attributes of continuair.simulate when it is written."
        )
    if "bend" not in file or "time" not in file["bend"].dims:
        raise _NoFlight(
            f"result is {printed(path)}, which holds no bend over time; simulate with position, "
            "attitude and bend among the variables."
        )


def _vehicle(file: xr.Dataset, at: dict[str, int]) -> Vehicle:
    """The vehicle of one flight; files of batches hold arrays over their runs."""
    try:
        return vehicle_of(file)
    except InputError:
        if "run" not in at:
            raise
        fields: dict[str, Any] = json.loads(file.attrs["vehicle"])
        whole = {
            f"{part}.{name}": value
            for part in ("uav", "arm", "camera")
            for name, value in fields[part].items()
            if value not in (None, "", [])
        }
        return load_vehicle("paper").replace(whole).select(at["run"])
