"""Results read from their netCDF files, and their vehicles."""

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
"""Entry of a result's scenario for inputs that were given to `Simulation.step`."""

BATCH_ROW = "batch_row"
"""Coordinate along run: each run's row in its batch, independent of the labels of run."""

_MOST_UNPACKED = 1100
"""Upper limit of the ratio of unpacked to deflated bytes."""

_FREELY_UNPACKED = 1 << 26
"""Bytes that a variable may always have, such as one of fill values."""


def read_result(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a result that `to_netcdf` or a study wrote.

    Parameters
    ----------
    path : str or path
        The netCDF file.

    Returns
    -------
    xarray.Dataset
        The result, in memory.

    Raises
    ------
    InputError
        If the file does not exist, is not netCDF, is damaged, is not a result of continuair, or is
        of a later version.
    """
    with opened(path) as result:
        return result.load()


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[xr.Dataset]:
    """Yield a result whose data are read on use; raises InputError as `read_result` does.

    Also for damage that is found on use.
    """
    file = user_path("result", path)
    check_regular("result", file)
    named = f"is {printed(path)},"
    if file.is_dir():
        raise InputError("result", f"{named} which is a folder", "give a .nc file in it")
    try:
        _check_contained(file, named)
        with xr.open_dataset(file, engine="h5netcdf") as result:
            _check_ours(path, result)
            yield result
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(
            "result", f"{named} but there is no such file", "correct the path"
        ) from None
    except DAMAGE as error:
        raise InputError(
            "result",
            f"{named} which cannot be read as netCDF ({reason(error)})",
            "write it again with to_netcdf or a study",
        ) from None


def _check_contained(file: Path, named: str) -> None:
    """Raise InputError for a file that refers to other files, or unpacks to an impossible size."""
    import h5py

    with h5py.File(file, "r") as root:
        seen: set[int] = set()
        groups = [root]
        while groups:
            group = groups.pop()
            for name in group:
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    raise InputError(
                        "result", f"{named} whose {name} is a link", "give the file that it is in"
                    )
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
        raise InputError(
            "result", f"{named} whose {name} is stored in other files", "give one that has it"
        )
    if member.nbytes > _MOST_UNPACKED * member.id.get_storage_size() + _FREELY_UNPACKED:
        raise InputError(
            "result",
            f"{named} whose {name} would unpack to {member.nbytes:.3g} bytes, more than the file "
            "can hold",
            "give an undamaged file",
        )


def _check_ours(path: str | os.PathLike[str], result: xr.Dataset) -> None:
    """Raise InputError for a file of a later or no version of continuair, or without a vehicle."""
    if "versions" not in result.attrs:
        raise InputError(
            "result",
            f"is {printed(path)}, which has no flight of continuair",
            "give a result of continuair.simulate, or of a study",
        )
    check_version("result", path, str(json.loads(result.attrs["versions"]).get("continuair", "0")))
    if "vehicle" not in result.attrs:
        raise InputError(
            "result",
            f"is {printed(path)}, which has no attribute vehicle",
            "keep the attributes of continuair.simulate when writing it",
        )


def vehicle_of(flight: object) -> Vehicle:
    """Return the vehicle stored in a result, of a batch that of the selected run.

    Raises InputError if there is none, or several.
    """
    if not isinstance(flight, xr.Dataset) or "vehicle" not in flight.attrs or is_joined(flight):
        raise InputError(
            "flight",
            "has no vehicle, as after joining flights or casting types",
            "give an unchanged result of continuair.simulate, or the vehicle",
        )
    said = flight.attrs["vehicle"]
    try:
        return vehicle_of_run(json.loads(said), run_of(flight))
    except DAMAGE as error:
        why = reason(error).rstrip(".")
        raise InputError(
            "flight",
            f"has an unreadable vehicle, or many ({why})",
            (
                f"select a run, as in flight.isel(run=0), with its coordinate {BATCH_ROW}, "
                "or give the vehicle"
            ),
        ) from None


def vehicles_of(flight: xr.Dataset) -> list[Vehicle]:
    """Return the vehicles stored in a result, one per run; none if unknown."""
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
    """Return the row of a flight in its batch; None if unknown."""
    row = flight.coords.get(BATCH_ROW)
    # After interpolation between runs it is not an integer.
    return int(row) if row is not None and row.ndim == 0 and row.dtype.kind in "iu" else None


def scenario_of(flight: xr.Dataset) -> dict[str, Any]:
    """Return the scenario stored in a result, with functions of time by name; empty if joined.

    Raises InputError if it cannot be read.
    """
    if is_joined(flight):
        return {}
    try:
        return dict(json.loads(flight.attrs.get("scenario", "{}")))
    except DAMAGE as error:
        raise InputError(
            "flight",
            f"has an unreadable scenario ({reason(error)})",
            "give an unchanged result of continuair.simulate",
        ) from None


def check_arms_flown(name: str, flight: xr.Dataset) -> None:
    """Raise InputError for a result whose vehicle, if stored, has no arm."""
    flown = vehicles_of(flight)
    if flown and not flown[0].arms:
        raise InputError(
            name,
            f"is of the vehicle {shown(flown[0].name)}, which has no arm",
            "use its position and attitude",
        )
