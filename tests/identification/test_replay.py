"""A vehicle replayed through its own flight does what it did, and nothing is left over."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.identification.recording import Recording
from continuair.identification.replay import START, Replay
from tests.identification.flights import true_vehicle

pytestmark = pytest.mark.targets

VEHICLE = true_vehicle()
SPIN = 400.0
"""Of the UAV about its axis at the start [rad/s]."""


def spinning() -> tuple[Recording, np.ndarray]:
    """A hover of the vehicle that spins, its arm straight, and the start (1, START)."""
    weight = [0.0, 0.0, 9.81 * float(VEHICLE.mass)]
    rates = (0.0, 0.0, 0.0, 0.0, 0.0, SPIN, 0.0, 0.0)
    scenario = ca.Scenario("spin", [0.0] * 8, rates, force=weight, duration=0.05)
    flown = ca.simulate(VEHICLE, scenario, sample=1e-3, step=2e-5)
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
