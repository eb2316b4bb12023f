"""Gyros, accelerometers and velocities are predicted, and identify a vehicle."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.identification import Fit, Recording, fit, load_recording
from continuair.identification.recording import MEASURED, SENSORS
from continuair.identification.replay import START, Replay
from continuair.vehicle.layout import ACTUATORS
from continuair.vehicle.vehicle_file import write_vehicle
from tests.identification.flights import NOISE, SAMPLE, held_inputs, held_scenario, true_vehicle
from tests.refusals import refused

pytestmark = pytest.mark.targets

VEHICLE = true_vehicle()
FIELDS = ("arm.youngs_modulus", "arm.damping_ratio", "uav.mass", "arm.disks.0.mass")
TRUTH = np.array([40e9, 0.03, 1.6, 0.05])
WRONG = dict(zip(FIELDS, (50e9, 0.05, 1.9, 0.07), strict=True))
PLACE = (0.05, -0.03, 0.02)
SENSOR_NOISE = {"velocity": 0.02, "gyro": 5e-3, "accelerometer": 0.05}
BIAS = {"velocity": np.zeros(3), "gyro": np.array([0.02, -0.01, 0.03]),
        "accelerometer": np.array([-0.2, 0.1, 0.3])}  # fmt: skip


@cache
def flight() -> Recording:
    """A flight under held inputs without noise, and what ideal sensors measure in it."""
    time = np.asarray(SAMPLE * np.arange(201), float)
    inputs = held_inputs(time)
    scenario = held_scenario(time, inputs)
    found = ca.simulate(VEHICLE, scenario, sample=SAMPLE, method="RK4", step=2e-4)
    names = ("position", "attitude", "bend", "velocity", "angular_velocity", "bend_rate")
    state = {name: found[name].to_numpy() for name in names}
    # Results hold the velocity in body axes.
    state["velocity"] = Rotation.from_quat(state["attitude"]).apply(state["velocity"])
    acting = np.vstack([inputs[:-1], inputs[-2]])
    v, w, _ = ca.accelerations(
        VEHICLE,
        attitude=state["attitude"],
        velocity=state["velocity"],
        angular_velocity=state["angular_velocity"],
        bend=state["bend"][:, None],
        bend_rate=state["bend_rate"][:, None],
        force=acting[:, :3],
        moment=acting[:, 3:6],
        bend_moment=acting[:, None, 6:],
    )
    return Recording(
        "flight", time, state["position"], state["attitude"], state["bend"], inputs,
        velocity=state["velocity"], gyro=state["angular_velocity"],
        accelerometer=felt_at(PLACE, state, v, w), imu_position=np.array(PLACE),
    )  # fmt: skip


def felt_at(
    place: tuple[float, ...], state: dict[str, np.ndarray], v: np.ndarray, w: np.ndarray
) -> np.ndarray:
    """The specific force at a place, from matrices of the attitudes and of the spins."""
    x, y, z, s = state["attitude"].T
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * s), 2 * (x * z + y * s)],
        [2 * (x * y + z * s), 1 - 2 * (x * x + z * z), 2 * (y * z - x * s)],
        [2 * (x * z - y * s), 2 * (y * z + x * s), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    rates, slopes = (_cross(each) for each in (state["angular_velocity"], w))
    origin = np.einsum("jin,nj->ni", turn, v + [0.0, 0.0, 9.81])
    return np.asarray(origin + (slopes + rates @ rates) @ np.array(place))


def _cross(vectors: np.ndarray) -> np.ndarray:
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)


def noisy(seed: int) -> Recording:
    """The flight with noise and biases of its sensors, and noise of its bend."""
    rng, true = np.random.default_rng(seed), flight()
    changes: dict[str, Any] = {
        name: getattr(true, name) + BIAS[name] + size * rng.normal(size=(len(true.time), 3))
        for name, size in SENSOR_NOISE.items()
    }
    changes |= {
        name: getattr(true, name) + NOISE[name] * rng.normal(size=getattr(true, name).shape)
        for name in ("position", "bend")
    }
    turn = Rotation.from_rotvec(NOISE["attitude"] * rng.normal(size=true.position.shape))
    changes["attitude"] = (Rotation.from_quat(true.attitude) * turn).as_quat()
    return dataclasses.replace(true, **changes)


def without(recording: Recording, *names: str) -> Recording:
    changes: dict[str, Any] = dict.fromkeys(names, np.empty((0, 0)))
    return dataclasses.replace(recording, **changes)


def save(path: Path, recording: Recording) -> None:
    """Write a recording as a CSV file."""
    columns: dict[str, np.ndarray] = {"time": recording.time + 12.5}
    parts = {"position": MEASURED[1:4], "attitude": MEASURED[4:8], "bend": MEASURED[8:], **SENSORS}
    for name, headings in parts.items():
        columns |= dict(zip(headings, getattr(recording, name).T, strict=False))
    assert recording.inputs is not None
    columns |= dict(zip(ACTUATORS, recording.inputs.T, strict=True))
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(columns), *(",".join(f"{x:.17g}" for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def predicted(recording: Recording, start: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Sensors (n, 3) along a replayed flight."""
    replay = Replay(VEHICLE, recording, None)
    start = replay.first[None] if start is None else start
    found = replay.differences(VEHICLE, start, 1)[0]
    return {
        name: found[:, where] + getattr(recording, name)
        for name, where in replay.measured.of.items()
        if name in SENSORS
    }


def resting(**changes: Any) -> Recording:
    """A hover with a straight arm, and sensors that show zeros."""
    time = np.asarray(0.01 * np.arange(11), float)
    inputs = np.zeros((11, 8))
    inputs[:, 2] = 9.81 * float(VEHICLE.mass)
    fields: dict[str, Any] = dict.fromkeys(SENSORS, np.zeros((11, 3)))
    attitude = np.tile([0.0, 0.0, 0.0, 1.0], (11, 1))
    fields |= {"position": np.zeros((11, 3)), "attitude": attitude, "bend": np.zeros((11, 2))}
    return Recording(name="hover", time=time, inputs=inputs, **(fields | changes))


def test_the_accelerometer_of_a_hovering_vehicle_shows_gravity_along_its_z_axis() -> None:
    found = predicted(resting())
    np.testing.assert_allclose(found["accelerometer"], np.tile([0, 0, 9.81], (11, 1)), atol=1e-9)
    np.testing.assert_allclose(found["gyro"], 0.0, atol=1e-12)
    np.testing.assert_allclose(found["velocity"], 0.0, atol=1e-12)


def test_an_accelerometer_off_the_centre_of_a_spin_shows_the_centripetal_acceleration() -> None:
    start = np.zeros((1, START))
    start[0, 13] = 3.0
    found = predicted(resting(imu_position=[0.2, 0.0, 0.0]), start)["accelerometer"]
    np.testing.assert_allclose(found, np.tile([-1.8, 0.0, 9.81], (11, 1)), atol=1e-9)


def test_the_specific_force_is_that_of_differences_of_the_motion() -> None:
    step, q, rates = 2e-4, [0, 0, 5, 0.3, -0.2, 0.2, 0.4, 0.5], [0.2, 0.1, 0, 1.5, -1, 2, 0.5, 0.3]
    acting = [3.0, -2.0, 20.0, 0.1, -0.05, 0.02, 0.0, 0.0]
    scenario = ca.Scenario("free", q, rates, force=acting[:3], moment=acting[3:6], duration=4e-3)
    found = ca.simulate(VEHICLE, scenario, sample=step, method="RK4", step=1e-4)
    names = ("time", "position", "attitude", "bend")
    time, position, attitude, bend = (found[name].to_numpy() for name in names)
    turn = Rotation.from_quat(attitude)
    place = position + turn.apply(PLACE)
    seen = np.diff(place, 2, axis=0) / step**2 + [0.0, 0.0, 9.81]
    recording = Recording(
        "free", time, position, attitude, bend, np.tile(acting, (len(time), 1)),
        accelerometer=np.zeros((len(time), 3)), imu_position=np.array(PLACE),
    )  # fmt: skip
    motion = [found[name].to_numpy()[0] for name in ("velocity", "angular_velocity", "bend_rate")]
    motion[0] = turn[0].apply(motion[0])
    start = np.concatenate([position[0], turn[0].as_rotvec(), bend[0], *motion])[None]
    felt = predicted(recording, start)["accelerometer"]
    np.testing.assert_allclose(felt[1:-1], turn[1:-1].inv().apply(seen), atol=2e-4)


def test_predicted_sensors_are_those_of_the_flight() -> None:
    recording = flight()
    found = fit(VEHICLE, recording, ["uav.mass"])
    assert found.converged and not found.doubts
    assert found.values == pytest.approx([1.6], rel=1e-6)
    assert max(found.deviations.values()) < 1e-5
    np.testing.assert_allclose(np.concatenate(list(found.biases.values())), 0.0, atol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_gyro_accelerometer_and_bend_alone_identify_a_vehicle(seed: int) -> None:
    recording = without(noisy(seed), "position", "attitude", "velocity")
    found = fit(VEHICLE.replace(WRONG), recording, FIELDS)
    assert found.converged and np.isfinite(found.condition)
    off = (found.values - TRUTH) / found.errors
    assert np.abs(off).max() < 4.0 and np.sqrt(np.mean(off**2)) < 2.0
    assert (found.errors / TRUTH < 0.1).all()
    expected = [NOISE["bend"], SENSOR_NOISE["gyro"], SENSOR_NOISE["accelerometer"]]
    np.testing.assert_allclose(list(found.deviations.values()), expected, rtol=0.15)
    np.testing.assert_allclose(found.biases["gyro_rad_s"], BIAS["gyro"], atol=0.01)
    assert found.describe()["biases"] == found.biases


@cache
def fitted() -> Fit:
    """The mass fitted to the noisy flight."""
    return fit(VEHICLE, noisy(1), ["uav.mass"])


@pytest.mark.long
@pytest.mark.parametrize(
    ("sensor", "factor", "key"),
    [
        pytest.param("gyro", 180.0 / np.pi, "gyro_rad_s", marks=pytest.mark.long),
        ("gyro", -1.0, "gyro_rad_s"),
        ("accelerometer", 1.0 / 9.81, "accelerometer_m_s2"),
        ("accelerometer", -1.0, "accelerometer_m_s2"),
        ("velocity", -1.0, "velocity_m_s"),
    ],
)
def test_wrong_units_and_signs_raise_the_residual(sensor: str, factor: float, key: str) -> None:
    right = noisy(1)
    wrong = dataclasses.replace(right, **{sensor: factor * getattr(right, sensor)})
    bad = fit(VEHICLE, wrong, ["uav.mass"])
    assert not fitted().doubts
    assert bad.deviations[key] > 5.0 * fitted().deviations[key]
    assert bad.doubts


@pytest.mark.long
def test_a_bias_beyond_those_of_sensors_is_reported() -> None:
    right = noisy(1)
    turned = right.accelerometer - [0.0, 0.0, 2.0 * 9.81]
    found = fit(VEHICLE, dataclasses.replace(right, accelerometer=turned), ["uav.mass"])
    assert any(doubt.startswith("the accelerometer has a bias of 19.3") for doubt in found.doubts)


@pytest.mark.long
def test_the_command_takes_the_place_of_the_accelerometer_and_shows_biases(
    tmp_path: Path,
) -> None:
    save(tmp_path / "flight.csv", noisy(1))
    write_vehicle(VEHICLE, str(tmp_path / "start.toml"))
    options = ["--data", str(tmp_path / "flight.csv"), "--vehicle", str(tmp_path / "start.toml")]
    place = ["--imu", *map(str, PLACE)]
    shown = CliRunner().invoke(cli.app, ["identify", *options, "--fit", "uav.mass", *place])
    assert shown.exit_code == 0, shown.output
    for key in ("gyro_rad_s", "accelerometer_m_s2"):
        assert f"Bias of {key}: " in shown.stderr and f"{key} " in shown.stderr
    assert "warning" not in shown.stderr


def test_recordings_round_trip_through_a_table(tmp_path: Path) -> None:
    for recording in (flight(), without(flight(), "position", "attitude", "velocity")):
        save(tmp_path / "flight.csv", recording)
        found = load_recording(tmp_path / "flight.csv", imu_position=PLACE)
        for name in ("position", "attitude", "bend", "inputs", "imu_position", *SENSORS):
            # Times begin at 12.5 s in the file, and quaternions are scaled to length 1.
            np.testing.assert_allclose(getattr(found, name), getattr(recording, name), rtol=1e-12)
        np.testing.assert_allclose(found.time, recording.time, atol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("gyro_y", "rate", "gyro_y"),
        ("vz", "v", "vz"),
        ("accel_x", "accel_y", "accel_x"),
        ("bend_moment_x", "gyro_x", "gyro_x"),
        ("bend_moment_x", "gyro_w", "gyro_w"),
        ("bend_moment_x", "accel_x [g]", "accel_x [g]"),
        ("qw", "w", "qw"),
        ("x", "north", "x"),
    ],
)
def test_partial_repeated_and_unknown_columns_of_sensors_are_refused(
    old: str, new: str, field: str, tmp_path: Path
) -> None:
    save(tmp_path / "flight.csv", flight())
    headings, rows = (tmp_path / "flight.csv").read_text().split("\n", 1)
    names = [new if name == old else name for name in headings.split(",")]
    (tmp_path / "flight.csv").write_text(",".join(names) + "\n" + rows)
    with refused(field):
        load_recording(tmp_path / "flight.csv")


def test_a_pose_may_be_missing_with_sensors_alone(tmp_path: Path) -> None:
    save(tmp_path / "flight.csv", without(flight(), "position", *SENSORS))
    with refused("x"):
        load_recording(tmp_path / "flight.csv")


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"gyro": np.zeros((11, 2))}, "gyro"),
        ({"accelerometer": np.full((11, 3), np.nan)}, "accelerometer"),
        ({"velocity": np.zeros((10, 3))}, "velocity"),
        ({"imu_position": [0.0, 0.0]}, "imu_position"),
    ],
)
def test_sensors_of_another_shape_are_refused(changes: dict[str, Any], field: str) -> None:
    with refused(field):
        resting(**changes)
