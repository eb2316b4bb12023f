"""Euler angles at a pitch of ±π/2 describe the attitude, though roll and yaw are one turn there."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.vehicle.coordinates import continuous_euler

VEHICLE = ca.load_vehicle("paper")
turns_untold = pytest.mark.filterwarnings("ignore:q. roll, pitch and yaw are not followed")


def off(euler: Any, attitude: Any) -> Any:
    """Angle between attitudes (…, 4) and those of ZYX triples (…, 3) [rad]."""
    described = Rotation.from_euler("ZYX", np.reshape(euler, (-1, 3))[:, ::-1])
    return (described.inv() * Rotation.from_quat(np.reshape(attitude, (-1, 4)))).magnitude()


def upright(up: float) -> ca.Scenario:
    q = [0, 0, 5, 0.3, up * np.pi / 2, 0.2, 0.3, 0.4]
    return ca.Scenario("pole", q, [0, 0, 0, 0.5, 0.7, -0.3, 0, 0], duration=0.2)


@pytest.mark.parametrize("up", [1.0, -1.0])
@pytest.mark.parametrize("apart", [0.0, 1e-17, 1e-12, 1e-9, 1e-8, 1e-6, 9e-4])
@pytest.mark.parametrize(("length", "tolerance"), [(1.0, 1e-8), (1.0 + 6e-8, 1e-8)])
def test_angles_near_a_pole_are_those_of_the_attitude(
    up: float, apart: float, length: float, tolerance: float
) -> None:
    """Also of a quaternion whose length is off by the rounding of float32."""
    euler = np.random.default_rng(4).uniform(-np.pi, np.pi, (500, 3))
    euler[:, 1] = up * (np.pi / 2 - apart)
    attitude = Rotation.from_euler("ZYX", euler[:, ::-1]).as_quat()
    found = continuous_euler(length * attitude[:, None])[:, 0]
    assert off(found, attitude).max() < tolerance


@turns_untold
@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_flight_through_a_pole_has_the_coordinates_of_its_attitude(up: float) -> None:
    flight = ca.simulate(VEHICLE, upright(up), sample=0.02, variables=["q", "attitude"])
    assert off(flight.q[:, 3:6], flight.attitude).max() < 1e-8
    sim = ca.Simulation(VEHICLE, upright(up), control_period=0.02)
    assert off(sim.q[3:6], sim.state[3:7]).max() < 1e-8
    for _ in range(5):
        sim.step(np.zeros(8))
        assert off(sim.q[3:6], sim.state[3:7]).max() < 1e-8


def test_a_pitch_through_a_pole_keeps_roll_and_yaw() -> None:
    pitch = np.pi / 2 + 0.1 * np.arange(-3, 4)
    attitude = Rotation.from_euler("ZYX", np.stack([0 * pitch + 0.2, pitch, 0 * pitch + 0.3], 1))
    euler = continuous_euler(attitude.as_quat())
    np.testing.assert_allclose(euler, np.stack([0 * pitch + 0.3, pitch, 0 * pitch + 0.2], 1))


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_euler_angles_have_no_rates_at_a_pole(up: float) -> None:
    rates = ca.Simulation(VEHICLE, upright(up)).qd
    assert np.isnan(rates[3:6]).all()
    assert np.isfinite(np.delete(rates, [3, 4, 5])).all()
