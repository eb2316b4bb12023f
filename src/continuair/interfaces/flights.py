"""A recorded flight of any format, by its file's name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from continuair.errors import InputError
from continuair.files import printed, user_path
from continuair.identification.recording import Recording, load_recording
from continuair.interfaces.log_topics import split_topics
from continuair.interfaces.rosbag import read_rosbag
from continuair.interfaces.ulog import read_ulog
from continuair.vehicle.vehicle import Vehicle


def read_flight(
    path: Path,
    vehicle: Vehicle,
    topics: Sequence[str],
    rate: float | None,
    window: tuple[float, float] | None,
    imu_position: tuple[float, float, float],
    thrust_curve: Path | None = None,
) -> Recording:
    """Read a .ulg file, a ROS 2 bag (a folder, .mcap or .db3), or else a CSV file.

    topics: texts ROLE=TOPIC, as `read_ulog` and `read_rosbag` take them with rate and window, which
    are of logs alone; imu_position: of the accelerometer [m]; thrust_curve: a CSV file, for motors
    of logs. Raises InputError.
    """
    path = user_path("data", path)
    bag = path.suffix in (".mcap", ".db3") or path.is_dir()
    if bag or path.suffix == ".ulg":
        read = read_rosbag if bag else read_ulog
        named = split_topics(topics)
        return read(path, vehicle, named, rate=rate, window=window, imu_position=imu_position,
                    thrust_curve=thrust_curve)  # fmt: skip
    of_logs = {"topic": topics or None, "rate": rate, "window": window}
    for name, value in (of_logs | {"thrust_curve": thrust_curve}).items():
        if value is not None:
            raise InputError(
                name,
                f"is given, but {printed(path)} is no log",
                "leave it out, or give a .ulg file or a ROS 2 bag",
            )
    return load_recording(path, vehicle, imu_position=imu_position)
