"""A vehicle is identified from a ROS 2 bag of its flight as from a table of it."""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.identification import Recording, fit, load_recording
from continuair.identification.recording import MEASURED
from continuair.vehicle.layout import ACTUATORS
from continuair.vehicle.vehicle_file import write_vehicle
from tests.identification.flights import true_vehicle, write
from tests.interfaces.logged import (
    bag_topics,
    body_wrench,
    flown,
    pushed,
    rotorcraft,
    write_bag,
)
from tests.refusals import refused

pytest.importorskip("rosbags")

FIELDS = ("uav.mass", "arm.youngs_modulus")
START = true_vehicle().replace({"uav.mass": 2.0, "arm.youngs_modulus": 60e9})
FLOWN, INPUTS = pushed()
TIME = FLOWN["time"].to_numpy()
TOPICS = {
    **bag_topics(FLOWN),
    "/uav/wrench": ("geometry_msgs/msg/WrenchStamped", TIME, body_wrench(FLOWN, INPUTS)),
    "/arm/moment": ("sensor_msgs/msg/JointState", TIME, INPUTS[:, 6:]),
}
NAMED = {"pose": "/uav/pose", "wrench": "/uav/wrench", "bend_moment": "/arm/moment"}


@pytest.fixture(autouse=True)
def own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def read(
    named: dict[str, str], topics: Any = TOPICS, vehicle: ca.Vehicle = START, **how: Any
) -> Recording:
    write_bag(Path("flight"), topics, **how)
    return ca.read_rosbag("flight", vehicle, named)


@pytest.mark.long
@pytest.mark.parametrize(
    ("named", "plugin"),
    [({"bend": "/arm/bend"}, "MCAP"), ({"tip": "/arm/tip"}, "SQLITE3")],
)
def test_a_bag_gives_the_answer_of_a_table(named: dict[str, str], plugin: str) -> None:
    write(Path("flight.csv"), FLOWN, INPUTS, (*MEASURED, *ACTUATORS), None)
    expected = fit(START, load_recording("flight.csv"), FIELDS).values
    found = fit(START, read(NAMED | named, plugin=plugin), FIELDS).values
    # The force is held in the body's axes, which half way to the next row are between samples.
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    np.testing.assert_allclose(found, [1.6, 40e9], rtol=1e-6)


def test_the_file_of_a_bag_alone_is_enough() -> None:
    named = NAMED | {"bend": "/arm/bend"}
    whole = read(named)
    alone = ca.read_rosbag(next(Path("flight").glob("*.mcap")), START, named)
    np.testing.assert_array_equal(alone.position, whole.position)


@pytest.mark.parametrize("kind", ["PoseWithCovarianceStamped", "TransformStamped"])
def test_every_type_of_pose_and_point_is_read(kind: str) -> None:
    pose, tip = (TOPICS[name][2] for name in ("/uav/pose", "/arm/tip"))
    topics = TOPICS | {
        "/uav/pose": (f"geometry_msgs/msg/{kind}", TIME, pose),
        "/arm/tip": ("geometry_msgs/msg/PointStamped", TIME, tip),
    }
    found = read(NAMED | {"tip": "/arm/tip"}, topics)
    np.testing.assert_allclose(found.attitude, FLOWN["attitude"], atol=1e-12)
    np.testing.assert_allclose(found.bend, FLOWN["bend"], atol=1e-9)


def test_the_pose_of_the_camera_tells_the_bend() -> None:
    mounted = START.replace({"camera.position": [0.01, 0.02, 0.05],
                             "camera.attitude": [0.0, 0.6, 0.0, 0.8]})  # fmt: skip
    tip = Rotation.from_quat(FLOWN["tip_attitude"].to_numpy())
    place = FLOWN["tip_position"].to_numpy() + tip.apply(mounted.camera.position)
    turn = (tip * Rotation.from_quat(mounted.camera.attitude)).as_quat()
    topics = TOPICS | {"/camera": ("geometry_msgs/msg/PoseStamped", TIME, np.hstack([place, turn]))}
    found = read({"pose": "/uav/pose", "camera": "/camera"}, topics, mounted)
    np.testing.assert_allclose(found.bend, FLOWN["bend"], atol=1e-9)


def test_thrusts_of_rotors_are_commands() -> None:
    found, thrusts = flown(rotorcraft(), 0.1)
    time = found["time"].to_numpy()
    topics = bag_topics(found)
    topics["/motors"] = ("std_msgs/msg/Float64MultiArray", time, thrusts)
    named = {"pose": "/uav/pose", "bend": "/arm/bend", "rotors": "/motors"}
    recording = read(named, topics, rotorcraft())
    assert recording.rotor_command is not None and recording.inputs is not None
    np.testing.assert_allclose(recording.rotor_command, thrusts, rtol=1e-9)
    assert not recording.inputs.any()


SENSED = np.hstack([FLOWN["angular_velocity"].to_numpy(), FLOWN["velocity"].to_numpy() + 9.0])
BODY_VELOCITY = FLOWN["velocity"].to_numpy()
VELOCITY = Rotation.from_quat(FLOWN["attitude"].to_numpy()).apply(BODY_VELOCITY)


def sensed(
    kind: str, rows: np.ndarray, frame: str = "odom", of: str = "velocity", **how: Any
) -> Recording:
    """A bag with a topic of a role, in axes of a frame."""
    topics = {name: TOPICS[name] for name in ("/uav/pose", "/arm/bend", "/arm/moment")}
    named = {"pose": "/uav/pose", "bend": "/arm/bend", "bend_moment": "/arm/moment", of: "/topic"}
    return read(named, topics | {"/topic": (kind, TIME, rows)}, frame=frame, **how)


@pytest.mark.parametrize(
    ("kind", "rows", "how"),
    [
        ("geometry_msgs/msg/Twist", VELOCITY, {}),
        ("geometry_msgs/msg/TwistStamped", VELOCITY, {}),
        ("nav_msgs/msg/Odometry", np.hstack([TOPICS["/uav/pose"][2], BODY_VELOCITY]), {}),
        ("nav_msgs/msg/Odometry", np.hstack([TOPICS["/uav/pose"][2], VELOCITY]), {"child": "map"}),
    ],
)
def test_velocities_become_those_in_world_axes(
    kind: str, rows: np.ndarray, how: dict[str, Any]
) -> None:
    np.testing.assert_allclose(sensed(kind, rows, **how).velocity, VELOCITY, atol=1e-9)


def test_an_imu_gives_gyro_and_accelerometer() -> None:
    for of, part in (("gyro", slice(0, 3)), ("accelerometer", slice(3, 6))):
        found = sensed("sensor_msgs/msg/Imu", SENSED, frame="imu_link", of=of)
        np.testing.assert_allclose(getattr(found, of), SENSED[:, part], atol=1e-9)
        shutil.rmtree("flight")


@pytest.mark.parametrize(
    ("of", "kind", "how"),
    [
        ("gyro", "geometry_msgs/msg/Twist", {}),
        ("gyro", "sensor_msgs/msg/Imu", {"frame": "map"}),
        ("accelerometer", "sensor_msgs/msg/Imu", {"frame": "base_link_frd"}),
        ("velocity", "sensor_msgs/msg/Imu", {}),
        ("velocity", "geometry_msgs/msg/TwistStamped", {"frame": "base_link"}),
        ("velocity", "geometry_msgs/msg/TwistStamped", {"frame": "map_ned"}),
        ("velocity", "nav_msgs/msg/Odometry", {"child": "base_link_frd"}),
    ],
)
def test_sensors_of_other_types_or_axes_are_refused(
    of: str, kind: str, how: dict[str, Any]
) -> None:
    rows = np.hstack([TOPICS["/uav/pose"][2], BODY_VELOCITY])
    with refused(f"{of} (/topic)"):
        sensed(kind, rows, of=of, **how)


def test_forces_that_an_imu_does_not_measure_are_refused() -> None:
    rows = np.hstack([SENSED, np.full((len(TIME), 1), -1.0)])
    with refused("accelerometer (/topic)"):
        sensed("sensor_msgs/msg/Imu", rows, frame="imu_link", of="accelerometer")


def test_joints_are_taken_by_name_and_scaled() -> None:
    bend = FLOWN["bend"].to_numpy()
    topics = TOPICS | {"/joints": ("sensor_msgs/msg/JointState", TIME, 10.0 * bend[:, ::-1])}
    found = read(NAMED | {"bend": "/joints:1,0*0.1"}, topics)
    np.testing.assert_allclose(found.bend, bend, rtol=1e-12)


@pytest.mark.parametrize("role", ["pose", "tip", "camera", "wrench"])
def test_fields_of_what_its_type_tells_are_refused_and_not_passed_over(role: str) -> None:
    named = NAMED | {"camera" if role == "camera" else "tip": "/arm/tip"}
    with refused(f"{role} ({named[role]})", place="flight"):
        read(named | {role: f"{named[role]}:y,x,z*1,-1,1"})


@pytest.mark.parametrize("kind", ["geometry_msgs/msg/PointStamped", "nav_msgs/msg/Odometry"])
def test_each_axis_of_a_tip_has_its_scale_whatever_its_type(kind: str) -> None:
    rows = TOPICS["/arm/tip"][2] * np.array([1, -1, 1e3, 1, 1, 1, 1])
    found = read(NAMED | {"tip": "/arm/tip*1,-1,0.001"}, TOPICS | {"/arm/tip": (kind, TIME, rows)})
    np.testing.assert_allclose(found.bend, FLOWN["bend"], atol=1e-9)


@pytest.mark.parametrize("fields", ["", ":0,1"])
def test_joints_may_change_their_order_between_messages(fields: str) -> None:
    bend = FLOWN["bend"].to_numpy().copy()
    bend[1::2] = bend[1::2, ::-1]
    topics = TOPICS | {"/joints": ("sensor_msgs/msg/JointState", TIME, bend)}
    named = {"pose": "/uav/pose", "wrench": "/uav/wrench", "bend": "/joints" + fields}
    found = read(named, topics, joints=("01", "10"))
    np.testing.assert_allclose(found.bend, FLOWN["bend"], rtol=1e-10)


@pytest.mark.parametrize("joints", [("01", "02"), ("01", "00"), ("01", "0")])
def test_joints_that_are_not_those_of_the_first_message_are_refused(
    joints: tuple[str, str],
) -> None:
    with refused("bend_moment (/arm/moment)"):
        read(NAMED | {"bend": "/arm/bend"}, joints=joints)


def test_a_message_of_more_numbers_than_the_first_is_refused_where_no_fields_are_named() -> None:
    bends = list(FLOWN["bend"].to_numpy())
    bends[-1] = np.append(bends[-1], 0.0)
    topics: Any = TOPICS | {"/arm/bend": ("std_msgs/msg/Float64MultiArray", TIME, bends)}
    with refused("bend (/arm/bend)"):
        read(NAMED | {"bend": "/arm/bend"}, topics)
    found = ca.read_rosbag("flight", START, NAMED | {"bend": "/arm/bend:0,1"})
    np.testing.assert_allclose(found.bend, FLOWN["bend"], rtol=1e-10)


@pytest.mark.parametrize(
    ("named", "how", "field"),
    [
        ({"bend": "/arm/bent"}, {}, "data"),
        ({"bend": "/uav/pose"}, {}, "bend (/uav/pose)"),
        ({"tip": "/arm/bend"}, {}, "tip (/arm/bend)"),
        ({"tip": "/uav/pose"}, {}, "tip (/uav/pose)"),
        ({"bend": "/arm/bend"}, {"frame": "odom"}, "wrench (/uav/wrench)"),
        ({"bend": "/arm/bend"}, {"frame": "base_link_frd"}, "wrench (/uav/wrench)"),
        ({"bend": "/arm/bend"}, {"frame": "uav/map_ned"}, "wrench (/uav/wrench)"),
        ({"bend": "/arm/moment:2,1"}, {}, "bend (/arm/moment)"),
    ],
)
def test_topics_that_cannot_be_used_are_refused(
    named: dict[str, str], how: dict[str, Any], field: str
) -> None:
    with refused(field, place="flight"):
        read(NAMED | named, **how)


@pytest.mark.parametrize(
    ("named", "vehicle"),
    [
        ({"bend": "/arm/bend"}, START),
        # One pose does not tell the bends of two sections.
        (NAMED | {"tip": "/arm/tip"}, ca.load_vehicle("two_section")),
    ],
)
def test_topics_that_do_not_tell_all_are_refused(
    named: dict[str, str], vehicle: ca.Vehicle
) -> None:
    with refused("topics"):
        read(named, vehicle=vehicle)


@pytest.mark.parametrize("content", [None, b"no bag", "cut"])
def test_what_is_no_whole_bag_is_refused(content: Any) -> None:
    named = NAMED | {"bend": "/arm/bend"}
    if content == "cut":
        read(named)
        content = next(Path("flight").glob("*.mcap")).read_bytes()[:-5000]
    if content is not None:
        Path("flight.mcap").write_bytes(content)
    with refused("data"):
        ca.read_rosbag("flight.mcap", START, named)


def test_topics_of_clocks_that_never_meet_are_refused() -> None:
    kind, time, rows = TOPICS["/arm/bend"]
    with refused("bend (/arm/bend)"):
        read(NAMED | {"bend": "/arm/bend"}, TOPICS | {"/arm/bend": (kind, time + 100.0, rows)})


@pytest.mark.long
def test_the_command_identifies_from_a_bag_and_says_how_it_was_resampled() -> None:
    write_bag(Path("flight"), TOPICS)
    write_vehicle(START, "start.toml")
    named = NAMED | {"bend": "/arm/bend"}
    options = [f"--topic={role}={topic}" for role, topic in named.items()]
    options += ["--window", "0", "0.3", "--fit", "uav.mass,arm.youngs_modulus"]
    arguments = ["identify", "--data", "flight", "--vehicle", "start.toml", "--out", "fitted.toml"]
    result = CliRunner().invoke(cli.app, [*arguments, *options])
    assert result.exit_code == 0, result.output
    assert "flight: 0 to 0.3 s in 31 rows every 0.01 s, resampled from pose 100" in result.stderr
    assert ca.load_vehicle("fitted.toml").uav.mass == pytest.approx(1.6, rel=1e-6)


def test_a_small_file_whose_chunk_unpacks_to_a_gigabyte_is_refused(tmp_path: Path) -> None:
    zstd = pytest.importorskip("backports.zstd")
    packed = zstd.compress(bytes(1 << 29))
    sizes = struct.pack("<QQQI", 0, 0, 1 << 20, 0)
    chunk = sizes + struct.pack("<I4sQ", 4, b"zstd", len(packed)) + packed
    records = struct.pack("<BQ", 1, 8) + bytes(8) + struct.pack("<BQ", 6, len(chunk)) + chunk
    (tmp_path / "bomb.mcap").write_bytes(b"\x89MCAP0\r\n" + records + b"\x89MCAP0\r\n")
    with refused("data"):
        ca.read_rosbag(tmp_path / "bomb.mcap", rotorcraft(), {"pose": "/pose", "tip": "/tip"})


ODD = "odd_msgs/msg/Odd"
"""A type that ROS 2 does not come with, of a topic that nobody asks for."""


def with_odd(plugin: str, definition: str = "float64 oddity\n", **how: Any) -> Path:
    """A bag with a topic of a type of its own beside the others."""
    from rosbags.rosbag2 import Reader, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    write_bag(Path("plain"), TOPICS, plugin="MCAP")
    writer = Writer("flight", version=9, storage_plugin=StoragePlugin[plugin])
    if how:
        writer.set_compression(**how)
    with writer, Reader("plain") as reader:
        odd = get_typestore(Stores.ROS2_HUMBLE)
        odd.register(get_types_from_msg(definition, ODD))
        known = {
            each.topic: writer.add_connection(each.topic, each.msgtype, typestore=odd)
            for each in reader.connections
        }
        other = writer.add_connection("/odd", ODD, typestore=odd)
        for connection, stamp, raw in reader.messages():
            writer.write(known[connection.topic], stamp, raw)
            writer.write(other, stamp, bytes([0, 1, 0, 0]) + bytes(16))
    return next(Path("flight").glob("*.mcap*" if plugin == "MCAP" else "*.db3"))


def same_as_plain(found: Recording) -> None:
    plain = ca.read_rosbag("plain", START, NAMED | {"bend": "/arm/bend"})
    for name in ("time", "position", "attitude", "bend", "inputs"):
        np.testing.assert_array_equal(getattr(found, name), getattr(plain, name))


@pytest.mark.long
@pytest.mark.parametrize("of_folder", [True, False])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"ros2msg", b"rosxmsg"),  # a language of types that nobody knows
        (b"float64 oddity", b"float64 [[[[[["),  # a type that is none
        (b"float64 oddity", b"other/X oddity"),  # of another that is not there
    ],
)
@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_a_topic_that_nobody_asks_for_may_be_of_any_type(
    plugin: str, old: bytes, new: bytes, of_folder: bool
) -> None:
    file = with_odd(plugin)
    if plugin == "MCAP":
        content = file.read_bytes()
        if old == b"ros2msg":  # of the odd type alone
            old = struct.pack("<I", len(ODD)) + ODD.encode() + struct.pack("<I", 7) + old
            new = old[:-7] + new
        assert old in content
        file.write_bytes(content.replace(old, new))
    else:
        column = "encoding" if old == b"ros2msg" else "encoded_message_definition"
        with sqlite3.connect(file) as database:
            database.execute(
                f"UPDATE message_definitions SET {column} = replace({column}, ?, ?) "
                "WHERE topic_type = ?",
                (old.decode(), new.decode(), ODD),
            )
    same_as_plain(
        ca.read_rosbag("flight" if of_folder else file, START, NAMED | {"bend": "/arm/bend"})
    )
    with refused("data", place=file):
        ca.read_rosbag(file, START, NAMED | {"bend": "/odd"})


def test_a_type_of_its_own_is_read_where_the_bag_defines_it() -> None:
    with_odd("MCAP", "float64[2] data\n")
    found = ca.read_rosbag("flight", START, NAMED | {"bend": "/odd"})
    assert not found.bend.any()


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE", "STORAGE"])
def test_packed_bags_are_read(mode: str) -> None:
    from rosbags.rosbag2.enums import CompressionFormat, CompressionMode

    packing = {"mode": CompressionMode[mode], "fmt": CompressionFormat.ZSTD}
    with_odd("MCAP", **packing)
    same_as_plain(ca.read_rosbag("flight", START, NAMED | {"bend": "/arm/bend"}))


@pytest.mark.parametrize("mode", ["file", "message"])
def test_packed_bags_that_unpack_to_gigabytes_are_refused(mode: str) -> None:
    from backports import zstd

    bomb = zstd.compress(bytes(1 << 29))
    file = with_odd("SQLITE3")
    described = Path("flight/metadata.yaml")
    text = re.sub("compression_format: .*", "compression_format: zstd", described.read_text())
    described.write_text(re.sub("compression_mode: .*", f"compression_mode: {mode}", text))
    if mode == "file":
        file.write_bytes(bomb)
    else:
        with sqlite3.connect(file) as database:
            database.execute("UPDATE messages SET data = ?", (bomb,))
    with refused("data"):
        ca.read_rosbag("flight", START, NAMED | {"bend": "/arm/bend"})


def test_types_of_endless_messages_are_refused() -> None:
    for definition in ("Nothing[] x\n" + "=" * 80 + "\nMSG: odd_msgs/Nothing\n",
                       "float64[100000000] data\n"):  # fmt: skip
        with refused("data"):
            try:
                with_odd("MCAP", definition)
                ca.read_rosbag("flight", START, NAMED | {"bend": "/odd"})
            finally:
                for each in ("flight", "plain"):
                    shutil.rmtree(each, ignore_errors=True)


@pytest.mark.parametrize("name", ["flight/metadata.yaml", "flight/flight.mcap"])
def test_a_pipe_in_a_bag_is_refused(name: str) -> None:
    write_bag(Path("flight"), TOPICS)
    Path(name).unlink()
    os.mkfifo(name)
    with refused("data"):
        ca.read_rosbag("flight", START, NAMED | {"bend": "/arm/bend"})


def test_qualities_of_service_are_passed_over() -> None:
    """Their YAML is deep here, which takes seconds to refuse, for every topic."""
    import rosbags.rosbag2.reader as of_folders
    import rosbags.rosbag2.storage_mcap as of_files

    file, before = with_odd("SQLITE3"), (of_folders.parse_qos, of_files.get_qos)
    with sqlite3.connect(file) as database:
        database.execute("UPDATE topics SET offered_qos_profiles = ?", ("[" * 3000,))
    same_as_plain(ca.read_rosbag(file, START, NAMED | {"bend": "/arm/bend"}))
    assert (of_folders.parse_qos, of_files.get_qos) == before
