"""Motions of an arm driven by its tendons on a fixed base: files and fits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.identification import DrivenMotion, fit, fit_jointly, load_driven, load_recording
from tests.identification.benches import BENCH, FIELDS, FRAME, TRUE, bench_vehicle
from tests.refusals import refused

RATE = 100.0
TENDONS = {"name": "pull", "angles": [0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi], "offset": 0.012}
WINCHES = TENDONS | {"command": "length", "stiffness": 300.0, "damping": 0.2, "pretension": 1.5}


def swept(samples: int, size: float) -> Any:
    """Return a sine (samples, 4) from 0.3 to 3 Hz between opposite tendons, at rest first."""
    t = np.arange(samples) / RATE
    phase = 2.0 * np.pi * (0.3 * t + 0.5 * 2.7 / t[-1] * t**2)
    x, y = size * np.sin(phase), 0.6 * size * np.sin(0.8 * phase)
    return np.stack([x, y, -x, -y], axis=1)


def driven(path: Path, vehicle: ca.Vehicle, inputs: Any, columns: str) -> Path:
    """Write a motion from rest under inputs (samples, n) that are held, with noise of 0.3 mm."""
    settling = np.repeat(inputs[:1], 400, axis=0)
    command = np.concatenate([settling, inputs])
    blank = np.zeros((len(command), 4, 3))
    motion = DrivenMotion(
        name="", motion=blank, bench=BENCH, rate=RATE, kind="tendon_command", inputs=command
    )
    found = motion._clamped.markers_from(vehicle, np.zeros((1, 8)))[0, len(settling) :]
    placed = (found - np.asarray(vehicle.arms[0].mount)) @ FRAME + np.asarray(BENCH.base)
    placed += np.random.default_rng(0).normal(0.0, 3e-4, placed.shape)
    names = [f"{columns}_{number + 1}" for number in range(inputs.shape[1])]
    names += [f"{axis}{marker + 1}" for marker in range(4) for axis in "xyz"]
    time = 5.0 + np.arange(len(inputs)) / RATE
    rows = np.column_stack([time, inputs, placed.reshape(len(placed), -1)])
    lines = [",".join(["time", *names]), *(",".join(f"{x:.8g}" for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def with_tendons(**tendons: Any) -> ca.Vehicle:
    """Return the vehicle of the bench with a group of four tendons."""
    return bench_vehicle(tendon=[tendons])


def assert_recovered(found: Any, truth: Any) -> None:
    """Assert that estimates are known to 5 % and within 3 standard errors of the truth."""
    assert found.converged and not found.free
    assert (found.errors < 0.05 * truth).all(), found.errors / truth
    assert (np.abs(found.values - truth) < 3.0 * found.errors).all(), found.values / truth


@pytest.mark.long
def test_stiffness_and_damping_are_recovered_from_tensions(tmp_path: Path) -> None:
    """Recorded tensions include the pretension, which the vehicle's own does not change."""
    vehicle = with_tendons(**TENDONS)
    swings = swept(300, 0.6)
    path = driven(tmp_path / "sweep.csv", vehicle, 2.0 + swings, "tension")
    start = vehicle.replace({FIELDS[0]: 0.025, FIELDS[1]: 0.007, FIELDS[2]: 6e-4})
    start = start.replace({"arm.limb.tendon.pull.pretension": 1.0})
    motion = load_driven(path, start, BENCH)
    assert motion.measured(start).shape == (10, 30, 4, 3)
    found = fit_jointly(start, [motion], FIELDS[:3])
    assert_recovered(found, TRUE[:3])


@pytest.mark.long
def test_stiffness_and_pretension_of_winches_are_recovered(tmp_path: Path) -> None:
    """Of two tendons that bend the arm at rest: opposite pretensions would cancel."""
    vehicle = with_tendons(**WINCHES | {"angles": [0.0, 0.5 * np.pi]})
    path = driven(tmp_path / "sweep.csv", vehicle, swept(300, 2e-3)[:, :2], "tendon_command")
    fields = ["arm.limb.tendon.pull.stiffness", "arm.limb.tendon.0.pretension"]
    start = vehicle.replace({"arm.limb.tendon.pull.stiffness": 420.0})
    start = start.replace({"arm.limb.tendon.pull.pretension": 1.1})
    found = fit_jointly(start, [load_driven(path, start, BENCH)], fields)
    assert found.fields[1] == "arm.limb.tendon.pull.pretension"
    assert_recovered(found, np.array([300.0, 1.5]))


@pytest.mark.long
def test_a_pretension_that_changes_nothing_is_named(tmp_path: Path) -> None:
    """Those of opposite tendons cancel."""
    vehicle = with_tendons(**WINCHES | {"pretension": 5.0})
    path = driven(tmp_path / "sweep.csv", vehicle, swept(60, 2e-3), "tendon_command")
    fields = ["arm.limb.tendon.pull.stiffness", "arm.limb.tendon.pull.pretension"]
    found = fit_jointly(vehicle, [load_driven(path, vehicle, BENCH)], fields)
    assert [set(each) for each in found.free] == [{fields[1]}]
    assert np.isinf(found.errors[1]) and found.errors[0] < 30.0


def edited(path: Path, change: Any) -> Path:
    """Change the table of numbers of a file, by column."""
    heading, *rows = path.read_text("utf-8").splitlines()
    names = heading.split(",")
    values = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    table = change({name: values[:, index] for index, name in enumerate(names)})
    lines = [",".join(table)]
    lines += [
        ",".join(f"{value:.8g}" for value in row) for row in zip(*table.values(), strict=True)
    ]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


BAD: dict[str, tuple[str, Any]] = {
    "millimetres": ("data", lambda of: {n: 1e3 * v if n[0] in "xyz" else v for n, v in of.items()}),
    "no inputs": ("data", lambda of: {n: v for n, v in of.items() if n[:7] != "tension"}),
    "one tension missing": (
        "tension_3",
        lambda of: {n: v for n, v in of.items() if n[-2:] != "_3"},
    ),
    "two kinds": ("data", lambda of: of | {"tendon_command_1": of["tension_1"]}),
    "a tension below 0": ("tension", lambda of: of | {"tension_2": -of["tension_2"]}),
    "a gap in an input": ("tension", lambda of: of | {"tension_2": np.nan * of["tension_2"]}),
    "uneven times": ("time", lambda of: of | {"time": of["time"] ** 2}),
    "a gap at the start": ("data", lambda of: of | {"x1": np.nan * of["x1"]}),
    "too short": ("data", lambda of: {n: v[:20] for n, v in of.items()}),
    "more markers": ("data", lambda of: of | {"x5": of["x4"]}),
    "fewer markers": ("z4", lambda of: {n: v for n, v in of.items() if n != "z4"}),
}


@pytest.mark.parametrize("what", BAD)
def test_a_file_that_cannot_be_used_is_refused(tmp_path: Path, what: str) -> None:
    field, change = BAD[what]
    vehicle, rows = with_tendons(**TENDONS), 40
    names = ["time", *(f"tension_{n + 1}" for n in range(4))]
    names += [f"{axis}{marker + 1}" for marker in range(4) for axis in "xyz"]
    down = np.zeros((rows, 4, 3)) + np.asarray(BENCH.base)
    down[..., 1] -= np.asarray(BENCH.markers)
    time = np.arange(rows) / RATE
    table = np.column_stack([time, np.ones((rows, 4)), down.reshape(rows, -1)])
    path = tmp_path / "sweep.csv"
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="")
    assert load_driven(path, vehicle, BENCH).motion.shape == (rows, 4, 3)
    with refused(field, place=path):
        load_driven(edited(path, change), vehicle, BENCH)


def test_a_payload_below_0_is_refused(tmp_path: Path) -> None:
    with refused("payload"):
        load_driven(tmp_path / "sweep.csv", with_tendons(**TENDONS), BENCH, payload=-1.0)


@pytest.mark.long
def test_a_tendons_stiffness_is_recovered_from_a_flight(tmp_path: Path) -> None:
    """From a CSV file with columns of the tendons' commands, without noise."""
    vehicle, rows = with_tendons(**WINCHES), 80
    time, commands = np.arange(rows) / RATE, swept(rows, 4e-3)

    def held(t: float) -> Any:
        return commands[min(int(t * RATE + 1e-6), rows - 1)]

    scenario = ca.Scenario(
        "flight",
        np.zeros(10),
        force=(0.0, 0.0, 9.81 * vehicle.mass),
        tendon_command=held,
        jumps=tuple(time[1:-1].tolist()),
        duration=float(time[-1]),
    )
    flight = ca.simulate(vehicle, scenario, sample=1.0 / RATE, rtol=1e-9)
    path = tmp_path / "flight.csv"
    pose = [flight[name].to_numpy() for name in ("position", "attitude")]
    bend = flight["bend"].to_numpy().reshape(rows, 4)
    names = ["time", "x", "y", "z", "qx", "qy", "qz", "qw", "bend_x_1", "bend_y_1", "bend_x_2"]
    names += ["bend_y_2", "force_z", *(f"tendon_command_{number + 1}" for number in range(4))]
    weight = np.full(rows, 9.81 * vehicle.mass)
    table = np.column_stack([time, *pose, bend, weight, commands])
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="")
    field = "arm.limb.tendon.pull.stiffness"
    found = fit(vehicle.replace({field: 400.0}), load_recording(path, vehicle), [field])
    assert found.values == pytest.approx(np.array([300.0]), rel=1e-4)
    assert found.converged
    with refused("tendon_command"):
        fit(bench_vehicle(), load_recording(path, vehicle), [FIELDS[0]])


@pytest.mark.parametrize("kind", ["bend_moment", "tension"])
def test_a_vehicle_with_other_inputs_than_the_motion_is_refused(kind: str) -> None:
    """As where models with different strains are compared on a sweep by bend moments."""
    motion = DrivenMotion(
        name="sweep",
        motion=np.zeros((40, 4, 3)),
        bench=BENCH,
        rate=RATE,
        kind=kind,
        inputs=np.zeros((40, 2)),
    )
    with refused(kind, place="sweep"):
        motion.predictor(with_tendons(**TENDONS))
