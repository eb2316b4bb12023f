"""Recorded flights: CSV files of time, pose and bend, and of inputs held from row to row.

Logs are read by `continuair.interfaces`.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from continuair import checks
from continuair.errors import InputError, shortened, shown
from continuair.files import printed, user_path
from continuair.flight.labels import columns_of_bends, columns_of_moments
from continuair.identification.csv_rows import rows_of
from continuair.typing import Array, ArrayLike
from continuair.vehicle.layout import ACTUATORS, numbered
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import warn

MEASURED = ("time", "x", "y", "z", "qx", "qy", "qz", "qw", "bend_x", "bend_y")
"""Columns that every file has.

Time [s]; position of the UAV's centre of mass, world axes [m]; attitude, body to world, unit
quaternion; bend vector κ (cos ψa, sin ψa), body axes [1/m]. Columns of inputs are named as
ACTUATORS: 0 if missing, each held until the next row. For a vehicle with [[arm]], columns of
sections are numbered: bend_x_1, bend_y_1, bend_x_2, and bend_moment_x_1, arm by arm from the base
out, as in the names of coordinates and actuators in results. With a section whose strain varies
they are the coordinates of all sections, as in strain_arm.rod.bend_x_0 and
bend_moment_arm.rod.bend_x_0.
"""

SENSORS = {
    "velocity": ("vx", "vy", "vz"),
    "gyro": ("gyro_x", "gyro_y", "gyro_z"),
    "accelerometer": ("accel_x", "accel_y", "accel_z"),
}
"""Optional columns, three of a sensor or none.

Velocity of the UAV's centre of mass, world axes [m/s]; angular velocity [rad/s] and specific force
[m/s²], body axes.
"""

POSE = (("x", "y", "z"), ("qx", "qy", "qz", "qw"))
"""Columns of MEASURED that a file with SENSORS may lack, position or attitude or both."""

_BEND = MEASURED.index("bend_x")
_SENSOR_PREFIXES = ("gyro_", "accel_")
FEWEST_ROWS = 10
_LONGEST_LIST = 200
_UNIT_NORM_TOLERANCE = 0.02


def _not_measured() -> Array:
    """Return a table without columns."""
    return np.empty((0, 0))


def _at_origin() -> Array:
    """Return the position of the UAV's centre of mass, body axes."""
    return np.zeros(3)


@dataclass(frozen=True)
class Recording:
    """A recorded flight; rows are samples.

    Parameters
    ----------
    name : str
        Name, for messages.
    time : ndarray, shape (n,)
        Times from 0 [s].
    position : ndarray, shape (n, 3)
        Position of the UAV's centre of mass in world axes [m]. (n, 0): not measured.
    attitude : ndarray, shape (n, 4)
        Unit quaternions x y z w, body to world. (n, 0): not measured.
    bend : ndarray, shape (n, bends)
        Bend vectors, two numbers per section [1/m]; with a section whose strain varies, the
        coordinates of all sections.
    inputs : ndarray, shape (n, 6 + bends), or None
        Force, moment and bend moments, as ACTUATORS, held from row to row. None: no such column.
    rotor_command : ndarray, shape (n, rotors), optional
        Commanded thrusts of the rotors [N], held as inputs are. Default: rotors at rest.
    sampling : str, optional
        A sentence on how a log was resampled to rows.
    velocity : ndarray, shape (n, 3), optional
        Velocity of the UAV's centre of mass in world axes [m/s]. Default: not measured.
    gyro : ndarray, shape (n, 3), optional
        Angular velocity in body axes, with a constant bias [rad/s]. Default: not measured.
    accelerometer : ndarray, shape (n, 3), optional
        Specific force in body axes, with a constant bias [m/s²]; gravity along z in hover. Default:
        not measured.
    imu_position : ndarray, shape (3,), optional
        Position of the accelerometer from the UAV's centre of mass in body axes [m].
    tendon_command : ndarray, shape (n, tendons), optional
        Commands of the tendons' motors, as in `Scenario` [N, m], held as inputs are. Default: 0.

    Raises
    ------
    InputError
        If a field is not a table of finite numbers, with a row per time.
    """

    name: str
    time: Array
    position: Array
    attitude: Array
    bend: Array
    inputs: Array | None
    rotor_command: Array | None = None
    sampling: str = ""
    velocity: Array = field(default_factory=_not_measured)
    gyro: Array = field(default_factory=_not_measured)
    accelerometer: Array = field(default_factory=_not_measured)
    imu_position: Array = field(default_factory=_at_origin)
    tendon_command: Array | None = None

    def __post_init__(self) -> None:
        bends = np.shape(self.bend)[1] if np.ndim(self.bend) == 2 else 0
        widths = {"bend": bends, "inputs": 6 + bends}
        commands = ("rotor_command", "tendon_command")
        for name in ("time", *widths, *commands):
            value = getattr(self, name)
            if value is not None or name not in ("inputs", *commands):
                object.__setattr__(self, name, self._table(name, value, widths.get(name)))
        for name, width in {"position": 3, "attitude": 4, **dict.fromkeys(SENSORS, 3)}.items():
            value = getattr(self, name)
            empty = np.ndim(value) == 2 and np.shape(value)[1] == 0
            found = np.empty((len(self.time), 0)) if empty else self._table(name, value, width)
            object.__setattr__(self, name, found)
        place = checks.vector("imu_position", self.imu_position, 3)
        object.__setattr__(self, "imu_position", place)
        if self.time[0] != 0.0 or not (np.diff(self.time) > 0.0).all():
            raise InputError(
                "time",
                f"of the recording is {shown(self.time.tolist())}",
                "give times [s] that begin with 0 and increase",
            )
        self._check_attitude()

    def _check_attitude(self) -> None:
        """Raise InputError unless attitudes, if measured, are unit quaternions."""
        off = np.abs(np.linalg.norm(self.attitude, axis=1) - 1.0)
        if self.attitude.size and off.max() > _UNIT_NORM_TOLERANCE:
            raise InputError(
                "attitude",
                (
                    f"of the recording is off a unit quaternion by {off.max():.2g} in row "
                    f"{int(off.argmax())}"
                ),
                "give unit quaternions x y z w",
            )

    def _table(self, name: str, value: object, width: int | None) -> Array:
        """Return a field as finite numbers, a row per time."""
        found, rows = checks.finite_array(value), np.shape(self.time)[:1]
        expected = 1 if name == "time" else 2
        if found is None or found.ndim != expected or found.shape[:1] != rows or not len(found):
            raise InputError(
                name, f"of the recording is {shown(value)}", "give finite numbers, one row per time"
            )
        if expected == 2 and width is not None and found.shape[1] != width:
            raise InputError(
                name, f"of the recording has {found.shape[1]} columns", f"give {width}"
            )
        return found


@dataclass(frozen=True)
class _Names:
    """Names of columns: measured ones, and optional ones of inputs and commands."""

    measured: tuple[str, ...]
    inputs: tuple[str, ...]
    rotors: tuple[str, ...]
    tendons: tuple[str, ...]

    @property
    def acting(self) -> tuple[str, ...]:
        """Optional columns."""
        return self.inputs + self.rotors + self.tendons

    @property
    def known(self) -> tuple[str, ...]:
        """All columns."""
        return self.measured + sum(SENSORS.values(), ()) + self.acting

    def required(self, headings: list[str]) -> tuple[str, ...]:
        """Return the columns that a file with these headings must have."""
        sensed = [each for each in SENSORS.values() if any(name in headings for name in each)]
        free = [each for each in POSE if sensed and not any(name in headings for name in each)]
        lacking = sum(free, ())
        measured = tuple(name for name in self.measured if name not in lacking)
        return measured + sum(sensed, ())

    @property
    def bend(self) -> tuple[str, ...]:
        """Columns of bends, the last of the required ones."""
        return self.measured[_BEND:]


def _names_for(vehicle: Vehicle | None) -> _Names:
    """Return the names of columns for a vehicle."""
    rotors = vehicle.uav.rotors if vehicle is not None else None
    tendons = vehicle.tendons if vehicle is not None else 0
    return _Names(
        MEASURED[:_BEND] + columns_of_bends(vehicle),
        ACTUATORS[:6] + columns_of_moments(vehicle),
        numbered(["rotor_command"], rotors.count) if rotors else (),
        numbered(["tendon_command"], tendons) if tendons else (),
    )


def load_recording(
    path: str | os.PathLike[str],
    vehicle: Vehicle | None = None,
    *,
    imu_position: ArrayLike = (0.0, 0.0, 0.0),
) -> Recording:
    """Read a recorded flight from a CSV file.

    Parameters
    ----------
    path : str or path
        File with a line of headings: `MEASURED`, and optionally `SENSORS` and `ACTUATORS`. Other
        columns are ignored with a warning.
    vehicle : Vehicle, optional
        The vehicle of the flight. Needed for [[arm]], for thrusts of rotors, rotor_command_1 and so
        on [N], and for commands of tendons, tendon_command_1 and so on [N, m].
    imu_position : array_like, shape (3,), optional
        Position of the accelerometer from the UAV's centre of mass, body axes [m].

    Returns
    -------
    Recording
        The flight, with times from 0.

    Raises
    ------
    InputError
        If a column or a number is missing or not finite, a quaternion is not of unit length, or
        times do not increase. Messages name column and row; row 1 is the first below the headings.

    Notes
    -----
    With columns of a sensor, those of position or attitude may be missing.
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
            "time",
            f"is {time[row]:g} in row {row + 1}, not after {time[row - 1]:g} in the row before",
            "sort rows by time, without repetitions",
        ).located(path)
    # Relative to a late start, steps between rows may be lost to rounding.
    since = time - time[0]
    if not (np.diff(since) > 0.0).all():
        raise InputError(
            "time",
            f"runs from {time[0]:g} to {time[-1]:g}, too far for float64 to resolve its steps",
            "count time from the start of the flight",
        ).located(path)
    driven = any(name in columns for name in names.acting)
    nothing = np.zeros(len(time))
    return Recording(
        name=file.name,
        time=since,
        position=_table(columns, POSE[0]),
        attitude=_attitude(path, columns),
        bend=np.array([columns[name] for name in names.bend]).T.reshape(len(time), len(names.bend)),
        inputs=np.stack([columns.get(each, nothing) for each in names.inputs], -1)
        if driven
        else None,
        rotor_command=_commands(path, columns, names.rotors),
        tendon_command=_commands(path, columns, names.tendons),
        imu_position=checks.vector("imu_position", imu_position, 3),
        velocity=_table(columns, SENSORS["velocity"]),
        gyro=_table(columns, SENSORS["gyro"]),
        accelerometer=_table(columns, SENSORS["accelerometer"]),
    )


def _table(columns: dict[str, Array], names: tuple[str, ...]) -> Array:
    """Return columns side by side (n, width), or (n, 0) if the file has none of them."""
    there = [columns[name] for name in names if name in columns]
    return np.array(there).T.reshape(len(columns["time"]), len(there))


def _attitude(path: str, columns: dict[str, Array]) -> Array:
    """Return unit quaternions (n, 4), or (n, 0) if not measured; InputError for another length."""
    attitude = _table(columns, POSE[1])
    if not attitude.size:
        return attitude
    norm = np.linalg.norm(attitude, axis=1)
    wrong = np.flatnonzero(np.abs(norm - 1.0) > _UNIT_NORM_TOLERANCE)
    if wrong.size:
        row = wrong[0]
        raise InputError(
            "qx",
            f"qy qz qw have norm {norm[row]:.4g} in row {row + 1}",
            "give unit quaternions, the scalar part last",
        ).located(path)
    unit: Array = attitude / norm[:, None]
    return unit


def _commands(path: str, columns: dict[str, Array], names: tuple[str, ...]) -> Array | None:
    """Return commands (n, names) of all rotors or tendons, or None; InputError if some miss."""
    missing = [name for name in names if name not in columns]
    if len(missing) == len(names):
        return None
    if missing:
        raise InputError(missing[0], "is missing", f"give all of {', '.join(names)}").located(path)
    return np.stack([columns[name] for name in names], -1)


def _read(file: Path, names: _Names) -> tuple[list[str], list[list[str]]]:
    """Return the headings and rows of a recorded flight, or raise InputError."""
    path, (headings, rows) = printed(file), rows_of("data", file)
    _check_headings(path, headings, names)
    if len(rows) < FEWEST_ROWS:
        raise InputError(
            "recording", f"has {len(rows)} rows", f"give a flight of {FEWEST_ROWS} rows or more"
        ).located(path)
    return headings, rows


def _check_headings(path: str, headings: list[str], names: _Names) -> None:
    """Raise InputError for missing, repeated and misnamed columns."""
    required = names.required(headings)
    for name in required:
        if name not in headings:
            found = _listed(headings) if headings else "the file is empty"
            raise InputError(
                name, "is missing", f"name the columns {', '.join(required)} (found: {found})"
            ).located(path)
    for name in names.known:
        if headings.count(name) > 1:
            raise InputError(name, "is there twice", "keep one").located(path)
    for name in headings:
        # Ignored with a warning, a sensor would be missing from the fit.
        if name.startswith(_SENSOR_PREFIXES) and name not in names.known:
            raise InputError(
                _listed([name]),
                "is no known column",
                f"name the sensors' columns {', '.join(sum(SENSORS.values(), ()))}",
            ).located(path)


def _listed(headings: list[str]) -> str:
    """Return headings on one line of limited length, for messages."""
    return shortened(" ".join(", ".join(headings).split()), _LONGEST_LIST)


def _columns(
    path: str, headings: list[str], rows: list[list[str]], names: _Names
) -> dict[str, Array]:
    """Return the used columns as arrays, or raise InputError for a cell without a finite number."""
    ignored = [name for name in headings if name not in names.known]
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
                    name,
                    f"is {shown(text)} in row {row + 1}",
                    "give a finite number, or remove the row",
                ).located(path)
            columns[name][row] = value
    return columns
