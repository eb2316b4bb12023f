"""What frequencies advice is tried at."""

import numpy as np
import pytest

import continuair as ca
from continuair.analysis.excited import excited_arm
from continuair.studies.advise import excitations, frequencies
from continuair.studies.excited_flights import Loop, flown_errors, least_periods


def stiff() -> ca.Vehicle:
    """A short carbon arm under a quadrotor, thirty times as fast as the loop that holds it."""
    arm: dict[str, object] = {
        "length": 0.15,
        "radius": 0.003,
        "density": 1600.0,
        "youngs_modulus": 60e9,
    }
    arm |= {"damping_ratio": 0.02, "disks": [{"position": 0.15, "mass": 0.1}]}
    uav = {"mass": 1.0, "inertia": [0.008, 0.009, 0.015], "mount": [0.0, 0.0, -0.03]}
    return ca.Vehicle(name="stiff", uav=uav, arm=arm)


def test_slow_loads_are_tried_down_to_the_slowest_motion_of_the_loop() -> None:
    """Far below the frequency of a stiff arm a model does to the loop what the vehicle does not:
    without the arm's weight at the UAV, its feedforward sways it."""
    vehicle, loop = stiff(), Loop("position")
    places, periods = frequencies.tried(vehicle, loop)
    clamped = float(excited_arm(vehicle).frequency)
    slowest = 2.5 * 0.2
    assert slowest / 1.5 <= places[0] * clamped <= slowest
    assert np.diff(np.log(places)).max() < np.log(1.51)
    np.testing.assert_array_equal(places[-20:], frequencies.SCAN)
    np.testing.assert_allclose(periods[:-20], 5.0 / places[:-20])
    swaying = 2.0 * np.pi * 0.2 / clamped
    errors = flown_errors(vehicle, "bend", np.array([swaying]), loop, 5.0 / swaying)
    assert errors["independent"] > 5.0 * errors["decoupled"]
    _, none = frequencies.tried(vehicle, Loop())
    assert len(none) == 20 and not none.any()


def test_resonances_of_another_arm_are_tried_and_flown_until_they_have_swollen() -> None:
    section = {"length": 0.4, "mass_per_length": 0.06, "bending_stiffness": 6.0}
    whip = {"length": 0.4, "mass_per_length": 0.008, "bending_stiffness": 0.12}
    arms = [
        {"name": "main", "section": [section | {"damping_ratio": 0.02}]},
        {"name": "whip", "mount": [0.1, 0, 0], "section": [whip | {"damping_ratio": 0.004}]},
    ]
    uav = {"mass": 2.5, "inertia": [0.03, 0.03, 0.05]}
    vehicle = ca.Vehicle(name="whip", uav=uav, arm=arms, camera={"arm": "main"})
    places, periods = frequencies.tried(vehicle, Loop("position"))
    clamped = float(excited_arm(vehicle).frequency)
    swings = ca.modes(vehicle, ca.trim(vehicle).q, base="hovering")
    whips = (swings.frequencies > 0.1 * clamped) & (swings.frequencies < 0.9 * clamped)
    assert whips.any()
    for frequency, ratio in zip(swings.frequencies[whips], swings.damping[whips], strict=True):
        near = np.argmin(np.abs(places * clamped - frequency))
        assert places[near] * clamped == pytest.approx(frequency, rel=0.02)
        decays = periods[near] * 2.0 * np.pi * places[near] * ratio
        assert decays > 4.5


def test_flights_that_last_alike_are_simulatedtogether_and_long_enough() -> None:
    places = np.array([0.02, 0.05, 0.06, 0.4, 0.6, 1.7, 2.9])
    periods = np.array([250.0, 0.0, 0.0, 0.0, 0.0, 90.0, 0.0])
    needed = np.maximum(least_periods(places), periods)
    parts = list(excitations.together("bend", places, Loop("position"), periods))
    assert sorted(np.concatenate([at for at, _ in parts])) == list(range(len(places)))
    assert len(parts) < len(places)
    for at, lasting in parts:
        assert lasting == needed[at].max() < 3.2 * needed[at].min()
