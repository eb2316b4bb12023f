"""A vehicle replayed through its own flight does what it did, and nothing is left over."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.identification.recording import MEASURED, Recording, load_recording
from continuair.identification.replay import START, Replay
from tests.identification.flights import true_vehicle, write
from tests.refusals import refused

pytestmark = pytest.mark.targets

VEHICLE = true_vehicle()
SPIN = 400.0
"""Of the UAV about its axis at the start [rad/s]."""


def spinning() -> tuple[Recording, np.ndarray]:
    """A hover of the vehicle that spins, its arm straight, and the start (1, START)."""
    weight = [0.0, 0.0, 9.81 * float(VEHICLE.mass)]
    rates = (0.0, 0.0, 0.0, 0.0, 0.0, SPIN, 0.0, 0.0)
    scenario = ca.Scenario("spin", [0.0] * 8, rates, force=weight, duration=0.05)
    flown = ca.simulate(VEHICLE, scenario, sample=1e-3, method="RK4", step=2e-5)
    names = ("time", "position", "attitude", "bend")
    time, position, attitude, bend = (flown[name].to_numpy() for name in names)
    inputs = np.tile([*weight, *[0.0] * 5], (len(time), 1))
    start = np.zeros((1, START))
    start[0, 13] = SPIN
    return Recording("spin", time, position, attitude, bend, inputs), start


def test_a_fast_spin_at_the_start_is_replayed_in_steps_that_resolve_it() -> None:
    recording, start = spinning()
    left = Replay(VEHICLE, recording, None).residuals(VEHICLE, start, 1)
    # Steps of 0.1 of the spin's period over 2π err by 4e-7 rad in these 20 rad; the milliseconds
    # that the arm alone allows, by 3e-4.
    assert np.abs(left).max() < 1e-5


def test_a_recording_may_start_at_a_pitch_without_euler_rates() -> None:
    recording, _ = spinning()
    up = Rotation.from_euler("y", np.pi / 2)
    attitude = (up * Rotation.from_quat(recording.attitude)).as_quat()
    upright = Replay(VEHICLE, dataclasses.replace(recording, attitude=attitude), None)
    assert upright.step == pytest.approx(Replay(VEHICLE, recording, None).step, rel=1e-9)


def test_inputs_are_held_from_each_row_to_the_next_so_that_the_last_row_pushes_nothing() -> None:
    recording, start = spinning()
    left = Replay(VEHICLE, recording, None).residuals(VEHICLE, start, 1)
    assert recording.inputs is not None
    recording.inputs[-1] = 1e3
    again = Replay(VEHICLE, recording, None).residuals(VEHICLE, start, 1)
    np.testing.assert_array_equal(again, left)
    recording.inputs[-2] = 1e3
    pushed = Replay(VEHICLE, recording, None).residuals(VEHICLE, start, 1)
    changed = np.abs(pushed - left).max((0, 2)) > 1e-6
    assert changed[-1] and not changed[:-1].any()


def test_recorded_thrusts_of_rotors_fly_with_their_limits_and_lag(tmp_path: Path) -> None:
    rotors = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 14.0], "lag": 0.04}
    flying = VEHICLE.replace({"uav.rotors": rotors | {"torque_per_thrust": 0.05}})
    time = 0.01 * np.arange(11)
    hover = 9.81 * float(flying.mass) / 4.0
    thrusts = hover + 2.0 * np.sin(20.0 * time[:, None] + np.arange(4.0))

    def held(t: float) -> np.ndarray:
        return np.asarray(thrusts[int(np.searchsorted(time, t, side="right")) - 1])

    scenario = ca.Scenario(
        "flown", [0.0] * 8, rotor_command=held, jumps=tuple(time[1:-1]), duration=0.1
    )
    found = ca.simulate(flying, scenario, sample=0.01, method="RK4", step=5e-4)
    names = tuple(f"rotor_command_{rotor}" for rotor in (1, 2, 3, 4))
    write(tmp_path / "flight.csv", found, thrusts, (*MEASURED, *names), None)
    recording = load_recording(tmp_path / "flight.csv", flying)
    left = Replay(flying, recording, None).residuals(flying, np.zeros((1, START)), 1)
    assert np.abs(left).max() < 1e-8


def still(**changes: Any) -> Recording:
    """Three rows of a vehicle at rest."""
    fields: dict[str, Any] = {
        "time": [0.0, 0.1, 0.2],
        "position": np.zeros((3, 3)),
        "attitude": [[0.0, 0.0, 0.0, 1.0]] * 3,
        "bend": np.zeros((3, 2)),
        "inputs": None,
    }
    return Recording("still", **(fields | changes))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"time": [5.0, 5.1, 5.2]}, "time"),
        ({"time": [0.0, 0.2, 0.1]}, "time"),
        ({"position": [[0.0] * 3, [np.nan] * 3, [0.0] * 3]}, "position"),
        ({"position": np.ma.masked_equal(np.zeros((3, 3)), 0.0)}, "position"),
        ({"position": np.zeros((2, 3))}, "position"),
        ({"attitude": [[0.0, 0.0, 0.0, 1.1]] * 3}, "attitude"),
        ({"bend": np.zeros(3)}, "bend"),
        ({"inputs": np.zeros((3, 6))}, "inputs"),
        ({"rotor_command": np.zeros((2, 4))}, "rotor_command"),
    ],
)
def test_a_recording_that_no_file_could_hold_is_refused(changes: dict[str, Any], told: str) -> None:
    assert still().position.shape == (3, 3)
    with refused(told):
        still(**changes)
