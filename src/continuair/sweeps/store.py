"""The store of a sweep: a zarr group that can be killed at any moment, and detects damage.

`results` (runs, models, quantities) has one chunk per unit of work. `done` (units,) is 0 until a
unit is done, and then the checksum of that chunk, written after it. Both are written completely and
renamed into place, so that existing files are complete, unless something else has changed them.
"""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import uuid
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.engine.compiling import kind_of
from continuair.errors import InputError, shortened
from continuair.files import DAMAGE, printed, reason
from continuair.memory import check_memory
from continuair.sweeps import checksums
from continuair.sweeps.contained import is_linked, read_within
from continuair.sweeps.description import LARGEST_DESCRIPTION, VERSIONS, design_of, problem_of
from continuair.sweeps.design import Design
from continuair.sweeps.units import quantities
from continuair.typing import Array

FORMAT = 3
"""1 had no checksums; 2, which is read but not resumed, had steps of one length and step_error."""

_READ = (2, FORMAT)

METADATA = "zarr.json"
NEW = ".new-"
_PARTIAL = re.compile(r"\d+\.[0-9a-f]{32}\.partial")
_FOLDERS = ("results/c", "done/c", "design")
_MOST_NAMED = 8
_LONGEST_REASON = 120


class DamagedStore(InputError):
    """The content of a store differs from what was written."""


@dataclass(frozen=True)
class Store:
    """An open store: its design, and the device and unit size that it was created for."""

    path: Path
    design: Design
    device: str
    size: int
    attributes: dict[str, Any]

    @property
    def units(self) -> int:
        """Number of units of work."""
        return -(-self.design.runs // self.size)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Runs, models and quantities of all results."""
        return (
            self.design.runs,
            len(self.attributes["models"]),
            len(self.attributes["quantities"]),
        )

    def runs(self, unit: int) -> NDArray[np.intp]:
        """Return the indices of a unit's runs."""
        return np.arange(unit * self.size, min((unit + 1) * self.size, self.design.runs))

    def is_done(self, unit: int) -> bool:
        """Return whether a unit is done, damaged or not."""
        return os.path.lexists(self._flag(unit))

    def done(self) -> NDArray[np.bool_]:
        """Return which units are done (units,), damaged or not."""
        check_memory({"done": float(self.units)})
        folder = self._flag(0).parent
        names = set(os.listdir(folder)) if folder.is_dir() else set()
        found = np.zeros(self.units, bool)
        units = (int(name) for name in names if name.isdecimal() and str(int(name)) == name)
        found[[unit for unit in units if unit < self.units]] = True
        return found

    def read(self, unit: int) -> Array | None:
        """Return the results of a unit that is done, or None if it is damaged."""
        size = 8 * self.size * self.shape[1] * self.shape[2]
        try:
            flag = read_within(self.path, f"done/c/{unit}", len(checksums.NONE))
            content = read_within(self.path, f"results/c/{unit}/0/0", size)
        except PermissionError as error:
            raise InputError(
                "out",
                f"is {printed(self.path)}, which cannot be read ({reason(error)})",
                "correct its permissions",
            ) from None
        if flag is None or content is None or len(content) != size:
            return None
        if flag != checksums.of_unit(self.attributes, unit, content):
            return None
        block = np.frombuffer(content, "<f8").reshape(self.size, *self.shape[1:])
        return block[: len(self.runs(unit))]

    def damaged(self) -> list[int]:
        """Return the units that are done but damaged."""
        return [unit for unit in self._done_units() if self.read(unit) is None]

    def results(self) -> tuple[Array, int]:
        """Return all results (runs, models, quantities), NaN if not done, and the number of runs
        done.

        Raises DamagedStore, naming the units.
        """
        check_memory({"results": 8.0 * math.prod(self.shape)})
        values = np.full(self.shape, np.nan)
        damaged, done = [], 0
        for unit in self._done_units():
            block, runs = self.read(unit), self.runs(unit)
            if block is None:
                damaged.append(unit)
            else:
                values[runs] = block
                done += len(runs)
        self.refuse(damaged)
        return values, done

    def refuse(self, damaged: list[int]) -> None:
        """Raise DamagedStore if any units are damaged."""
        if not damaged:
            return
        names = ", ".join(map(str, damaged[:_MOST_NAMED]))
        names += f" and {len(damaged) - _MOST_NAMED} more" if len(damaged) > _MOST_NAMED else ""
        raise DamagedStore(
            "out",
            f"is {printed(self.path)}, where results of {_counted(damaged)} {names} "
            f"(of {self.units}, from 0) are damaged",
            "recompute them with --repair or repair=True",
        )

    def write(self, unit: int, block: Array) -> None:
        """Store the results of a unit, its flag last; InputError if the disk is full."""
        chunk = np.full((self.size, *self.shape[1:]), np.nan, "<f8")
        chunk[: len(block)] = block
        content = chunk.tobytes()
        if is_linked(self.path, f"results/c/{unit}/0/0"):
            _remove(self._chunk(unit).parents[1])
        try:
            _replace(self._chunk(unit), content)
            _replace(self._flag(unit), checksums.of_unit(self.attributes, unit, content))
        except OSError as error:
            if self.is_done(unit) and self.read(unit) is not None:
                return  # another process has computed the same unit, and cleaned up
            raise InputError(
                "out",
                f"is {printed(self.path)}, which can no longer be written to ({reason(error)})",
                "free space there, and repeat the command to continue",
            ) from None

    def forget(self, units: Iterable[int]) -> None:
        """Remove damaged units, so that they are recomputed."""
        for unit in units:
            # Another process may have recomputed it by now.
            if self.is_done(unit) and self.read(unit) is None:
                # The flag first: a unit without one is not done.
                _remove(self._flag(unit))
                _remove(self._chunk(unit).parents[1])

    def clean(self) -> None:
        """Remove files of killed processes; call it when all units are done."""
        for left in [*self.path.glob(f"{NEW}*"), *self._partial()]:
            _remove(left)

    def _done_units(self) -> list[int]:
        """Return the units that are done."""
        return [int(unit) for unit in np.flatnonzero(self.done())]

    def _partial(self) -> Iterator[Path]:
        """Yield partial files of killed processes."""
        for folder in (self.path / "results" / "c", self.path / "done" / "c"):
            for path in folder.rglob("*.partial"):
                if _PARTIAL.fullmatch(path.name):
                    yield path

    def _chunk(self, unit: int) -> Path:
        """Return the path of a unit's results."""
        return self.path / "results" / "c" / str(unit) / "0" / "0"

    def _flag(self, unit: int) -> Path:
        """Return the path of a unit's flag."""
        return self.path / "done" / "c" / str(unit)


def is_store(path: Path) -> bool:
    """Return whether a path has a store, or another zarr group."""
    return (path / METADATA).is_file()


def open_store(
    path: Path,
    device: str | None = None,
    design: Design | None = None,
    *,
    any_version: bool = False,
) -> Store:
    """Open a store, of a design and for a device if given; raises InputError.

    any_version: accept stores of other versions, which can be read but not continued. Raises
    DamagedStore if the store's description is damaged; units are checked when read.
    """
    if not is_store(path):
        raise InputError(
            "out", f"is {printed(path)}, where there is no store of a sweep", "make one there first"
        )
    attributes = _attributes(path)
    _check_continued(path, attributes, design, device, any_version)
    found = _design_of(path, attributes) if design is None else design
    return Store(path, found, attributes["device"], attributes["unit_size"], attributes)


def _attributes(path: Path) -> dict[str, Any]:
    """Return the attributes of a store of a known format, if undamaged."""
    try:
        group = json.loads(read_within(path, METADATA, LARGEST_DESCRIPTION) or b"")
    except PermissionError as error:
        raise InputError(
            "out",
            f"is {printed(path)}, which cannot be read ({reason(error)})",
            "correct its permissions",
        ) from None
    except (ValueError, RecursionError):
        raise _damaged(path, METADATA) from None
    attributes = group.get("attributes") if isinstance(group, dict) else None
    if not isinstance(attributes, dict) or "continuair_sweep" not in attributes:
        raise DamagedStore(
            "out", f"is {printed(path)}, whose {METADATA} is not of a sweep", "name another folder"
        )
    if attributes["continuair_sweep"] not in _READ:
        raise InputError(
            "out",
            (
                f"is {printed(path)}, made by another version of continuair, with other or "
                "no checksums"
            ),
            "use that version, or name another folder",
        )
    if problem := problem_of(attributes):
        raise _damaged(path, METADATA, problem)
    try:
        damaged = checksums.damaged_files(group, path, METADATA)
    except PermissionError as error:
        raise InputError(
            "out",
            f"is {printed(path)}, which cannot be read ({reason(error)})",
            "correct its permissions",
        ) from None
    damaged += [name for name in _FOLDERS if is_linked(path, name)]
    if damaged:
        raise _damaged(path, damaged[0])
    return attributes


def _damaged(path: Path, name: str, problem: str = "") -> DamagedStore:
    """Return a DamagedStore for a file of the description."""
    found = f" ({problem})" if problem else ""
    return DamagedStore(
        "out",
        f"is {printed(path)}, whose {printed(name)} is damaged{found}",
        "rewrite it with --repair or repair=True, which keeps intact units",
    )


def _check_continued(
    path: Path,
    attributes: dict[str, Any],
    design: Design | None,
    device: str | None,
    any_version: bool,
) -> None:
    """Raise InputError unless a store is of the design, the versions and the device."""
    if design is not None and attributes["continuair_sweep"] != FORMAT:
        raise InputError(
            "out",
            (
                f"is {printed(path)}, a store of an earlier version of continuair, which "
                "only open_sweep reads"
            ),
            "name another folder",
        )
    if design is not None and attributes["design_hash"] != design.digest:
        raise InputError(
            "out",
            (
                f"is {printed(path)}, which has the sweep of another design "
                f"({printed(str(attributes['design']['base'].get('name')))})"
            ),
            "name another folder, or use that design",
        )
    if design is not None and (
        attributes["models"] != list(design.models)
        or attributes["quantities"] != list(quantities(design))
    ):
        raise _damaged(path, METADATA, "models or quantities are not those of the design")
    here, there = versions(), attributes["versions"]
    for name in VERSIONS:
        if there[name] != here[name] and not any_version:
            raise InputError(
                "out",
                f"is {printed(path)}, which {name} {there[name]} began, but here is {here[name]}",
                "install that version, or name another folder",
            )
    if device is not None and attributes["device"] != kind_of(device):
        raise InputError(
            "out",
            (
                f"is {printed(path)}, which was begun with device {attributes['device']}, "
                f"but device is {device}"
            ),
            "use the same, or name another folder",
        )


def _design_of(path: Path, attributes: dict[str, Any]) -> Design:
    """Return the design of a store."""
    try:
        return design_of(path, attributes)
    except DAMAGE as error:
        why = shortened(" ".join(str(error).split()).rstrip("."), _LONGEST_REASON)
        raise _damaged(path, "design", why) from None


def versions() -> dict[str, str]:
    """Return the versions that results depend on."""
    return {name: version(name) for name in VERSIONS}


def _replace(path: Path, content: bytes) -> None:
    """Write a file completely, or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{uuid.uuid4().hex}.partial")
    try:
        partial.write_bytes(content)
        os.replace(partial, path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def _remove(path: Path) -> None:
    """Remove a file or folder, if it exists."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _counted(units: list[int]) -> str:
    """Return "unit" or "units"."""
    return "unit" if len(units) == 1 else "units"
