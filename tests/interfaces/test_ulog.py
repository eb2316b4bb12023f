"""A vehicle is identified from PX4's log of its flight, or the log is refused in a sentence."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.identification import Recording, fit
from continuair.vehicle.vehicle_file import write_vehicle
from tests.interfaces.logged import flown, px4_estimates, rotorcraft, to_frd, to_ned, write_ulog
from tests.refusals import assert_refused, numbers_of, refused

pytest.importorskip("pyulog")

FIELDS = ("uav.mass", "arm.youngs_modulus")
TRUTH = np.array([1.6, 40e9])
WRONG = {"uav.mass": 2.0, "arm.youngs_modulus": 60e9}
BEND = "debug_array:data[0],data[1]"
MOTORS = "actuator_motors:control[0],control[1],control[2],control[3]*14"
SETPOINTS = {"thrust": "vehicle_thrust_setpoint*40", "torque": "vehicle_torque_setpoint*4,4,2"}
FLOWN = flown(rotorcraft())
Topics = dict[str, tuple[np.ndarray, Mapping[str, np.ndarray]]]


@pytest.fixture(autouse=True)
def own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def logged() -> Topics:
    """Topics of the flight: estimates, bend, and what motors are commanded."""
    found, thrusts = FLOWN
    return {
        **px4_estimates(found),
        "actuator_motors": (found["time"].to_numpy(), {"control": thrusts / 14.0}),
    }


def read(topics: Topics | None = None, **choices: Any) -> Recording:
    write_ulog(Path("flight.ulg"), logged() if topics is None else topics)
    named = choices.pop("named", {"bend": BEND, "rotors": MOTORS})
    return ca.read_ulog("flight.ulg", rotorcraft(), named, **choices)


def test_numbers_of_a_topic_scale_the_fields_as_they_are_named() -> None:
    """A log in our axes, z up, is turned to NED and FRD by signs."""
    topics, signs = logged(), {"attitude": "1,1,-1,-1", "position": "1,-1,-1"}
    expected = read(topics)
    time, attitude = topics["vehicle_attitude"]
    ours = {f"q[{k}]": sign * attitude["q"][:, k] for k, sign in enumerate((1, 1, -1, -1))}
    topics["vehicle_attitude"] = time, {**attitude, "q": np.stack(list(ours.values()), -1)}
    time, place = topics["vehicle_local_position"]
    ours = {name: sign * place[name] for name, sign in zip("xyz", (1, -1, -1), strict=True)}
    topics["vehicle_local_position"] = time, {**place, **ours}
    named = {
        "bend": BEND, "rotors": MOTORS,
        "attitude": f"vehicle_attitude*{signs['attitude']}",
        "position": f"vehicle_local_position*{signs['position']}",
    }  # fmt: skip
    found = read(topics, named=named)
    np.testing.assert_allclose(found.attitude, expected.attitude, atol=1e-6)
    np.testing.assert_allclose(found.position, expected.position, atol=1e-6)


@pytest.mark.long
def test_a_log_of_motors_gives_back_mass_and_stiffness() -> None:
    found = fit(rotorcraft().replace(WRONG), read(), FIELDS)
    # PX4 logs in single precision.
    np.testing.assert_allclose(found.values, TRUTH, rtol=1e-6)


@pytest.mark.long
def test_setpoints_of_thrust_and_torque_give_back_mass_and_stiffness() -> None:
    vehicle = rotorcraft(lag=0.0)
    found, thrusts = flown(vehicle)
    assert vehicle.uav.rotors is not None
    time, wrench = found["time"].to_numpy(), thrusts @ vehicle.uav.rotors.allocation.T
    topics = {
        **px4_estimates(found),
        "vehicle_thrust_setpoint": (time, {"xyz": to_frd(wrench[:, :3]) / 40.0}),
        "vehicle_torque_setpoint": (time, {"xyz": to_frd(wrench[:, 3:]) / [4.0, 4.0, 2.0]}),
    }
    write_ulog(Path("flight.ulg"), topics)
    start = vehicle.replace({**WRONG, "uav.rotors": None})
    recording = ca.read_ulog("flight.ulg", start, {"bend": BEND, **SETPOINTS})
    # Rows hold the force in world axes, while it turned with the body by up to 2 degrees.
    np.testing.assert_allclose(fit(start, recording, FIELDS).values, TRUTH, rtol=2e-3)


def test_px4_axes_become_ours() -> None:
    found, recording = FLOWN[0], read()
    np.testing.assert_allclose(recording.position, found["position"], atol=1e-6)
    same = np.abs((recording.attitude * found["attitude"].to_numpy()).sum(-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-6)


def sensors() -> Topics:
    """Topics of the flight with those of sensors, and a log of all samples."""
    found, topics = FLOWN[0], logged()
    time, place = topics["vehicle_local_position"]
    world = Rotation.from_quat(found["attitude"].to_numpy()).apply(found["velocity"].to_numpy())
    velocity = dict(zip(("vx", "vy", "vz"), to_ned(world).T, strict=True))
    gyro, felt = (to_frd(found[name].to_numpy()) for name in ("angular_velocity", "velocity"))
    return topics | {
        "vehicle_local_position": (time, {**place, **velocity, "v_xy_valid": np.ones(len(time))}),
        "vehicle_angular_velocity": (time, {"xyz": gyro}),
        "vehicle_acceleration": (time, {"xyz": felt}),
        "sensor_combined": (time, {"gyro_rad": gyro, "accelerometer_m_s2": felt}),
    }


@pytest.mark.parametrize(
    "named",
    [
        {"gyro": "vehicle_angular_velocity", "accelerometer": "vehicle_acceleration"},
        {"gyro": "sensor_combined", "accelerometer": "sensor_combined"},
        {"gyro": "sensor_combined.0", "accelerometer": "vehicle_acceleration"},
    ],
)
def test_px4_sensors_become_ours(named: dict[str, str]) -> None:
    named = {"bend": BEND, "rotors": MOTORS, "velocity": "vehicle_local_position", **named}
    recording = read(sensors(), named=named, imu_position=(0.1, 0.0, 0.02))
    found = FLOWN[0]
    world = Rotation.from_quat(found["attitude"].to_numpy()).apply(found["velocity"].to_numpy())
    np.testing.assert_allclose(recording.velocity, world, atol=1e-6)
    np.testing.assert_allclose(recording.gyro, found["angular_velocity"], atol=1e-6)
    np.testing.assert_allclose(recording.accelerometer, found["velocity"], atol=1e-6)
    np.testing.assert_array_equal(recording.imu_position, [0.1, 0.0, 0.02])


@pytest.mark.parametrize(("flag", "bad"), [("v_xy_valid", 0.0), ("vz_reset_counter", 1.0)])
def test_velocities_that_px4_says_are_none_are_refused(flag: str, bad: float) -> None:
    topics, named = sensors(), {"bend": BEND, "rotors": MOTORS}
    time, place = topics["vehicle_local_position"]
    flags = np.full(len(time), 1.0 - bad)
    flags[len(flags) // 2] = bad
    topics["vehicle_local_position"] = time, {**place, flag: flags}
    read(topics, named=named)
    with refused("velocity (vehicle_local_position)"):
        read(topics, named=named | {"velocity": "vehicle_local_position"})


def test_the_position_of_the_tip_tells_the_bend() -> None:
    found, topics = FLOWN[0], logged()
    tip = to_ned(found["tip_position"].to_numpy())
    topics["mocap_tip"] = (found["time"].to_numpy(), dict(zip("xyz", tip.T, strict=True)))
    recording = read(topics, named={"tip": "mocap_tip", "rotors": MOTORS})
    np.testing.assert_allclose(recording.bend, found["bend"], atol=2e-6)


def test_slow_measurements_set_the_rows_and_fast_ones_are_read_between_samples() -> None:
    topics = logged()
    time, data = topics["debug_array"]
    topics["debug_array"] = (time[::5] + 0.002, {"data": data["data"][::5]})
    recording = read(topics)
    np.testing.assert_allclose(np.diff(recording.time), 0.05, rtol=1e-9)
    expected = flown(rotorcraft(), sample=0.002)[0].sel(
        time=0.002 + recording.time, method="nearest"
    )
    # The thrusts jump at the samples, and before the first one nothing is known.
    np.testing.assert_allclose(recording.position, expected["position"], atol=1e-5)
    np.testing.assert_allclose(recording.attitude, expected["attitude"], atol=2e-4)
    assert "resampled from position 100 Hz" in recording.sampling
    assert "bend 20 Hz" in recording.sampling


@pytest.mark.parametrize(("lag", "power"), [(0.0, 1.0), (0.04, 0.5)])
def test_held_inputs_keep_their_impulse_in_longer_rows(lag: float, power: float) -> None:
    """That of the thrusts, or of the speeds that lagging rotors follow."""
    write_ulog(Path("flight.ulg"), logged())
    named = {"bend": BEND, "rotors": MOTORS}
    recording = ca.read_ulog("flight.ulg", rotorcraft(lag=lag), named, rate=30.0)
    assert recording.rotor_command is not None
    impulse = (recording.rotor_command[:-1] ** power).sum(0) / 30.0
    whole = int(recording.time[-1] / 0.01)
    part = recording.time[-1] - 0.01 * whole
    held = FLOWN[1] ** power
    expected = 0.01 * held[:whole].sum(0) + part * held[whole]
    np.testing.assert_allclose(impulse, expected, rtol=1e-6)


@pytest.mark.slow
def test_commands_that_jitter_within_rows_give_lagging_rotors_the_thrust_that_they_gave() -> None:
    """Commands at 400 Hz that scatter by a fifth; measured at 50 Hz: the mass comes out."""
    vehicle, time = rotorcraft(), np.arange(201) / 400.0
    hover = 9.81 * float(vehicle.mass) / 4.0
    scatter = np.random.default_rng(3).normal(size=(len(time), 4))
    swing = 1.2 * np.sin(9.0 * time[:, None] + np.array([0.0, 1.0, 2.5, 4.0]))
    thrusts = np.clip(hover + swing + 0.2 * hover * scatter, 0.0, 14.0)
    thrusts[-1] = thrusts[-2]  # what begins at the end does not act

    def held(t: float) -> np.ndarray:
        return np.asarray(thrusts[int(np.searchsorted(time, t, side="right")) - 1])

    start = (0.3, -0.2, 5.0, 0.05, -0.04, 0.2, 0.8, 0.5)
    jumps = tuple(time[1:-1])
    flight = ca.Scenario("jitter", start, rotor_command=held, jumps=jumps, duration=0.5)
    found = ca.simulate(vehicle, flight, sample=0.0025, method="RK4", step=6.25e-4)
    topics = {
        name: (at[::8], {field: values[::8] for field, values in fields.items()})
        for name, (at, fields) in px4_estimates(found).items()
    }
    topics["actuator_motors"] = (time, {"control": thrusts / 14.0})
    write_ulog(Path("flight.ulg"), topics)
    wrong = vehicle.replace({"uav.mass": 1.1 * float(vehicle.uav.mass)})
    recording = ca.read_ulog("flight.ulg", wrong, {"bend": BEND, "rotors": MOTORS})
    fitted = fit(wrong, recording, ["uav.mass"])
    assert fitted.values[0] == pytest.approx(float(vehicle.uav.mass), rel=2e-3)


def test_rows_between_which_nothing_was_recorded_are_refused() -> None:
    """Also where other topics are faster: rows on lines between measurements are none."""
    with refused("rate"):
        read(rate=1e12)
    topics = logged()
    time, data = topics["debug_array"]
    topics["debug_array"] = (time[::5], {"data": data["data"][::5]})
    with refused("rate"):
        read(topics, rate=100.0)


@pytest.mark.slow
def test_commands_that_the_vehicles_limits_cut_off_are_in_doubt() -> None:
    start = rotorcraft().replace(WRONG)
    assert start.uav.rotors is not None
    assert not any("thrust_limits" in doubt for doubt in fit(start, read(), FIELDS).doubts)
    most = float(FLOWN[1].max())
    limits = {**start.uav.rotors.model_dump(), "thrust_limits": (0.0, 0.95 * most)}
    found = fit(start.replace({"uav.rotors": limits}), read(), FIELDS)
    assert any(doubt.startswith("rotor_command ") for doubt in found.doubts)


def test_a_window_cuts_a_log() -> None:
    recording = read(window=(0.1, 0.4))
    assert len(recording.time) == 31
    np.testing.assert_allclose(recording.position[0], FLOWN[0]["position"][10], atol=1e-6)


@pytest.mark.long
def test_a_window_in_flight_gives_the_vehicle_whose_rotors_turned_before_it() -> None:
    fitted = fit(rotorcraft().replace(WRONG), read(window=(0.2, 0.5)), FIELDS)
    # The rotors are 40 ms behind their commands at 0.2 s: as if they had settled, both come out
    # 0.1 % too small.
    np.testing.assert_allclose(fitted.values, TRUTH, rtol=1e-5)


def test_of_several_instances_of_a_topic_the_first_is_taken_and_the_others_are_told_of() -> None:
    time, bend = (topics := logged())["debug_array"]
    with pytest.warns(ca.ContinuairWarning, match="instances 0, 1"):
        found = read({"debug_array 1": (time, {"data": 9.0 * bend["data"]}), **topics})
    np.testing.assert_array_equal(found.bend, read().bend)


def spoiled(name: str, change: Any) -> Topics:
    """The topics, with a change made to the times and fields of one."""
    topics = logged()
    time, fields = topics[name]
    topics[name] = change(time.copy(), {key: value.copy() for key, value in fields.items()})
    return topics


def with_gap(time: np.ndarray, fields: Any) -> Any:
    kept = (time < 0.2) | (time > 0.3)
    return time[kept], {name: value[kept] for name, value in fields.items()}


def with_reset(time: np.ndarray, fields: Any) -> Any:
    fields["xy_reset_counter"][30:] = 1
    return time, fields


def with_odometrys_reset(time: np.ndarray, fields: Any) -> Any:
    counter = (np.arange(len(time)) >= 30).astype(np.uint8)
    return time, {**fields, "reset_counter": counter}


def with_nan(time: np.ndarray, fields: Any) -> Any:
    fields["q"][20] = np.nan
    return time, fields


@pytest.mark.parametrize(
    ("role", "name", "change", "told"),
    [
        ("bend", "debug_array", with_gap, [0.12, 0.19]),
        ("position", "vehicle_local_position", with_reset, [0.3]),
        ("position", "vehicle_local_position", with_odometrys_reset, [0.3]),
        ("attitude", "vehicle_attitude", with_nan, [0.2]),
    ],
)
def test_a_gap_a_reset_or_no_number_is_refused_unless_a_window_leaves_it_out(
    role: str, name: str, change: Any, told: list[float]
) -> None:
    topics = spoiled(name, change)
    with refused(f"{role} ({name})", place="flight.ulg") as found:
        read(topics)
    assert set(told) <= set(numbers_of(found.value.problem))
    assert len(read(topics, window=(0.32, 0.48)).time) == 17


def test_a_window_that_begins_on_the_way_across_a_reset_is_refused() -> None:
    """Its first row would lie between the samples before and after."""
    topics = spoiled("vehicle_local_position", with_reset)
    with refused("position (vehicle_local_position)"):
        read(topics, window=(0.295, 0.48))
    assert len(read(topics, window=(0.3, 0.48)).time) == 19


def test_a_log_that_is_cut_off_is_read_by_a_window_alone() -> None:
    write_ulog(Path("whole.ulg"), logged())
    Path("flight.ulg").write_bytes(Path("whole.ulg").read_bytes()[:-150])
    named = {"bend": BEND, "rotors": MOTORS}
    with refused("data"):
        ca.read_ulog("flight.ulg", rotorcraft(), named)
    assert len(ca.read_ulog("flight.ulg", rotorcraft(), named, window=(0.0, 0.4)).time) == 41


@pytest.mark.parametrize(
    ("named", "field"),
    [
        ({"rotors": MOTORS}, "topics"),
        ({"bend": "debug_arry:a,b"}, "data"),
        ({"bend": "debug_array"}, "bend (debug_array)"),
        ({"bend": "debug_array:data[5]"}, "bend (debug_array)"),
        ({"bend": "debug_array:data[0]"}, "bend (debug_array)"),
        ({"bend": BEND, "rotors": MOTORS[:-3]}, "rotors (actuator_motors)"),
        ({"bend": BEND, "thrust": SETPOINTS["thrust"]}, "thrust"),
        ({"bend": BEND, "rotors": MOTORS, **SETPOINTS}, "rotors"),
        ({"bend": BEND + "*x"}, "topic"),
        ({"bnd": BEND}, "topic"),
    ],
)
def test_topics_that_cannot_be_used_are_refused(named: dict[str, str], field: str) -> None:
    with refused(field):
        read(named=named)


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli.app, ["identify", *arguments])


@pytest.mark.slow
def test_the_command_identifies_from_a_log_and_says_how_it_was_resampled() -> None:
    write_ulog(Path("flight.ulg"), logged())
    write_vehicle(rotorcraft().replace({"uav.mass": 2.0}), "start.toml")
    result = run(
        "--data", "flight.ulg", "--vehicle", "start.toml", "--fit", "uav.mass",
        "--topic", f"bend={BEND}", "--topic", f"rotors={MOTORS}", "--window", "0", "0.3",
        "--out", "fitted.toml",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "flight.ulg: 0 to 0.3 s in 31 rows every 0.01 s" in result.stderr
    assert ca.load_vehicle("fitted.toml").uav.mass == pytest.approx(1.6, rel=1e-5)


@pytest.mark.parametrize(
    ("data", "content", "options", "field"),
    [
        ("flight.ulg", b"no log", ("--topic", f"bend={BEND}"), "data"),
        ("flight.ulg", None, ("--topic", f"bend={BEND}"), "data"),
        ("flight.ulg", b"", ("--topic", "bend"), "topic"),
        ("flight.ulg", b"", ("--topic", "bend=a", "--topic", "bend=b"), "topic"),
        ("flight.ulg", b"", ("--window", "3", "2"), "window"),
        ("flight.ulg", b"", ("--rate", "0"), "rate"),
        # A table takes no options of logs.
        ("flight.csv", None, ("--rate", "50"), "rate"),
        ("flight.csv", None, ("--window", "0", "1"), "window"),
        ("flight.csv", None, ("--topic", "bend=x"), "topic"),
    ],
)
def test_what_is_no_log_is_refused_in_one_sentence(
    data: str, content: bytes | None, options: tuple[str, ...], field: str
) -> None:
    if content is not None:
        Path(data).write_bytes(content)
    result = run("--data", data, "--vehicle", "paper", *options)
    assert_refused(result, field, place=data if field == "data" else "")


@pytest.mark.parametrize(("flag", "bad"), [("xy_valid", 0), ("z_valid", 0), ("dead_reckoning", 1)])
def test_positions_that_px4_says_are_none_are_refused(flag: str, bad: int) -> None:
    topics = logged()
    time, place = topics["vehicle_local_position"]
    flags = np.full(len(time), float(1 - bad))
    read(topics | {"vehicle_local_position": (time, {**place, flag: flags})})
    flags[len(flags) // 2] = bad
    with refused("position (vehicle_local_position)"):
        read(topics | {"vehicle_local_position": (time, {**place, flag: flags})})


def test_an_instance_of_a_topic_is_taken_by_its_number(recwarn: pytest.WarningsRecorder) -> None:
    time, bend = (topics := logged())["debug_array"]
    topics["debug_array 1"] = time, {"data": bend["data"] + 0.5}
    write_ulog(Path("flight.ulg"), topics)

    def bends(name: str) -> np.ndarray:
        named = {"bend": f"{name}:data[0],data[1]"}
        return ca.read_ulog("flight.ulg", rotorcraft(), named).bend

    first, second = bends("debug_array.0"), bends("debug_array.1")
    np.testing.assert_allclose(second, first + 0.5, atol=1e-6)
    assert not recwarn.list
    with refused("bend (debug_array.2)"):
        bends("debug_array.2")


@pytest.mark.parametrize("declared", ["float[65535] x", "bomb x", "wide[65535] x"])
def test_topics_of_more_fields_than_messages_hold_are_refused(declared: str) -> None:
    write_ulog(Path("flight.ulg"), logged())
    content = Path("flight.ulg").read_bytes()

    def message(kind: str, payload: bytes) -> bytes:
        return struct.pack("<HB", len(payload), ord(kind)) + payload

    formats = message("F", b"wide:float[65535] x;") + message("F", f"bomb:{declared};".encode())
    logged_often = b"".join(message("A", struct.pack("<BH", 0, n) + b"bomb") for n in range(20, 60))
    Path("flight.ulg").write_bytes(content[:16] + formats + logged_often + content[16:])
    with refused("data"):
        ca.read_ulog("flight.ulg", rotorcraft(), {"bend": BEND})


def test_a_topic_without_timestamps_is_refused() -> None:
    write_ulog(Path("flight.ulg"), logged())
    content = Path("flight.ulg").read_bytes()
    Path("flight.ulg").write_bytes(content.replace(b"uint64_t timestamp;", b"uint64_t timestomp;"))
    with refused("position (vehicle_local_position)"):
        ca.read_ulog("flight.ulg", rotorcraft(), {"bend": BEND})
