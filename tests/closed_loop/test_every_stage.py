"""A law at every stage of a step: what ends its flights and what it asks hang on no sample."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.errors import ContinuairWarning
from tests.closed_loop import flights


@pytest.mark.long
@pytest.mark.parametrize("sample", [pytest.param(0.01, marks=pytest.mark.soak), 0.05, 0.6])
def test_points_are_lost_when_they_are_whatever_the_samples(sample: float) -> None:
    """As of a law that acts at 1 kHz: the target flees faster than the camera follows."""

    def fleeing(t: float) -> list[float]:
        return [2.2 * np.sin(np.pi * t) ** 2, 0.0, 0.0]

    target = ca.Target(ca.paths.from_function(fleeing, 4.0))
    law = ca.classic(flights.VEHICLE, rate=0.3, inner=2.0)
    runs = [
        ca.simulate(
            flights.VEHICLE,
            ca.Scenario(
                "lost",
                [0, 0, 3, 0, 0, 0, 0, 0],
                controller=law,
                target=target,
                control_period=period,
                duration=0.6,
            ),
            sample=sample,
            method="RK4",
            step=1e-3,
        )
        for period in (1e-3, None)
    ]
    assert [int(run.status) for run in runs] == [3, 3]
    assert abs(float(runs[0].end_time) - float(runs[1].end_time)) < 1.5e-3


@pytest.mark.long
def test_rotors_that_saturate_between_samples_are_told_of() -> None:
    rotors: dict[str, Any] = {"layout": "hex_tilted", "lever": 0.3, "tilt": 0.35}
    rotors |= {"thrust_limits": [0.0, 12.0], "torque_per_thrust": 0.02, "lag": 0.02}
    vehicle = flights.VEHICLE.replace({"uav.rotors": rotors})
    scenario = ca.Scenario(
        "knock",
        [0, 0, 3, 0, 0, 0, 0, 0],
        force=lambda t: [60.0 if 0.1 < t < 0.15 else 0.0, 0.0, 0.0],
        jumps=(0.1, 0.15),
        controller=ca.hold(vehicle, [0, 0, 3]),
        control_period=None,
        duration=1.0,
    )
    largest = []
    for sample in (1e-3, 1.0):
        with pytest.warns(ContinuairWarning, match="saturate"):
            run = ca.simulate(vehicle, scenario, sample=sample, method="RK4", step=1e-3)
        largest.append(float(run.largest_saturation))
    assert largest[1] == pytest.approx(largest[0], rel=1e-9)
    assert float(run.saturation.max()) < 0.01 * largest[1]  # samples miss it
