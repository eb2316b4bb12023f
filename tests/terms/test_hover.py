"""A vehicle whose terms depend on its place starts its rotors where it is."""

import numpy as np
import pytest

import continuair as ca
from tests.terms.tip_spring import TipSpring

ROTORS = {
    "layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 12.0],
    "torque_per_thrust": 0.016, "lag": 0.04,
}  # fmt: skip
VEHICLE = ca.load_vehicle("paper").replace({"uav.rotors": ROTORS, "uav.mass": 1.5})


def thrusts(height: float, yaw: float) -> np.ndarray:
    """Thrusts of a hover with a spring from the tip to a point ahead of it and to its left."""
    ahead = np.array([0.3 * np.cos(yaw) - 0.1 * np.sin(yaw), 0.3 * np.sin(yaw) + 0.1 * np.cos(yaw)])
    length = float(VEHICLE.arms[0].section[0].length)
    point = (float(ahead[0]), float(ahead[1]), height - length + float(VEHICLE.uav.mount[2]))
    tied = VEHICLE.replace({"terms": (TipSpring(0.5, point),)})
    start = ca.Scenario("hover", [0, 0, height, 0, 0, yaw, 1e-9, 0], duration=0.01)
    flight = ca.simulate(tied, start, sample=0.01, variables=["rotor_thrust"])
    return flight.rotor_thrust[0].to_numpy()


def test_thrusts_of_a_hover_go_with_place_and_heading() -> None:
    here = thrusts(0.0, 0.0)
    assert np.ptp(here) > 0.01
    for height, yaw in ((2.0, 0.0), (0.0, 1.2), (2.0, -2.5)):
        assert thrusts(height, yaw) == pytest.approx(here, abs=1e-6)
