"""Results read back from their netCDF files, and the vehicles that flew them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from continuair.errors import InputError, shown
from continuair.files import DAMAGE, check_regular, check_version, printed, reason, user_path
from continuair.flight.provenance import is_joined
from continuair.vehicle.vehicle import Vehicle, vehicle_of_run

GIVEN_TO_STEPS = "given to Simulation.step"
"""What a result says, in place of a function's name, of inputs that no scenario knows."""

BATCH_ROW = "batch_row"
"""Coordinate along run: which row of its batch each run was, whatever labels run has since."""

_MOST_UNPACKED = 1100
"""Bytes that a byte of deflated data gives at most, a little more than it can."""

_FREELY_UNPACKED = 1 << 26
"""Bytes that a variable may always have, such as one of fill values."""


def read_result(path: str | os.PathLike[str]) -> xr.Dataset:
    """A result that `to_netcdf` or a study wrote, all of it in memory.

    Raises InputError for what is not there, no netCDF, damaged, not ours, or of a later version.
    """
    with opened(path) as result:
        return result.load()


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[xr.Dataset]:
    """A result, of whose file only what is used is read; raises InputError as `read_result` does,
    also for what its user finds damaged."""
    file = user_path("result", path)
    check_regular("result", file)
    named = f"result is {printed(path)}, "
    if file.is_dir():
        raise InputError(f"{named}which is a folder; give a .nc file in it.")
    try:
        _check_contained(file, named)
        with xr.open_dataset(file, engine="h5netcdf") as result:
            _check_ours(path, result)
            yield result
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{named}but there is no such file; correct the path.") from None
    except DAMAGE as error:
        raise InputError(
            f"{named}which cannot be read as netCDF ({reason(error)}); it is damaged or something "
            "else: write it again with to_netcdf or a study."
        ) from None


def _check_contained(file: Path, named: str) -> None:
    """Raise InputError for a file that HDF5 would read other files for, or that unpacks to far more
    than it can hold."""
    import h5py

    with h5py.File(file, "r") as root:
        seen: set[int] = set()
        groups = [root]
        while groups:
            group = groups.pop()
            for name in group:
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    raise InputError(f"{named}whose {name} is a link; give the file that it is in.")
                member = group[name]
                address = h5py.h5o.get_info(member.id).addr
                if address in seen:
                    continue
                seen.add(address)
                if isinstance(member, h5py.Group):
                    groups.append(member)
                elif isinstance(member, h5py.Dataset):
                    _check_data(member, named, name)


def _check_data(member: Any, named: str, name: str) -> None:
    """Raise InputError for a variable whose values are not all in the file."""
    if member.external or member.is_virtual:
        raise InputError(f"{named}whose {name} is stored in other files; give one that holds it.")
    if member.nbytes > _MOST_UNPACKED * member.id.get_storage_size() + _FREELY_UNPACKED:
        raise InputError(
            f"{named}whose {name} would unpack to {member.nbytes:.3g} bytes, more than the file "
            "can hold; it is damaged or made to fill the memory."
        )


def _check_ours(path: str | os.PathLike[str], result: xr.Dataset) -> None:
    """Raise InputError for what no continuair, or one to come, has written of a vehicle."""
    if "versions" not in result.attrs:
        raise InputError(
            f"result is {printed(path)}, which holds no flight of continuair; give a result of "
            "continuair.simulate, or of a study."
        )
    check_version("result", path, str(json.loads(result.attrs["versions"]).get("continuair", "0")))
    if "vehicle" not in result.attrs:
        raise InputError(
            f"result is {printed(path)}, which does not say which vehicle flew; keep the "
            "attributes of continuair.simulate when it is written."
        )


def vehicle_of(flight: Any) -> Vehicle:
    """The vehicle that a result says has flown, of a batch that of the run that is chosen.

    Raises InputError where it says none, or many.
    """
    if not isinstance(flight, xr.Dataset) or "vehicle" not in flight.attrs or is_joined(flight):
        raise InputError(
            "flight does not say which vehicle flew it, as flights that were joined, or cast to "
            "another type, do not; give a result of continuair.simulate as it is, or the vehicle."
        )
    said = flight.attrs["vehicle"]
    try:
        return vehicle_of_run(json.loads(said), run_of(flight))
    except DAMAGE as error:
        why = reason(error).rstrip(".")
        raise InputError(
            "flight says of its vehicle what cannot be read, or is of many vehicles; choose a run, "
            f"as in flight.isel(run=0), which keeps the coordinate {BATCH_ROW}, or give the "
            f"vehicle that flew ({why})."
        ) from None


def vehicles_of(flight: xr.Dataset) -> list[Vehicle]:
    """The vehicles that a result says have flown, one for each run; none where it does not tell."""
    if "vehicle" not in flight.attrs or is_joined(flight):
        return []
    rows = flight.coords.get(BATCH_ROW)
    chosen: list[int | None] = [None]
    if rows is not None and rows.dtype.kind in "iu":
        chosen = np.unique(rows).tolist()
    try:
        said = json.loads(flight.attrs["vehicle"])
        return [vehicle_of_run(said, row) for row in chosen]
    except DAMAGE:
        return []


def run_of(flight: xr.Dataset) -> int | None:
    """The row of its batch that a flight was; None where it does not tell."""
    row = flight.coords.get(BATCH_ROW)
    # Interpolated between runs it is no whole number.
    return int(row) if row is not None and row.ndim == 0 and row.dtype.kind in "iu" else None


def scenario_of(flight: xr.Dataset) -> dict[str, Any]:
    """What a result says of its scenario: functions of time by their names alone; nothing where
    flights were joined.

    Raises InputError where that cannot be read.
    """
    if is_joined(flight):
        return {}
    try:
        return dict(json.loads(flight.attrs.get("scenario", "{}")))
    except DAMAGE as error:
        raise InputError(
            f"flight says of its scenario what cannot be read ({reason(error)}); give a result of "
            "continuair.simulate as it is."
        ) from None


def check_arms_flown(name: str, flight: xr.Dataset) -> None:
    """Raise InputError for a result whose vehicle has no arm, if it tells."""
    flown = vehicles_of(flight)
    if flown and not flown[0].arms:
        raise InputError(
            f"{name} was flown by {shown(flown[0].name)}, which has no arm, but this needs one; "
            "use its position and attitude."
        )
