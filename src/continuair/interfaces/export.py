"""Results and vehicles into the files of other programs, by the suffix of the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr

from continuair.analysis.motion import motion_of
from continuair.errors import InputError, nearest
from continuair.files import new_file, printed, save
from continuair.flight.reading import read_result, vehicle_of
from continuair.interfaces.csv_table import to_csv
from continuair.interfaces.gltf import to_gltf
from continuair.interfaces.mcap_log import to_mcap
from continuair.interfaces.mjcf import to_mjcf
from continuair.vehicle.vehicle import Vehicle, load_vehicle

_VEHICLES = ".xml"
_RESULTS = ".nc"


def export(
    source: str,
    to: str,
    *,
    model: str | None = None,
    run: int | None = None,
    letter: str | None = None,
    links: int | None = None,
) -> None:
    """Write a result (.nc), or a vehicle, as a file of the type of its suffix.

    source: a result, or for .xml also a preset's name or a .toml file. model, run, letter: select a
    flight of a result with several. Raises InputError.
    """
    suffix = Path(to).suffix
    if suffix not in (*_WRITERS, _VEHICLES):
        known = ", ".join([*_WRITERS, _VEHICLES])
        raise InputError("to", f"is {printed(to)}", f"name a file that ends in one of {known}")
    new_file("to", to)
    if suffix == _VEHICLES:
        _refuse(suffix, model=model, run=run, letter=letter)
        to_mjcf(_vehicle(source), to, **({} if links is None else {"links": links}))
        return
    _refuse(suffix, links=links)
    if Path(source).suffix != _RESULTS:
        raise InputError(
            "source",
            f"is {printed(source)}, which does not end in {_RESULTS}",
            f"give a result for {suffix}, as only {_VEHICLES} is of a vehicle",
        )
    chosen = {"model": model, "run": run, "letter": letter}
    _WRITERS[suffix](_one_flight(read_result(source), chosen), to)


def to_netcdf(dataset: xr.Dataset, path: str) -> None:
    """Write one flight as netCDF, whole: nothing is lost. Raises InputError."""
    motion_of(dataset)
    save("path", new_file("path", path), bytes(dataset.to_netcdf(engine="h5netcdf")))


_WRITERS: dict[str, Callable[[xr.Dataset, str], None]] = {
    ".glb": to_gltf,
    ".mcap": to_mcap,
    ".csv": to_csv,
    ".nc": to_netcdf,
}


def _refuse(suffix: str, **options: object) -> None:
    for name, value in options.items():
        if value is not None:
            raise InputError(name, f"is {value}, which {suffix} has no use for", "leave it out")


def _vehicle(source: str) -> Vehicle:
    return (
        vehicle_of(read_result(source)) if Path(source).suffix == _RESULTS else load_vehicle(source)
    )


def _one_flight(dataset: xr.Dataset, chosen: dict[str, Any]) -> xr.Dataset:
    for name, value in chosen.items():
        if name not in dataset.dims:
            if value is not None:
                raise InputError(name, f"is {value}, but the result holds one", "leave it out")
            continue
        valid = dataset[name].to_numpy().tolist()
        if value is None:
            raise InputError(name, "is missing", nearest("", map(str, valid)))
        if value not in valid:
            raise InputError(name, f"is {value!r}", nearest(str(value), map(str, valid)))
        dataset = dataset.sel({name: value}).assign_attrs({name: value})
    return dataset
