"""The store of a sweep: a zarr group that survives being killed at any moment.

`results` (runs, models, quantities) has one chunk per unit of work, and `done` (units,) one flag
per unit, written after that chunk. Both are written whole and renamed into place, and so is the
store's own metadata, last of all: what there is, is complete.
"""

from __future__ import annotations

import json
import os
import shutil
import uuid
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from continuair.errors import InputError
from continuair.sweeps.design import Design, Variable
from continuair.sweeps.machine import machine
from continuair.sweeps.tables import Base
from continuair.sweeps.units import quantities, unit_size
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

FORMAT = 1
_METADATA = "zarr.json"
_NEW = ".new-"
_ARRAYS = ("results", "done", "design")
# A file takes whole blocks of the disk; a unit has two.
_BYTES_PER_UNIT = 2 * 4096
_DISK_MARGIN = 1.05
_VERSIONS = ("continuair", "warp-lang", "numpy", "scipy")


@dataclass(frozen=True)
class Store:
    """An open store: its design, the device and the unit size that it was made for."""

    path: Path
    design: Design
    device: str
    size: int
    results: Any
    done_flags: Any
    attributes: dict[str, Any]

    @property
    def units(self) -> int:
        """The number of units of work."""
        return -(-self.design.runs // self.size)

    def runs(self, unit: int) -> Array:
        """The indices of a unit's runs."""
        return np.arange(unit * self.size, min((unit + 1) * self.size, self.design.runs))

    def done(self) -> Array:
        """Which units are done (units,)."""
        flags: Array = self.done_flags[:].astype(bool)
        return flags

    def write(self, unit: int, block: Array) -> None:
        """Keep the results of a unit, its flag last; raises InputError if the disk is full."""
        runs = self.runs(unit)
        try:
            self.results[runs[0] : runs[-1] + 1] = block
            self.done_flags[unit] = 1
        except OSError as error:
            raise InputError(
                f"out is {self.path}, which can no longer be written to ({error.strerror}); make "
                "room there, and repeat the command to go on."
            ) from None

    def clean(self) -> None:
        """Remove what killed processes have left; call it when no other can be writing."""
        for left in [*self.path.glob(f"{_NEW}*"), *self.path.rglob("*.partial")]:
            shutil.rmtree(left) if left.is_dir() else left.unlink(missing_ok=True)


def bytes_needed(design: Design, size: int) -> int:
    """How large the store of a design gets [bytes], at most."""
    numbers = design.runs * len(design.models) * len(quantities(design))
    inputs = sum(variable.values.nbytes for variable in design.variables.values())
    return 8 * numbers + inputs + -(-design.runs // size) * _BYTES_PER_UNIT


def check_new(path: Path, design: Design, size: int) -> None:
    """Raise InputError unless a store can be made: a usable folder, and room on its disk."""
    if path.exists() and not path.is_dir():
        raise InputError(f"out is {path}, which is a file; name a folder for the store.")
    foreign = [
        entry.name
        for entry in (path.iterdir() if path.is_dir() else ())
        if entry.name not in _ARRAYS and not entry.name.startswith(_NEW)
    ]
    if foreign:
        raise InputError(
            f"out is {path}, which holds {sorted(foreign)[0]} and is no store of a sweep; name a "
            "new or empty folder."
        )
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.is_dir())
    needed, free = bytes_needed(design, size), shutil.disk_usage(existing).free
    if needed * _DISK_MARGIN > free:
        raise InputError(
            f"out is {path}, where the {design.runs:,} runs of the design take {_size(needed)}, "
            f"but {_size(free)} are free; vary less, or name a folder on another disk."
        )


def is_store(path: Path) -> bool:
    """Whether there is a store, or another zarr group, to open at a path."""
    return (path / _METADATA).is_file()


def create(path: Path, design: Design, device: str) -> None:
    """Make the store of a design, where `check_new` has no objection.

    Where several processes do so at once, they make it together.
    """
    size = unit_size(design, device)
    new = path / f"{_NEW}{uuid.uuid4().hex}"
    try:
        new.mkdir(parents=True)
        _fill(new, design, device, size)
        for name in _ARRAYS:
            _move(new / name, path / name)
        # What makes it a store comes last.
        _move(new / _METADATA, path / _METADATA)
    except OSError as error:
        raise InputError(
            f"out is {path}, which cannot be written to ({error.strerror}); name another folder."
        ) from None
    finally:
        shutil.rmtree(new, ignore_errors=True)


def open_store(
    path: Path,
    device: str | None = None,
    design: Design | None = None,
    *,
    any_version: bool = False,
) -> Store:
    """Open a store, of a design and for a device if they are given; raises InputError.

    any_version: whether what is read may come from other versions, as it may not to be continued.
    """
    if not is_store(path):
        raise InputError(
            f"out is {path}, where there is no store of a sweep; make one there first."
        )
    group = zarr.open_group(path, mode="r" if any_version else "r+", use_consolidated=False)
    attributes: dict[str, Any] = dict(group.attrs)
    if attributes.get("continuair_sweep") != FORMAT:
        raise InputError(
            f"out is {path}, which holds no sweep of this version; name another folder."
        )
    _check_continued(path, attributes, design, device, any_version)
    found = _design_of(group, attributes) if design is None else design
    size, kind = attributes["unit_size"], attributes["device"]
    return Store(path, found, kind, size, group["results"], group["done"], attributes)


def _check_continued(
    path: Path,
    attributes: dict[str, Any],
    design: Design | None,
    device: str | None,
    any_version: bool,
) -> None:
    """Raise InputError unless a store is that of the design, the versions and the device."""
    if design is not None and attributes["design_hash"] != design.digest:
        raise InputError(
            f"out is {path}, which holds the sweep of another design "
            f"({attributes['design']['base']['name']}); name another folder, or use that design."
        )
    here, there = _versions(), attributes["versions"]
    for name in _VERSIONS:
        if there[name] != here[name] and not any_version:
            raise InputError(
                f"out is {path}, which {name} {there[name]} began, but here is {here[name]}; "
                "install that version, or name another folder."
            )
    if device is not None and attributes["device"] != _kind(device):
        raise InputError(
            f"out is {path}, which was begun with device {attributes['device']}, but device is "
            f"{device}; use the same, or name another folder."
        )


def _fill(new: Path, design: Design, device: str, size: int) -> None:
    group = zarr.open_group(new, mode="w")
    names = quantities(design)
    shape = (design.runs, len(design.models), len(names))
    group.create_array(
        "results",
        shape=shape,
        chunks=(size, *shape[1:]),
        dtype="float64",
        fill_value=np.nan,
        compressors=None,
        dimension_names=("run", "model", "quantity"),
    )
    units = -(-design.runs // size)
    group.create_array(
        "done",
        shape=(units,),
        chunks=(1,),
        dtype="uint8",
        fill_value=0,
        compressors=None,
        dimension_names=("unit",),
    )
    inputs = group.create_group("design")
    for name, variable in design.variables.items():
        if _is_array(variable):
            values = variable.values
            made = inputs.create_array(
                name,
                shape=values.shape,
                chunks=values.shape,
                dtype=values.dtype,
                compressors=None,
                dimension_names=variable.dims,
            )
            made[...] = values
    group.attrs.update(_attributes(design, device, size))


def _attributes(design: Design, device: str, size: int) -> dict[str, Any]:
    listed = {
        name: [list(variable.dims), variable.values.tolist()]
        for name, variable in design.variables.items()
        if not _is_array(variable)
    }
    return {
        "continuair_sweep": FORMAT,
        "design_hash": design.digest,
        "design": json.loads(json.dumps(design.describe())),
        "variables": list(design.variables),
        "listed": listed,
        "sizes": dict(design.sizes),
        "models": list(design.models),
        "quantities": list(quantities(design)),
        "seed": design.base.seed,
        "unit_size": size,
        "device": _kind(device),
        "machine": machine(),
        "versions": _versions(),
    }


def _design_of(group: Any, attributes: dict[str, Any]) -> Design:
    """The design that a store was made for."""
    numbers = {
        name: Variable(tuple(array.metadata.dimension_names or ()), array[...])
        for name, array in group["design"].arrays()
    }
    listed = {
        name: Variable(tuple(dims), np.array(values))
        for name, (dims, values) in attributes["listed"].items()
    }
    variables = {name: {**numbers, **listed}[name] for name in attributes["variables"]}
    described = attributes["design"]
    return Design(
        Base(**described["base"]), Vehicle(**described["vehicle"]), variables, attributes["sizes"]
    )


def _versions() -> dict[str, str]:
    return {name: version(name) for name in _VERSIONS}


def _kind(device: str) -> str:
    return device.split(":")[0]


def _is_array(variable: Variable) -> bool:
    """Whether an array holds the variable; the attributes hold texts and what does not vary."""
    return bool(variable.dims) and variable.values.dtype.kind in "bf"


def _move(source: Path, target: Path) -> None:
    """Rename, unless another process has made the same already."""
    if not target.exists():
        try:
            os.rename(source, target)
            return
        except OSError:
            if not target.exists():
                raise
    if source.is_dir() and _contents(source) != _contents(target):
        raise InputError(
            f"out is {target.parent}, which holds the beginning of another sweep; remove it, or "
            "name another folder."
        )


def _contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def _size(count: float) -> str:
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if count < 1000.0:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.3g} PB"
