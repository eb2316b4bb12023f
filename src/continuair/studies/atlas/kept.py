"""Flights that are kept as they come, so that an atlas that was interrupted goes on."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np
import xarray as xr

from continuair.errors import InputError
from continuair.studies.atlas.summary import load, save

Array = np.ndarray


def kept(
    folder: Path | None, name: str, groups: Mapping[str, Array], fly: Callable[[], xr.Dataset]
) -> xr.Dataset:
    """Return flights of vehicles of some groups, from a folder if it has them, or new ones.

    New ones are saved there, if there is a folder. Files of another version or other groups, and
    unreadable ones, are replaced.
    """
    if folder is None:
        return fly()
    path = folder / f"{name}.npz"
    found = _read(path)
    if found is not None and _same(found, groups):
        return found
    made = fly().assign_attrs(version=version("continuair"))
    folder.mkdir(exist_ok=True)
    whole = path.with_suffix(".new")
    save(made, whole)
    os.replace(whole, path)
    return made


def _read(path: Path) -> xr.Dataset | None:
    try:
        return load(path)
    except InputError:
        return None


def _same(found: xr.Dataset, groups: Mapping[str, Array]) -> bool:
    if found.attrs.get("version") != version("continuair"):
        return False
    return all(n in found and np.array_equal(found[n], values) for n, values in groups.items())
