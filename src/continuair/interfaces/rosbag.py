"""Flights in ROS 2 bags, with poses in world axes, z up, and bodies forward, left, up (REP 103)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.errors import InputError, shortened, shown
from continuair.files import printed, reason, user_path
from continuair.identification.recording import Recording
from continuair.interfaces.log_recording import check_roles, choices, recording
from continuair.interfaces.log_signals import Signal, check_unit, signal
from continuair.interfaces.log_topics import Topic, missing_topic, of_log, parse_topics
from continuair.typing import ArrayLike
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_WORLD = {"map", "odom", "world", "earth"}
"""Frames that REP 105 fixes to the ground."""

_LONGEST_REASON = 300

_IMU, _ODOMETRY = "sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"
_TWISTS = {
    "geometry_msgs/msg/Twist": "linear",
    "geometry_msgs/msg/TwistStamped": "twist.linear",
    "geometry_msgs/msg/TwistWithCovarianceStamped": "twist.twist.linear",
}
"""Type -> its velocity."""


@dataclass(frozen=True)
class _Messages:
    """A topic's messages, and their times (n,) [s] since the bag's start."""

    topic: Topic
    time: Array
    messages: list[Any]

    def rows(self, of: Callable[[Any], Any]) -> Array:
        """Return a function's values for each message (n, width), or raise InputError."""
        rows = [of(each) for each in self.messages]
        try:
            found = np.array(rows, float)
        except ValueError:  # lists of unequal lengths
            found = np.empty(0)
        if found.ndim != 2 or not found.size:
            raise InputError(
                f"topic {self.topic}",
                "has messages that hold none, or changing numbers of values",
                "publish the same ones each time",
            )
        return found


def read_rosbag(
    path: str | os.PathLike[str],
    vehicle: Vehicle,
    topics: Mapping[str, str],
    *,
    rate: float | None = None,
    window: tuple[float, float] | None = None,
    imu_position: ArrayLike = (0.0, 0.0, 0.0),
    thrust_curve: ArrayLike | str | os.PathLike[str] | None = None,
) -> Recording:
    """Read a flight from a ROS 2 bag, for `continuair.identification.fit`.

    Parameters
    ----------
    path : str or path-like
        Folder of the bag, or its .mcap or .db3 file.
    vehicle : Vehicle
        The vehicle that flew.
    topics : mapping of str to str
        "TOPIC:FIELD,FIELD*NUMBER" by role, see Notes.
    rate : float, optional
        Rate of the rows [Hz]. Default: that of the slowest measurement.
    window : tuple of float, optional
        Start and end since the bag's start [s]. Default: all.
    imu_position : array_like, shape (3,), optional
        Position of the accelerometer from the UAV's centre of mass, body axes [m].
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
        If the bag cannot be read, or a topic is missing or unsuitable.

    Notes
    -----
    Roles: ``pose`` of the UAV; at least one of ``bend`` [1/m], ``tip`` and ``camera``, poses in the
    same world axes; ``wrench`` on the UAV, body axes; ``bend_moment`` [N m²]; and ``rotors``,
    thrusts in the vehicle's order [N], or ``motors``, their signals, of which the thrust curve
    makes thrusts. Only bend, bend_moment, rotors and motors take fields. Optional:
    ``velocity`` in world axes [m/s]; ``gyro`` [rad/s] and ``accelerometer`` [m/s²] of an Imu along
    the body axes.

    Types: PoseStamped, PoseWithCovarianceStamped, TransformStamped, Odometry (and PointStamped for
    tip), WrenchStamped, Float64MultiArray, and JointState, with position as bend, effort as
    bend_moment and rotors, and velocity as motors; for velocity Odometry, whose twist is in body
    axes, Twist, TwistStamped and TwistWithCovarianceStamped in world axes.
    """
    named = parse_topics(topics, _ROLES)
    chosen = choices(rate, window, imu_position, thrust_curve)
    checks.installed("rosbags", "logs")
    file = user_path("data", path)
    with of_log(printed(file)):
        if "pose" not in named:
            raise InputError("topics", "names none for the UAV's pose", "name one for pose")
        _check_fields(named.values())
        check_roles(vehicle, {part for role in named for part in _PARTS.get(role, (role,))})
        found: dict[str, Signal] = {}
        for role, messages in _read(file, named).items():
            found |= _ROLES[role](messages, vehicle)
        return recording(printed(file.name), vehicle, found, chosen)


def _check_fields(topics: Iterable[Topic]) -> None:
    """Raise InputError for fields of a role whose message types define them."""
    for topic in topics:
        if topic.fields and topic.role not in _NUMBERS:
            raise InputError(
                str(topic),
                f"takes no fields, but {','.join(topic.fields)} are named",
                "leave them out, as its message type defines them, and convert other axes before",
            )


def _read(file: Path, named: Mapping[str, Topic]) -> dict[str, _Messages]:
    """Return messages of its topic by role; raises InputError."""
    from continuair.interfaces.bag import opened

    try:
        file.stat()
        with opened(file) as bag:
            for topic in named.values():
                if topic.name not in bag.kinds:
                    listed = [f"{name} ({kind})" for name, kind in bag.kinds.items()]
                    raise missing_topic(topic, listed)
            return {role: _messages(bag, topic) for role, topic in named.items()}
    except InputError:
        raise
    except (OSError, ValueError) as error:
        why = reason(error)
    except Exception as error:  # whatever its readers raise of damaged files
        why = " ".join(f"{type(error).__name__} {error}".split())
    raise InputError(
        "data",
        f"is no ROS 2 bag that can be read ({shortened(why, _LONGEST_REASON)})",
        "give a bag's folder, or a whole .mcap or .db3 file",
    )


def _messages(bag: Any, topic: Topic) -> _Messages:
    stamps, messages = [], []
    for received, message in bag.messages(topic.name):
        header = getattr(message, "header", None)
        stamp = header.stamp.sec * 10**9 + header.stamp.nanosec if header else 0
        stamps.append((stamp or received) - bag.start)
        messages.append(message)
    return _Messages(topic, 1e-9 * np.array(stamps, float), messages)


def _refused(topic: Topic, message: Any, wanted: str) -> InputError:
    kind = getattr(message, "__msgtype__", type(message).__name__)
    return InputError(str(topic), f"holds messages of {printed(kind)}", f"give a topic of {wanted}")


def _place(topic: Topic, message: Any) -> Any:
    """Return the part of a message with position and orientation, or raise InputError."""
    for path in ("transform", "pose.pose", "pose"):
        found = message
        for name in path.split("."):
            found = getattr(found, name, None)
        if hasattr(found, "orientation") or hasattr(found, "rotation"):
            return found
    raise _refused(topic, message, "PoseStamped, TransformStamped or Odometry")


def _xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


def _position(place: Any) -> list[float]:
    return _xyz(getattr(place, "position", None) or place.translation)


def _quaternion(place: Any) -> list[float]:
    turn = getattr(place, "orientation", None) or place.rotation
    return [*_xyz(turn), turn.w]


def _scaled(topic: Topic, time: Array, values: Array) -> Signal:
    return signal(topic, time, topic.scaled(values))


def _pose(found: _Messages, _: Vehicle) -> dict[str, Signal]:
    topic = found.topic
    position = found.rows(lambda each: _position(_place(topic, each)))
    attitude = found.rows(lambda each: _quaternion(_place(topic, each)))
    return {
        "position": _scaled(topic, found.time, position),
        "attitude": _scaled(topic, found.time, attitude),
    }


def _tip(found: _Messages, _: Vehicle) -> dict[str, Signal]:
    def position(message: Any) -> list[float]:
        point = getattr(message, "point", None)
        return _xyz(point) if point else _position(_place(found.topic, message))

    return {"tip": _scaled(found.topic, found.time, found.rows(position))}


def _camera(found: _Messages, vehicle: Vehicle) -> dict[str, Signal]:
    """Return the tip's pose from that of the camera on it."""
    pose, camera = _pose(found, vehicle), vehicle.camera
    place, attitude = pose["position"], pose["attitude"]
    check_unit(attitude)
    turn = Rotation.from_quat(attitude.values) * Rotation.from_quat(camera.attitude).inv()
    return {"tip": replace(place, values=place.values - turn.apply(camera.position))}


def _of_body(frame: str) -> bool:
    """Whether a frame may be the body's, forward-left-up, as names go in ROS (REP 103, REP 147)."""
    name = frame.strip("/").rpartition("/")[2]
    return name.partition("_")[0] not in _WORLD and not name.endswith(("_ned", "_frd"))


def _of_world(frame: str) -> bool:
    """Whether a frame may be fixed to the ground, with z up; one without a name may."""
    name = frame.strip("/").rpartition("/")[2]
    return not name or (name.partition("_")[0] in _WORLD and not name.endswith(("_ned", "_frd")))


def _check_body_axes(topic: Topic, message: Any, what: str) -> None:
    """Raise InputError for a message in other axes than the body's."""
    if not _of_body(message.header.frame_id):
        raise InputError(
            str(topic),
            f"is in axes of {shown(message.header.frame_id)}",
            f"publish {what} in its body axes, forward-left-up, such as base_link",
        )


def _of_imu(attribute: str) -> Callable[[_Messages, Vehicle], dict[str, Signal]]:
    """Return a role of one of the vectors of an Imu."""

    def signals(found: _Messages, _: Vehicle) -> dict[str, Signal]:
        topic = found.topic
        for each in found.messages:
            if getattr(each, "__msgtype__", None) != _IMU:
                raise _refused(topic, each, "Imu")
            _check_body_axes(topic, each, "the UAV's sensors")
            # So REP 145 marks what a sensor does not measure.
            if getattr(each, f"{attribute}_covariance")[0] == -1.0:
                raise InputError(
                    str(topic), f"does not measure {attribute}", "name a topic that does"
                )
        rows = found.rows(lambda each: _xyz(getattr(each, attribute)))
        return {topic.role: _scaled(topic, found.time, rows)}

    return signals


def _velocity(found: _Messages, _: Vehicle) -> dict[str, Signal]:
    """Return the velocity in world axes, of an Odometry that in the axes of its child frame."""
    topic, kinds = found.topic, {getattr(e, "__msgtype__", None) for e in found.messages}
    if kinds == {_ODOMETRY}:
        return {"velocity": _of_odometry(found)}
    for each in found.messages:
        path = _TWISTS.get(getattr(each, "__msgtype__", ""))
        if path is None:
            raise _refused(topic, each, "Odometry, Twist or TwistStamped")
        header = getattr(each, "header", None)
        if header and not _of_world(header.frame_id):
            raise InputError(
                str(topic),
                f"is in axes of {shown(header.frame_id)}",
                "publish the velocity in world axes, such as odom, or name an Odometry",
            )
    rows = found.rows(lambda each: _xyz(attrgetter(_TWISTS[each.__msgtype__])(each)))
    return {"velocity": _scaled(topic, found.time, rows)}


def _of_odometry(found: _Messages) -> Signal:
    """Return the velocities of an Odometry in world axes."""
    topic, frames = found.topic, {each.child_frame_id for each in found.messages}
    rows = found.rows(lambda each: [*_xyz(each.twist.twist.linear), *_quaternion(each.pose.pose)])
    velocity = _scaled(topic, found.time, rows[:, :3])
    if all(frame and _of_world(frame) for frame in frames):
        return velocity
    if not all(map(_of_body, frames)):
        raise InputError(
            str(topic),
            f"is in axes of {shown(min(frames))}",
            "publish its twist in axes of one child frame, forward-left-up, such as base_link",
        )
    attitude = signal(topic, found.time, rows[:, 3:])
    check_unit(attitude)
    return replace(velocity, values=Rotation.from_quat(attitude.values).apply(velocity.values))


def _wrench(found: _Messages, _: Vehicle) -> dict[str, Signal]:
    for each in found.messages:
        if not hasattr(each, "wrench"):
            raise _refused(found.topic, each, "WrenchStamped")
        _check_body_axes(found.topic, each, "the wrench on the UAV")
    force = found.rows(lambda each: _xyz(each.wrench.force))
    torque = found.rows(lambda each: _xyz(each.wrench.torque))
    return {
        "thrust": _scaled(found.topic, found.time, force),
        "torque": _scaled(found.topic, found.time, torque),
    }


def _numbers(attribute: str) -> Callable[[_Messages, Vehicle], dict[str, Signal]]:
    """Return a role of numbers: data of an array, or an attribute of joints."""

    def signals(found: _Messages, _: Vehicle) -> dict[str, Signal]:
        topic = found.topic
        first = _by_name(topic, found.messages[0], attribute) if found.messages else {}
        names = topic.fields or tuple(first)
        rows = found.rows(lambda each: _taken(topic, _by_name(topic, each, attribute), names))
        return {topic.role: _scaled(topic, found.time, rows)}

    return signals


def _by_name(topic: Topic, message: Any, attribute: str) -> dict[str, float]:
    """Return the numbers of a message, by names of joints or by places; or InputError."""
    values = getattr(message, "data", getattr(message, attribute, None))
    if not isinstance(values, np.ndarray):
        raise _refused(topic, message, "Float64MultiArray or JointState")
    names = getattr(message, "name", None) or [str(place) for place in range(len(values))]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(
            str(topic), f"names {printed(twice)} twice in one message", "publish every joint once"
        )
    if len(names) != len(values):
        raise InputError(
            str(topic),
            (
                f"names {len(names)} joints in one message, whose {attribute} holds "
                f"{len(values)} numbers"
            ),
            "publish one for each",
        )
    return dict(zip(names, values.tolist(), strict=True))


def _taken(topic: Topic, numbers: Mapping[str, float], names: Sequence[str]) -> list[float]:
    """Return numbers of these names, or InputError; without fields no message may hold others."""
    missing = [name for name in names if name not in numbers]
    if missing:
        raise InputError(
            str(topic),
            f"has no {missing[0]} in one of its messages",
            f"name some of {shortened(', '.join(numbers), _LONGEST_REASON)}",
        )
    if not topic.fields and len(numbers) > len(names):
        raise InputError(
            str(topic),
            f"holds {len(numbers)} numbers in one message, but {len(names)} in its first",
            (
                "name fields that all have, as in "
                f"{topic.role}={topic.name}:{shortened(','.join(names), _LONGEST_REASON)}"
            ),
        )
    return [numbers[name] for name in names]


_NUMBERS = {"bend": "position", "bend_moment": "effort", "rotors": "effort", "motors": "velocity"}
"""Role of numbers -> the attribute that holds them of joints."""

_ROLES = {
    "pose": _pose,
    "tip": _tip,
    "camera": _camera,
    "wrench": _wrench,
    "velocity": _velocity,
    "gyro": _of_imu("angular_velocity"),
    "accelerometer": _of_imu("linear_acceleration"),
} | {role: _numbers(attribute) for role, attribute in _NUMBERS.items()}
_PARTS = {"pose": ("position", "attitude"), "wrench": ("thrust", "torque")}
