"""A vehicle is found from a recording that begins while its lagging rotors change their speed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import continuair as ca
from continuair.identification.fitting import fit
from continuair.identification.recording import Recording
from continuair.identification.replay import Replay
from tests.identification.flights import true_vehicle

pytestmark = pytest.mark.targets

LAG = 0.05
ROTORS = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 14.0],
          "torque_per_thrust": 0.05, "lag": LAG}  # fmt: skip
VEHICLE = true_vehicle().replace({"uav.rotors": ROTORS})
ROWS = 25


def switched_off() -> tuple[Recording, np.ndarray]:
    """The rows of a flight from where its rotors are switched off for 0.1 s, and their speeds
    (rotors,), over the greatest, at the first of them."""
    time = 0.01 * np.arange(ROWS + 21)
    hover = 9.81 * float(VEHICLE.mass) / 4.0
    thrusts = hover + 1.5 * np.sin(9.0 * time[:, None] + np.array([0.0, 1.0, 2.5, 4.0]))
    thrusts[20:30] = 0.0

    def held(t: float) -> np.ndarray:
        return np.asarray(thrusts[int(np.searchsorted(time, t, side="right")) - 1])

    q = (0.3, -0.2, 5.0, 0.05, -0.04, 0.2, 0.8, 0.5)
    scenario = ca.Scenario("off", q, rotor_command=held, jumps=tuple(time[1:-1]), duration=time[-1])
    flown = ca.simulate(VEHICLE, scenario, sample=0.01, method="RK4", step=5e-4)
    names = ("position", "attitude", "bend", "rotor_thrust")
    position, attitude, bend, thrust = (flown[name].to_numpy()[20:] for name in names)
    inputs = np.zeros((ROWS + 1, 8))
    recording = Recording(
        "off", time[20:] - time[20], position, attitude, bend, inputs, thrusts[20:]
    )
    return recording, np.sqrt(thrust[0] / 14.0)


@pytest.mark.long
def test_rotors_that_slow_down_at_the_first_row_do_not_spoil_a_fit() -> None:
    recording, speeds = switched_off()
    assert speeds.min() > 0.4
    found = fit(VEHICLE.replace({"uav.mass": 2.0}), recording, ("uav.mass",))
    # As if they stood still already, the mass comes out some percent too small.
    np.testing.assert_allclose(found.values, [1.6], rtol=1e-5)
    assert found.converged and not found.doubts


def test_commands_of_rotors_are_inputs_enough() -> None:
    """A recording without a column of forces is that of one where these are 0."""
    recording, _ = switched_off()
    alone, beside = (
        Replay(VEHICLE, dataclasses.replace(recording, inputs=inputs), None)
        for inputs in (None, recording.inputs)
    )
    assert len(alone.first) > 6
    np.testing.assert_array_equal(alone.first, beside.first)
    assert alone.step == beside.step
