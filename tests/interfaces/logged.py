"""Simulated flights as logs: PX4's ULog, written from its published format, and ROS 2 bags."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from tests.identification.flights import held_inputs, held_scenario, true_vehicle

Array = np.ndarray
Topics = Mapping[str, tuple[Array, Mapping[str, Array]]]
"""Name -> times (n,) [s] and fields (n,) or (n, width), of a log."""

SAMPLE = 0.01
ROTORS = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 14.0],
          "torque_per_thrust": 0.05, "lag": 0.04}  # fmt: skip
BOOT = 3_000_000
"""Of the log's start [µs]."""


def rotorcraft(**changes: float) -> ca.Vehicle:
    return true_vehicle().replace({"uav.rotors": ROTORS | changes})


def pushed(duration: float = 0.5) -> tuple[xr.Dataset, Array]:
    """A flight under forces and moments that are held for each sample, and those (n, 8); its
    attitudes half way to the next sample, too, the last one's as it is."""
    time = SAMPLE * np.arange(round(duration / SAMPLE) + 1)
    inputs = held_inputs(time)
    scenario = held_scenario(time, inputs)
    fine = ca.simulate(true_vehicle(), scenario, sample=0.5 * SAMPLE, method="RK4", step=5e-4)
    attitude = fine["attitude"].to_numpy()
    halfway = ("time", "quaternion"), np.vstack([attitude[1::2], attitude[-1:]])
    return fine.isel(time=slice(None, None, 2)).assign(halfway=halfway), inputs


def flown(
    vehicle: ca.Vehicle, duration: float = 0.5, sample: float = SAMPLE
) -> tuple[xr.Dataset, Array]:
    """A flight of a quadrotor under thrusts held for 10 ms each, and those (n, 4)."""
    time = SAMPLE * np.arange(round(duration / SAMPLE) + 1)
    hover = 9.81 * float(vehicle.mass) / 4.0
    phases = np.array([0.0, 1.0, 2.5, 4.0])
    thrusts = hover + 1.5 * np.sin(9.0 * time[:, None] + phases)

    def held(t: float) -> Array:
        return np.asarray(thrusts[int(np.searchsorted(time, t, side="right")) - 1])

    q = (0.3, -0.2, 5.0, 0.05, -0.04, 0.2, 0.8, 0.5)
    scenario = ca.Scenario(
        "flown", q, rotor_command=held, jumps=tuple(time[1:-1]), duration=duration
    )
    return ca.simulate(vehicle, scenario, sample=sample, method="RK4", step=5e-4), thrusts


def to_ned(vectors: Array) -> Array:
    """North, west, up to north, east, down."""
    return np.stack([vectors[:, 0], -vectors[:, 1], -vectors[:, 2]], -1)


def to_frd(vectors: Array) -> Array:
    return np.stack([vectors[:, 0], -vectors[:, 1], -vectors[:, 2]], -1)


def to_px4(attitude: Array) -> Array:
    """FRD to NED, scalar first, from the images of the axes."""
    turned = Rotation.from_quat(attitude)
    columns = [to_ned(turned.apply(axis)) for axis in ([1, 0, 0], [0, -1, 0], [0, 0, -1])]
    return np.asarray(Rotation.from_matrix(np.stack(columns, -1)).as_quat(scalar_first=True))


def px4_estimates(found: xr.Dataset) -> dict[str, tuple[Array, Mapping[str, Array]]]:
    """What PX4 logs of pose, and the bend as a debug message."""
    time, position = found["time"].to_numpy(), to_ned(found["position"].to_numpy())
    place = {**dict(zip("xyz", position.T, strict=True)), "xy_reset_counter": np.zeros(len(time))}
    bend = {"data": found["bend"].to_numpy()}
    attitude = {"q": to_px4(found["attitude"].to_numpy())}
    return {
        "vehicle_local_position": (time, place),
        "vehicle_attitude": (time, attitude),
        "debug_array": (time, bend),
    }


def write_ulog(path: Path, topics: Topics, parameters: Mapping[str, float] | None = None) -> None:
    """Write topics and parameters as float, counters as uint8_t; docs.px4.io, 'ULog file format'.

    Of a name such as "debug_array 1" the number is that of the topic's instance.
    """
    formats, logged, data = b"", b"", []
    for key, value in (parameters or {}).items():
        named = f"float {key}".encode()
        formats += _message("P", struct.pack("<B", len(named)) + named + struct.pack("<f", value))
    for number, (instance, (time, fields)) in enumerate(topics.items()):
        name, _, of = instance.partition(" ")
        columns = {key: np.asarray(each).reshape(len(time), -1) for key, each in fields.items()}
        declared = "".join(
            f"{_kind(key)}{f'[{each.shape[1]}]' if each.shape[1] > 1 else ''} {key};"
            for key, each in columns.items()
        )
        formats += _message("F", f"{name}:uint64_t timestamp;{declared}".encode())
        logged += _message("A", struct.pack("<BH", int(of or 0), number) + name.encode())
        for row, stamp in enumerate((BOOT + np.round(1e6 * time).astype(int)).tolist()):
            values = b"".join(_packed(key, each[row]) for key, each in columns.items())
            data.append((stamp, _message("D", struct.pack("<HQ", number, stamp) + values)))
    data.sort(key=lambda each: each[0])
    header = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", BOOT)
    path.write_bytes(header + formats + logged + b"".join(each for _, each in data))


def _kind(name: str) -> str:
    return "uint8_t" if name.endswith("counter") else "float"


def _packed(name: str, values: Array) -> bytes:
    return struct.pack(f"<{len(values)}{'B' if _kind(name) == 'uint8_t' else 'f'}", *values.astype(
        int if _kind(name) == "uint8_t" else float))  # fmt: skip


def _message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def bag_topics(found: xr.Dataset) -> dict[str, tuple[str, Array, Array]]:
    """Topic -> type, times and rows: pose of the UAV, tip, and the bend."""
    time = found["time"].to_numpy()
    pose, tip = (
        np.hstack([found[f"{of}position"].to_numpy(), found[f"{of}attitude"].to_numpy()])
        for of in ("", "tip_")
    )
    bend = found["bend"].to_numpy()
    return {
        "/uav/pose": ("geometry_msgs/msg/PoseStamped", time, pose),
        "/arm/tip": ("nav_msgs/msg/Odometry", time, tip),
        "/arm/bend": ("std_msgs/msg/Float64MultiArray", time, bend),
    }


def body_wrench(found: xr.Dataset, inputs: Array) -> Array:
    """Force and moment (n, 6) in body axes, whose force turns with the body half way to the next
    row as that of the inputs (n, 8) is in world axes."""
    turns = Rotation.from_quat(found["halfway"].to_numpy())
    return np.hstack([turns.inv().apply(inputs[:, :3]), inputs[:, 3:6]])


def write_bag(
    path: Path,
    topics: Mapping[str, tuple[str, Array, Array]],
    *,
    plugin: str = "MCAP",
    frame: str = "base_link",
    joints: Sequence[str] = ("0123",),
    child: str = "tip",
) -> None:
    """Write topics into a new bag's folder; JointStates are of joints named by a digit each.

    joints: their names in the first message, in the second and so on, and from the front again.
    child: frame of the twist of Odometry messages.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=9, storage_plugin=StoragePlugin[plugin]) as writer:
        for name, (kind, time, rows) in topics.items():
            connection = writer.add_connection(name, kind, typestore=store)
            for t, row, names in zip(time, rows, cycle(joints), strict=False):
                stamp = 10**9 * 1_700_000_000 + round(1e9 * t)
                message = _ros(store.types, kind, stamp, frame, row, names, child)
                writer.write(connection, stamp, store.serialize_cdr(message, kind))


def _ros(types: Any, kind: str, stamp: int, frame: str, row: Array, joints: str, child: str) -> Any:
    def of(name: str, *values: Any) -> Any:
        return types[name](*values)

    vector = "geometry_msgs/msg/Vector3"
    time = of("builtin_interfaces/msg/Time", stamp // 10**9, stamp % 10**9)
    header = of("std_msgs/msg/Header", time, frame)
    match kind.rpartition("/")[2]:
        case "PointStamped":
            return of(kind, header, of("geometry_msgs/msg/Point", *row[:3]))
        case "TransformStamped":
            turn = of("geometry_msgs/msg/Quaternion", *row[3:])
            moved = of("geometry_msgs/msg/Transform", of(vector, *row[:3]), turn)
            return of(kind, header, "uav", moved)
        case "PoseStamped" | "PoseWithCovarianceStamped" | "Odometry":
            place = of("geometry_msgs/msg/Point", *row[:3])
            turn = of("geometry_msgs/msg/Quaternion", *row[3:7])
            pose = of("geometry_msgs/msg/Pose", place, turn)
            if kind.endswith("PoseStamped"):
                return of(kind, header, pose)
            known = of("geometry_msgs/msg/PoseWithCovariance", pose, np.zeros(36))
            if kind.endswith("CovarianceStamped"):
                return of(kind, header, known)
            # Of more than a pose, the velocity in axes of the child frame.
            velocity = of(vector, *np.resize([*row[7:10], 0.0, 0.0, 0.0], 3))
            twist = of("geometry_msgs/msg/Twist", velocity, of(vector, 0.0, 0.0, 0.0))
            moving = of("geometry_msgs/msg/TwistWithCovariance", twist, np.zeros(36))
            return of(kind, header, child, known, moving)
        case "Imu":
            level = of("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
            rates, forces = of(vector, *row[:3]), of(vector, *row[3:6])
            # A seventh number is the first of the covariance of the forces.
            known = np.append(row[6:], np.zeros(9))[:9]
            return of(kind, header, level, np.zeros(9), rates, np.zeros(9), forces, known)
        case "Twist" | "TwistStamped":
            twist = of("geometry_msgs/msg/Twist", of(vector, *row[:3]), of(vector, 0.0, 0.0, 0.0))
            return twist if kind.endswith("Twist") else of(kind, header, twist)
        case "WrenchStamped":
            wrench = of("geometry_msgs/msg/Wrench", of(vector, *row[:3]), of(vector, *row[3:]))
            return of(kind, header, wrench)
        case "JointState":
            return of(kind, header, list(joints[: len(row)]), row, np.empty(0), row)
        case _:
            return of(kind, of("std_msgs/msg/MultiArrayLayout", [], 0), row)
