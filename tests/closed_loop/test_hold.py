"""The hold controller: where it goes, and that it stays."""

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from tests.closed_loop import flights

POSITION, BEND = [0.3, -0.2, 4.0], [0.4, -0.3]
ATTITUDE = Rotation.from_euler("ZYX", [2.0, 0.2, -0.1])


def held(bend_rate: float = 5.0, duration: float = 10.0) -> xr.Dataset:
    vehicle = flights.VEHICLE.replace({"uav.mount": [0.02, 0.01, -0.05]})
    controller = ca.hold(vehicle, POSITION, ATTITUDE.as_quat(), BEND, bend_rate=bend_rate)
    scenario = ca.Scenario("hold", flights.start(), duration=duration, controller=controller)
    return ca.simulate(vehicle, scenario)


def test_it_reaches_position_attitude_and_bend_and_keeps_them() -> None:
    run = held().isel(time=slice(8000, None))
    # A loop of 3 rad/s leaves (1 + 24) exp(-24) = 1e-9 of its start, and the bend's less.
    np.testing.assert_allclose(
        run.position, np.tile(POSITION, (len(run.time), 1)), rtol=0, atol=2e-8
    )
    np.testing.assert_allclose(run.bend, np.tile(BEND, (len(run.time), 1)), rtol=0, atol=2e-10)
    turn = Rotation.from_quat(run.attitude.to_numpy()) * ATTITUDE.inv()
    assert turn.magnitude().max() < 1e-8


def test_it_gets_there_at_the_rate_that_was_asked_for() -> None:
    """A critically damped loop of 3 rad/s leaves (1 + 3 t) exp(-3 t) of the distance."""
    run = held(duration=2.0)
    distance = np.linalg.norm(run.position - POSITION, axis=-1)
    left = (1 + 6.0) * np.exp(-6.0)
    assert distance[-1] / distance[0] == pytest.approx(left, rel=0.1)


def test_without_a_bend_rate_the_arm_is_left_to_its_spring() -> None:
    run = held(bend_rate=0.0)
    bend_moments = run.command.to_numpy()[:, 6:]
    # What is left is the weight's moment on the bend, at most m g l²/6.
    arm = flights.VEHICLE.arm
    assert np.abs(bend_moments).max() < 9.81 * arm.mass * arm.length**2 / 6
    np.testing.assert_allclose(run.bend[-1], 0.0, rtol=0, atol=1e-11)


def test_a_blind_controller_flies_on_when_the_points_are_lost() -> None:
    controller = ca.hold(flights.VEHICLE, [5.0, 0.0, 3.0])
    run = ca.simulate(flights.VEHICLE, flights.scenario(controller, duration=4.0))
    assert run.status == 0
    assert run.in_view[-1].sum() == 0
    assert abs(float(run.position[-1, 0]) - 5.0) < 0.01


def test_a_law_at_every_stage_pushes_at_the_end_as_in_a_longer_flight() -> None:
    vehicle = ca.load_vehicle("paper")
    start, law = [0.1, 0, 3, 0, 0, 0, 0.3, 0.2], ca.hold(vehicle, [0, 0, 3])
    scenario = ca.Scenario("hold", start, controller=law, control_period=None)
    short, long = (
        ca.simulate(vehicle, scenario, duration=end, step=1e-4, sample=5e-3, variables=["command"])
        for end in (0.05, 0.1)
    )
    np.testing.assert_allclose(short["command"][-1], long["command"][10], rtol=1e-12, atol=1e-12)
