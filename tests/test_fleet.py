"""Flights that are stepped together do what each does alone."""

from __future__ import annotations

import numpy as np
import pytest

import continuair as ca
from continuair.flight.fleet import Fleet
from continuair.kernels.dynamics import MODELS
from continuair.kernels.step import OK
from continuair.typing import Model

pytestmark = pytest.mark.targets

VEHICLE = ca.load_vehicle("slender").replace(
    {
        "uav.rotors": {
            "layout": "quad_x",
            "lever": 0.2,
            "thrust_limits": (0.0, 12.0),
            "torque_per_thrust": 0.016,
            "lag": 0.04,
        }
    }
)
PERIOD = 0.02


def starts(runs: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    q = rng.uniform(-0.3, 0.3, (runs, 8))
    q[:, 6] = rng.uniform(-0.8, 0.8, runs)
    return q, rng.uniform(-0.5, 0.5, (runs, 8))


@pytest.mark.parametrize(
    "model", [pytest.param(m, marks=[pytest.mark.soak] * (m != "coupled")) for m in MODELS]
)
def test_a_fleet_flies_as_simulations_do(model: Model) -> None:
    fleet, (q, qd) = Fleet(VEHICLE, 11, period=PERIOD, model=model), starts(11)
    fleet.begin(np.arange(11), q, qd)
    hover = 9.81 * float(VEHICLE.mass) / 4.0
    commands = hover + np.random.default_rng(6).uniform(-2.0, 2.0, (10, 11, 4))
    for command in commands:
        fleet.step(rotor_command=command)
    step = fleet.step_length
    for run in (0, 10):
        scenario = ca.Scenario("one", q[run], qd[run], rotor_thrust=[hover] * 4)
        alone = ca.Simulation(VEHICLE, scenario, model=model, step=step, control_period=PERIOD)
        for command in commands[:, run]:
            alone.step(rotor_command=command)
        # Later periods have other bits in their steps.
        np.testing.assert_allclose(fleet.states[run], alone.state, rtol=1e-10, atol=1e-10)
        tip = alone.trajectory()["tip_position"].to_numpy()[-1]
        np.testing.assert_allclose(fleet.tips()[run, 0], tip, atol=1e-10)


def test_a_run_has_the_same_numbers_in_any_fleet_and_whenever_others_begin() -> None:
    q, qd = starts(7)
    many, one = Fleet(VEHICLE, 7, period=PERIOD), Fleet(VEHICLE, 1, period=PERIOD)
    many.begin(np.arange(7), q, qd)
    one.begin(np.arange(1), q[4:5], qd[4:5])
    for step in range(20):
        if step == 10:
            many.begin(np.array([1, 3]), q[:2], qd[:2])
        many.step(rotor_command=np.full((7, 4), 5.0))
        one.step(rotor_command=np.full((1, 4), 5.0))
    np.testing.assert_allclose(many.states[4], one.states[0], rtol=1e-12, atol=1e-12)


def test_a_run_that_ends_stays_where_it_was_until_it_is_begun() -> None:
    fleet, (q, qd) = Fleet(VEHICLE, 3, period=PERIOD), starts(3)
    qd[1, 6] = 2000.0  # bends beyond a full circle
    fleet.begin(np.arange(3), q, qd)
    for _ in range(10):
        fleet.step(rotor_command=np.full((3, 4), 5.0))
    assert (fleet.status == OK).tolist() == [True, False, True]
    assert np.isfinite(fleet.states).all()
    stopped = fleet.states[1].copy()
    fleet.step(rotor_command=np.full((3, 4), 5.0))
    np.testing.assert_array_equal(fleet.states[1], stopped)
    fleet.begin(np.array([1]), q[:1], qd[:1])
    assert fleet.status[1] == OK
