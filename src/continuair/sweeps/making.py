"""Creation of the store of a sweep, also by several processes at once."""

from __future__ import annotations

import json
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from continuair.engine.compiling import kind_of
from continuair.errors import InputError
from continuair.files import printed, reason
from continuair.sweeps.checksums import sealed
from continuair.sweeps.design import Design, Variable
from continuair.sweeps.hardware import machine
from continuair.sweeps.store import FORMAT, METADATA, NEW, Store, is_store, versions
from continuair.sweeps.units import quantities, unit_size

_ARRAYS = ("results", "done", "design")
_BLOCK = 4096
# Files and folders take whole blocks of the disk. A unit has results, a flag and two folders, and
# entries in two more.
_BLOCKS_PER_UNIT = 3
_NAMES_PER_UNIT = 128
_DISK_MARGIN = 1.05


def bytes_needed(design: Design, size: int) -> int:
    """Return the disk space that the store of a design takes at most [bytes]."""
    units = -(-design.runs // size)
    chunk = 8 * size * len(design.models) * len(quantities(design))
    per_unit = _blocks(chunk) + _BLOCKS_PER_UNIT * _BLOCK + _NAMES_PER_UNIT
    # A variable has a description, and a folder per dimension.
    inputs = sum(
        _blocks(variable.values.nbytes) + (3 + variable.values.ndim) * _BLOCK
        for variable in design.variables.values()
    )
    description = _blocks(len(json.dumps(_attributes(design, "cpu", size)))) + 16 * _BLOCK
    return units * per_unit + inputs + description


def check_new(path: Path, design: Design, size: int) -> None:
    """Raise InputError unless a store can be created: a usable folder, with space on its disk."""
    if path.exists() and not path.is_dir():
        raise InputError(
            "out", f"is {printed(path)}, which is a file", "name a folder for the store"
        )
    # The metadata exists if another process has just created the store.
    known = (*_ARRAYS, METADATA)
    foreign = [
        entry.name
        for entry in (path.iterdir() if path.is_dir() else ())
        if entry.name not in known and not entry.name.startswith(NEW)
    ]
    if foreign:
        raise InputError(
            "out",
            (
                f"is {printed(path)}, which has {printed(sorted(foreign)[0])} and is not a "
                "store of a sweep"
            ),
            "name a new or empty folder",
        )
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.is_dir())
    needed, free = bytes_needed(design, size), shutil.disk_usage(existing).free
    if needed * _DISK_MARGIN > free:
        raise InputError(
            "out",
            (
                f"is {printed(path)}, where the design's {design.runs:,} runs take "
                f"{_size(needed)}, but {_size(free)} are free"
            ),
            "vary less, or use another disk",
        )


def create(path: Path, design: Design, device: str) -> None:
    """Create the store of a design, after `check_new`.

    Several processes may do so at once: each part is renamed into place by the first, and the
    metadata, which makes it a store, comes last.
    """
    try:
        with _new(path, design, device) as new:
            for name in _ARRAYS:
                _move(new / name, path / name)
            _describe(new, path)
            _link(new / METADATA, path / METADATA)
    except Exception as error:
        # Another process has created the store, and removed this partial one.
        if is_store(path):
            return
        if isinstance(error, OSError):
            raise _unwritable(path, error) from None
        raise


def renew(path: Path, design: Design, device: str) -> None:
    """Rewrite the description of a damaged store, and keep its results.

    Raises InputError if the store has no results of this design.
    """
    try:
        with _new(path, design, device) as new:
            if not _is_of(design, device, path, new):
                raise InputError(
                    "out",
                    (
                        f"is {printed(path)}, which is damaged and has no results of this "
                        "design, device and versions"
                    ),
                    "use the original ones, or another folder",
                )
            for name in _description(new):
                (path / name).parent.mkdir(parents=True, exist_ok=True)
                os.replace(new / name, path / name)
            _describe(new, path)
            os.replace(new / METADATA, path / METADATA)
    except OSError as error:
        raise _unwritable(path, error) from None


def _is_of(design: Design, device: str, path: Path, new: Path) -> bool:
    """Return whether any unit at a path has the checksum that it would have in the new store."""
    size = unit_size(design, device)
    store = Store(path, design, kind_of(device), size, _attributes(design, device, size))
    done = [int(unit) for unit in np.flatnonzero(store.done())]
    if not done:
        return _same(new / "results" / METADATA, path / "results" / METADATA)
    return any(store.read(unit) is not None for unit in done)


@contextmanager
def _new(path: Path, design: Design, device: str) -> Iterator[Path]:
    """Yield a store without results, in its own folder beside the parts of the one at `path`."""
    new = path / f"{NEW}{uuid.uuid4().hex}"
    try:
        new.mkdir(parents=True)
        _fill(new, design, device, unit_size(design, device))
        yield new
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _fill(new: Path, design: Design, device: str, size: int) -> None:
    """Create the arrays and attributes of a store."""
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
        dtype="uint64",
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
                config={"write_empty_chunks": True},
            )
            made[...] = values
    group.attrs.update(_attributes(design, device, size))


def _attributes(design: Design, device: str, size: int) -> dict[str, Any]:
    """Return the attributes of a store."""
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
        "labels": {name: labels.tolist() for name, labels in design.labels.items()},
        "models": list(design.models),
        "quantities": list(quantities(design)),
        "seed": design.base.seed,
        "unit_size": size,
        "device": kind_of(device),
        "machine": machine(),
        "versions": versions(),
    }


def _is_array(variable: Variable) -> bool:
    """Return whether a variable is stored as an array; texts and constants are attributes."""
    return bool(variable.dims) and variable.values.dtype.kind in "bf"


def _describe(new: Path, path: Path) -> None:
    """Add the checksums of the files at `path` to the metadata of the new store."""
    group = json.loads((new / METADATA).read_bytes())
    content = json.dumps(sealed(group, path, _description(path)), indent=2)
    (new / METADATA).write_text(content, encoding="utf-8")


def _move(source: Path, target: Path) -> None:
    """Rename, unless another process has created the same."""
    if not target.exists():
        try:
            os.rename(source, target)
            return
        except OSError:
            if not target.exists():
                raise
    # Another process may already be writing results there.
    names = {name for name in _description(source.parent) if name.startswith(f"{source.name}/")}
    if not all(_same(source.parent / name, target.parent / name) for name in names):
        raise InputError(
            "out",
            f"is {printed(target.parent)}, which has an unfinished store of another sweep",
            "remove it if nothing is writing there, or name another folder",
        )


def _link(source: Path, target: Path) -> None:
    """Put a file into place, unless one exists."""
    try:
        os.link(source, target)
    except FileExistsError:
        pass
    except OSError:
        # Not every file system supports links.
        if not target.exists():
            os.rename(source, target)


def _description(folder: Path) -> list[str]:
    """Return the paths of the files that describe a store, without its own metadata."""
    files = (path for path in (folder / "design").rglob("*") if path.is_file())
    names = {path.relative_to(folder).as_posix() for path in files}
    return sorted({f"results/{METADATA}", f"done/{METADATA}"} | names)


def _same(one: Path, other: Path) -> bool:
    """Return whether two files have the same content."""
    return other.is_file() and one.read_bytes() == other.read_bytes()


def _unwritable(path: Path, error: OSError) -> InputError:
    """Return an InputError for a folder that cannot be written to."""
    return InputError(
        "out",
        f"is {printed(path)}, which cannot be written to ({reason(error)})",
        "name another folder",
    )


def _blocks(count: int) -> int:
    """Return the disk space of a file of `count` bytes."""
    return -(-count // _BLOCK) * _BLOCK


def _size(count: float) -> str:
    """Return a number of bytes as text."""
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if count < 1000.0:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.3g} PB"
