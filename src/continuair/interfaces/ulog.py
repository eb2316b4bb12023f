"""Flights that PX4 logged, in its ULog format."""

from __future__ import annotations

import contextlib
import io
import os
import struct
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError
from continuair.files import DAMAGE, check_regular, printed, reason, user_path
from continuair.identification.recording import Recording
from continuair.interfaces.bounded import check_ulog
from continuair.interfaces.frames import attitude_from_ned, from_frd, from_ned
from continuair.interfaces.log_motors import px4_signals
from continuair.interfaces.log_recording import check_roles, choices, recording
from continuair.interfaces.log_signals import Signal, signal
from continuair.interfaces.log_topics import Topic, missing_topic, of_log, parse_topics
from continuair.typing import ArrayLike
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import warn

Array = np.ndarray

_PLACE, _XYZ = ("x", "y", "z"), ("xyz[0]", "xyz[1]", "xyz[2]")
_FIELDS: dict[str, tuple[str, ...]] = {
    "position": _PLACE,
    "attitude": ("q[0]", "q[1]", "q[2]", "q[3]"),
    "tip": _PLACE,
    "bend": (),
    "thrust": _XYZ,
    "torque": _XYZ,
    "bend_moment": (),
    "rotors": (),
    "motors": (),
    "velocity": ("vx", "vy", "vz"),
    "gyro": _XYZ,
    "accelerometer": _XYZ,
}
"""Role -> fields of its topic by default."""

_COMBINED = {
    "gyro": ("gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"),
    "accelerometer": (
        "accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"
    ),
}  # fmt: skip
"""Role -> fields of the topic sensor_combined by default."""

_DEFAULT = {"position": "vehicle_local_position", "attitude": "vehicle_attitude"}
_OURS = {
    "position": from_ned,
    "tip": from_ned,
    "attitude": partial(attitude_from_ned, scalar_first=True),
    "thrust": from_frd,
    "torque": from_frd,
    "velocity": from_ned,
    "gyro": from_frd,
    "accelerometer": from_frd,
}
_NORMALISED = {"thrust": "N", "torque": "N m", "rotors": "N"}
_RESETS = ("xy_reset_counter", "z_reset_counter", "quat_reset_counter", "reset_counter")
_VALID = {"xy_valid": 1, "z_valid": 1, "dead_reckoning": 0}
"""Flags of a valid estimate, with their value if it is valid."""

_RESETS_OF_VELOCITY = ("vxy_reset_counter", "vz_reset_counter")
_VALID_VELOCITY = {"v_xy_valid": 1, "v_z_valid": 1}
"""The same of a velocity, which the topic of the position holds."""

_HEADER = 16


def read_ulog(
    path: str | os.PathLike[str],
    vehicle: Vehicle,
    topics: Mapping[str, str],
    *,
    rate: float | None = None,
    window: tuple[float, float] | None = None,
    imu_position: ArrayLike = (0.0, 0.0, 0.0),
    thrust_curve: ArrayLike | str | os.PathLike[str] | None = None,
) -> Recording:
    """Read a flight from a PX4 log, for `continuair.identification.fit`.

    Parameters
    ----------
    path : str or path-like
        The .ulg file.
    vehicle : Vehicle
        The vehicle that flew.
    topics : mapping of str to str
        "TOPIC:FIELD,FIELD*NUMBER" by role, see Notes. "TOPIC.1" is the topic's instance 1
        (``multi_id``). Default: its first instance.
    rate : float, optional
        Rate of the rows [Hz]. Default: that of the slowest measurement.
    window : tuple of float, optional
        Start and end since the log's start [s]. Default: all.
    imu_position : array_like, shape (3,), optional
        Position of the accelerometer from the UAV's centre of mass, body axes with z up [m].
    thrust_curve : array_like, shape (n, 2), or path-like, optional
        Signals of a motor and their thrusts [N], for the role ``motors``; or a CSV file with the
        columns ``signal`` and ``thrust``. Default: the vehicle's ``thrust_model_factor``.

    Returns
    -------
    Recording
        The measurements at equal times.

    Raises
    ------
    InputError
        If the log cannot be read, or a topic is missing or unsuitable.

    Notes
    -----
    Roles: ``bend`` [1/m] or ``tip`` (its position, NED), one of which is required; ``thrust`` and
    ``torque`` on the UAV (FRD), or ``rotors`` (in the vehicle's order), times the value of 1 [N, N
    m]; or ``motors``, normalised, of which PX4's THR_MDL_FAC in the log makes the motors' signals,
    and the thrust curve thrusts; ``bend_moment`` [N m²]; ``position`` (NED) and ``attitude`` (NED,
    FRD), by default PX4's own. Optional: ``velocity`` (NED, vx, vy and vz of
    vehicle_local_position), ``gyro`` [rad/s] (FRD, of vehicle_angular_velocity or sensor_combined)
    and ``accelerometer`` [m/s²] (FRD, of
    vehicle_acceleration or sensor_combined).
    """
    named = parse_topics(topics, _FIELDS, _DEFAULT)
    chosen = choices(rate, window, imu_position, thrust_curve)
    checks.installed("pyulog", "logs")
    file = user_path("data", path)
    with of_log(printed(file)):
        check_roles(vehicle, named)
        for role in _NORMALISED.keys() & named.keys():
            _check_scaled(named[role])
        names = {_instance_of(each)[0] for each in named.values()}
        log = _log(file, names, cut=window is not None)
        found = {role: _signal(file, log, topic, window) for role, topic in named.items()}
        if "motors" in found:
            factor = float(log.initial_parameters.get("THR_MDL_FAC", 0.0))
            found["motors"] = found["motors"].mapped(lambda rows: px4_signals(rows, factor))
        return recording(printed(file.name), vehicle, found, chosen)


def _check_scaled(topic: Topic) -> None:
    if not topic.scale:
        unit = _NORMALISED[topic.role]
        raise InputError(
            str(topic),
            "is normalised",
            f"give the {unit} of 1, as in {topic.role}={topic.name}*NUMBER",
        )


def _log(file: Path, names: set[str] | None, cut: bool) -> Any:
    """A log with topics of these names, or all; raises InputError. cut: whether its end may be."""
    from pyulog import ULog
    from pyulog.exceptions import ULogException

    check_regular("data", file)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InputError(
            "data", f"cannot be read ({reason(error)})", "give a .ulg file of PX4"
        ) from None
    check_ulog(data)
    try:
        # It prints what it finds damaged.
        with contextlib.redirect_stdout(io.StringIO()):
            log = ULog(io.BytesIO(data), None if names is None else sorted(names))
    except (ULogException, *DAMAGE, struct.error, RecursionError, MemoryError) as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            "data", f"is no ULog that can be read ({why})", "give a .ulg file of PX4"
        ) from None
    if log.start_timestamp >= 1 << 63:
        raise InputError("data", f"begins at {log.start_timestamp} µs", "download the log again")
    lasts = 1e-6 * (log.last_timestamp - log.start_timestamp)
    if log.file_corruption:
        raise InputError("data", "holds damaged messages", "download the log again")
    if not cut and not _is_whole(data):
        raise InputError(
            "data",
            f"is cut off after {lasts:.6g} s",
            "download it again, or name a window before that",
        )
    return log


def _is_whole(data: bytes) -> bool:
    """Return whether a log ends with a whole message."""
    at = _HEADER
    while at + 3 <= len(data):
        at += 3 + struct.unpack_from("<H", data, at)[0]
    return at == len(data)


def _signal(file: Path, log: Any, topic: Topic, window: tuple[float, float] | None) -> Signal:
    """A topic's samples in our axes, over the seconds since the log's start; or InputError."""
    data = _instance(file, log, topic)
    fields = topic.fields or _fields_of(topic)
    missing = [name for name in fields if name not in data]
    if missing or not fields:
        what = f"has no field {missing[0]}" if missing else "needs the names of its fields"
        known = ", ".join(name for name in data if not name.startswith("timestamp"))
        raise InputError(
            str(topic), what, f"name some of {known}, as in {topic.role}={topic.name}:FIELD,FIELD"
        )
    if "timestamp" not in data:
        raise InputError(str(topic), "has no timestamp", "download the log again")
    stamps = data.get("timestamp_sample", data["timestamp"])
    stamps = stamps if stamps.all() else data["timestamp"]
    time = 1e-6 * (stamps.astype(np.int64) - log.start_timestamp)
    _check_estimate(topic, time, data, window)
    # The scale is that of the fields as they are named, before axes are turned.
    rows = topic.scaled(np.stack([data[name].astype(float) for name in fields], -1))
    convert = _OURS.get(topic.role, lambda rows: rows)
    return signal(topic, time, _converted(topic, rows, convert))


def _fields_of(topic: Topic) -> tuple[str, ...]:
    """Return the fields of a topic by default."""
    combined = _instance_of(topic)[0] == "sensor_combined"
    return _COMBINED.get(topic.role, ()) if combined else _FIELDS[topic.role]


def _instance_of(topic: Topic) -> tuple[str, int | None]:
    """Return the name of a topic and the instance that it names, if any, as in NAME.1."""
    name, dot, instance = topic.name.rpartition(".")
    asked = dot and instance.isascii() and instance.isdecimal() and len(instance) < 4
    return (name, int(instance)) if asked else (topic.name, None)


def _instance(file: Path, log: Any, topic: Topic) -> Any:
    """Return the data of a topic's instance; raises InputError if there is none.

    Warns if there are several and none is named.
    """
    name, asked = _instance_of(topic)
    found = sorted((e for e in log.data_list if e.name == name), key=lambda each: each.multi_id)
    if not found:
        there = {each.name for each in _log(file, None, cut=True).data_list}
        raise missing_topic(replace(topic, name=name), there)
    numbers = ", ".join(str(each.multi_id) for each in found)
    if asked is not None:
        if taken := [each for each in found if each.multi_id == asked]:
            return taken[0].data
        raise InputError(str(topic), f"has no instance {asked}", f"use one of: {numbers}")
    if found[1:]:
        warn(
            f"{printed(file)}: {topic} has the instances {numbers}; takes {found[0].multi_id}. "
            f"Name another as {topic.role}={name}.{found[1].multi_id}.",
            stacklevel=4,
        )
    return found[0].data


def _converted(topic: Topic, rows: Array, convert: Any) -> Array:
    """Return rows in our axes; values that are not numbers stay so, and are reported if used."""
    width = len(_FIELDS[topic.role])
    if width and rows.shape[1] != width:
        raise InputError(
            str(topic), f"has {rows.shape[1]} fields, but {width} are needed", f"name {width}"
        )
    if topic.role == "attitude":
        # An estimator that has not begun logs zeros.
        rows = np.where(rows.any(axis=1, keepdims=True), rows, np.nan)
    return np.asarray(convert(rows))


def _check_estimate(
    topic: Topic, time: Array, data: Any, window: tuple[float, float] | None
) -> None:
    """Raise InputError if PX4 reset its estimate, or marked it invalid, in a window.

    The samples include one more on either side.
    """
    first, last = window or (-np.inf, np.inf)
    within = (time >= time.max(where=time <= first, initial=-np.inf)) & (
        time <= time.min(where=time >= last, initial=np.inf)
    )
    of_velocity = topic.role == "velocity"
    for name, good in (_VALID_VELOCITY if of_velocity else _VALID).items():
        if name in data and (wrong := np.flatnonzero((data[name] > 0)[within] != good)).size:
            raise InputError(
                str(topic),
                f"is no estimate at {time[within][wrong[0]]:.6f} s ({name} is {1 - good})",
                "choose a window in which it is",
            )
    for name in _RESETS_OF_VELOCITY if of_velocity else _RESETS:
        if name in data and (jumps := np.flatnonzero(np.diff(data[name][within]))).size:
            at = time[within][jumps[0] + 1]
            raise InputError(
                str(topic),
                f"was reset by the estimator at {at:.6f} s ({name})",
                "choose a window without it",
            )
