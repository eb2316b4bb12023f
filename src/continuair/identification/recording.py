"""Recorded flights: CSV files of time, pose and bend, and of the inputs held from row to row.

Logs are read by `continuair.interfaces`.
"""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from continuair import checks
from continuair.errors import InputError, shortened, shown
from continuair.files import check_regular, printed, reason, user_path
from continuair.vehicle.layout import ACTUATORS, numbered
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import warn

Array = np.ndarray

MEASURED = ("time", "x", "y", "z", "qx", "qy", "qz", "qw", "bend_x", "bend_y")
"""Columns that every file has: time [s]; position of the UAV's centre of mass, world axes [m];
attitude, body to world, unit quaternion; bend vector κ (cos ψa, sin ψa), body axes [1/m]. Those of
inputs are named as ACTUATORS: 0 where there is none, each held until the next row. For a vehicle
with [[arm]] what each section has is numbered: bend_x_1, bend_y_1, bend_x_2, and bend_moment_x_1,
arm by arm from the base out, as the results name its coordinates and actuators."""

_BEND = MEASURED.index("bend_x")
FEWEST_ROWS = 10
_LONGEST_LIST = 200
_UNIT_NORM_TOLERANCE = 0.02


@dataclass(frozen=True)
class Recording:
    """A recorded flight; rows are samples.

    time: from 0 [s] (n,). position (n, 3), attitude (n, 4), bend (n, bends), inputs (n, 6 + bends)
    as in MEASURED and ACTUATORS; inputs is None if the file has no such column. rotor_command:
    thrusts (n, rotors) that the vehicle's rotors are to give [N], held as inputs are, or None: they
    are at rest. sampling: a sentence on how a log became rows, if it did. Raises InputError for
    what is no such table of finite numbers.
    """

    name: str
    time: Array
    position: Array
    attitude: Array
    bend: Array
    inputs: Array | None
    rotor_command: Array | None = None
    sampling: str = ""

    def __post_init__(self) -> None:
        bends = np.shape(self.bend)[1] if np.ndim(self.bend) == 2 else 0
        widths = {"position": 3, "attitude": 4, "bend": bends, "inputs": 6 + bends}
        for name in ("time", *widths, "rotor_command"):
            value = getattr(self, name)
            if value is not None or name not in ("inputs", "rotor_command"):
                object.__setattr__(self, name, self._table(name, value, widths.get(name)))
        if self.time[0] != 0.0 or not (np.diff(self.time) > 0.0).all():
            raise InputError(
                f"time of the recording is {shown(self.time.tolist())}; give times [s] that begin "
                "with 0 and increase."
            )
        off = np.abs(np.linalg.norm(self.attitude, axis=1) - 1.0)
        if off.max() > _UNIT_NORM_TOLERANCE:
            raise InputError(
                f"attitude of the recording is off a unit quaternion by {off.max():.2g} in row "
                f"{int(off.argmax())}; give unit quaternions x y z w."
            )

    def _table(self, name: str, value: object, width: int | None) -> Array:
        """A field as finite numbers, a row for each time."""
        found, rows = checks.finite_array(value), np.shape(self.time)[:1]
        expected = 1 if name == "time" else 2
        if found is None or found.ndim != expected or found.shape[:1] != rows or not len(found):
            raise InputError(
                f"{name} of the recording is {shown(value)}; give finite numbers, a row for each "
                "time."
            )
        if expected == 2 and width is not None and found.shape[1] != width:
            raise InputError(f"{name} of the recording has {found.shape[1]} columns; give {width}.")
        return found


@dataclass(frozen=True)
class _Names:
    """Names of columns: those that a file must have, and those of inputs and of rotors' thrusts,
    which it may have."""

    measured: tuple[str, ...]
    inputs: tuple[str, ...]
    rotors: tuple[str, ...]

    @property
    def acting(self) -> tuple[str, ...]:
        """Those that a file may have."""
        return self.inputs + self.rotors

    @property
    def bend(self) -> tuple[str, ...]:
        """The last of the measured ones."""
        return self.measured[_BEND:]


def _names_for(vehicle: Vehicle | None) -> _Names:
    sections = vehicle.sections if vehicle is not None and vehicle.has_arm_list else None
    rotors = vehicle.uav.rotors if vehicle is not None else None
    return _Names(
        MEASURED[:_BEND] + numbered(MEASURED[_BEND:], sections),
        ACTUATORS[:6] + numbered(ACTUATORS[6:], sections),
        numbered(["rotor_command"], rotors.count) if rotors else (),
    )


def load_recording(path: str | os.PathLike[str], vehicle: Vehicle | None = None) -> Recording:
    """Read a recorded flight from a CSV file with a line of headings, MEASURED and ACTUATORS.

    vehicle: whose flight it is, needed for [[arm]], and for the thrusts of rotors, rotor_command_1
    and so on [N]. Other columns are ignored with a warning. Raises InputError, naming column and
    row (the first below the headings is row 1), for what is missing, no finite number, no unit
    quaternion, or not later than the row before.
    """
    file, names = user_path("data", path), _names_for(vehicle)
    path = printed(file)
    headings, rows = _read(file, names)
    columns = _columns(path, headings, rows, names)
    time = columns["time"]
    late = np.flatnonzero(np.diff(time) <= 0.0)
    if late.size:
        row = late[0] + 1
        raise InputError(
            f"{path}: time is {time[row]:g} in row {row + 1}, not after the {time[row - 1]:g} of "
            "the row before; sort the rows by time and leave out repeated ones."
        )
    # Beside a start that is far off, steps between rows are lost to rounding.
    since = time - time[0]
    if not (np.diff(since) > 0.0).all():
        raise InputError(
            f"{path}: time runs from {time[0]:g} to {time[-1]:g}, which float64 cannot hold in "
            "steps as small as these; count the time from the start of the flight."
        )
    attitude = np.stack([columns[name] for name in ("qx", "qy", "qz", "qw")], -1)
    norm = np.linalg.norm(attitude, axis=1)
    wrong = np.flatnonzero(np.abs(norm - 1.0) > _UNIT_NORM_TOLERANCE)
    if wrong.size:
        row = wrong[0]
        raise InputError(
            f"{path}: qx qy qz qw have norm {norm[row]:.4g} in row {row + 1}; give unit "
            "quaternions, the scalar part last."
        )
    driven = any(name in columns for name in names.acting)
    nothing = np.zeros(len(time))
    return Recording(
        name=file.name,
        time=since,
        position=np.stack([columns[name] for name in "xyz"], -1),
        attitude=attitude / norm[:, None],
        bend=np.array([columns[name] for name in names.bend]).T.reshape(len(time), len(names.bend)),
        inputs=np.stack([columns.get(each, nothing) for each in names.inputs], -1)
        if driven
        else None,
        rotor_command=_rotor_command(path, columns, names.rotors),
    )


def _rotor_command(path: str, columns: dict[str, Array], names: tuple[str, ...]) -> Array | None:
    """Thrusts (n, rotors) of all rotors or of none, or InputError."""
    missing = [name for name in names if name not in columns]
    if len(missing) == len(names):
        return None
    if missing:
        raise InputError(f"{path}: column {missing[0]} is missing; give all of {', '.join(names)}.")
    return np.stack([columns[name] for name in names], -1)


def _read(file: Path, names: _Names) -> tuple[list[str], list[list[str]]]:
    path, line = printed(file), 0
    check_regular("data", file)
    try:
        with open(file, encoding="utf-8-sig", newline="") as text:
            # Without `strict`, a quotation mark that is never closed swallows what follows.
            reader, lines = csv.reader(text, strict=True), []
            for cells in reader:
                line = reader.line_num
                if any(cell.strip() for cell in cells):
                    lines.append(cells)
    except csv.Error as error:
        raise InputError(
            f"{path}: not valid CSV after line {line} ({error}); close the quotation marks there."
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(
            f"data is {path}, which cannot be read ({reason(error)}); give the path of a CSV file."
        ) from None
    headings = [cell.strip() for cell in lines[0]] if lines else []
    for name in names.measured:
        if name not in headings:
            found = _listed(headings) if headings else "the file is empty"
            raise InputError(
                f"{path}: column {name} is missing; name the columns "
                f"{', '.join(names.measured)} "
                f"(found: {found})."
            )
    for name in names.measured + names.acting:
        if headings.count(name) > 1:
            raise InputError(f"{path}: column {name} is there twice; keep one of them.")
    if len(lines) - 1 < FEWEST_ROWS:
        raise InputError(
            f"{path}: holds {len(lines) - 1} rows; give a flight of {FEWEST_ROWS} rows or more."
        )
    return headings, lines[1:]


def _listed(headings: list[str]) -> str:
    """Headings as a message prints them, on one line and not too long."""
    return shortened(" ".join(", ".join(headings).split()), _LONGEST_LIST)


def _columns(
    path: str, headings: list[str], rows: list[list[str]], names: _Names
) -> dict[str, Array]:
    ignored = [name for name in headings if name not in names.measured + names.acting]
    if ignored:
        known = ", ".join(names.acting)
        warn(
            f"{path}: ignores the columns {_listed(ignored)} (inputs are {known}).",
            stacklevel=3,
        )
    used = {name: headings.index(name) for name in headings if name not in ignored}
    columns = {name: np.empty(len(rows)) for name in used}
    for row, cells in enumerate(rows):
        for name, index in used.items():
            text = cells[index].strip() if index < len(cells) else ""
            try:
                value = float(text)
            except ValueError:
                value = np.nan
            if not np.isfinite(value):
                raise InputError(
                    f"{path}: {name} is {shown(text)} in row {row + 1}; give a finite number, or "
                    "leave the row out."
                )
            columns[name][row] = value
    return columns
