"""The hold and the visual servoing of vehicles with several sections and arms."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.controllers.gains import bend_inertia

TWO, DUAL = (ca.load_vehicle(name) for name in ("two_section", "dual_arm"))
POSITION, ATTITUDE = [0.3, -0.2, 4.0], Rotation.from_euler("ZYX", [1.0, 0.2, -0.1])
START = [0.1, 0.0, 3.1, 0, 0, 0, 0.3, 0.4, 0.5, -1.0]


def held(vehicle: ca.Vehicle, bend: Any, duration: float = 10.0, **rates: Any) -> xr.Dataset:
    law = ca.hold(vehicle, POSITION, ATTITUDE.as_quat(), bend, **rates)
    scenario = ca.Scenario("hold", START, duration=duration, controller=law)
    return ca.simulate(vehicle, scenario, sample=0.01)


@pytest.mark.parametrize(
    ("vehicle", "bend"),
    [(TWO, [0.5, -0.3, -0.8, 0.4]), (DUAL, [0.3, 0.2, -0.4, 0.1])],
    ids=lambda value: getattr(value, "name", None),
)
def test_it_reaches_position_attitude_and_every_bend_and_keeps_them(
    vehicle: ca.Vehicle, bend: list[float]
) -> None:
    run = held(vehicle, bend).isel(time=slice(900, None))
    assert run.status == 0
    # A loop of 3 rad/s leaves (1 + 27) exp(-27) = 5e-11 of its start.
    np.testing.assert_allclose(run.position, np.tile(POSITION, (101, 1)), rtol=0, atol=1e-8)
    np.testing.assert_allclose(
        run.bend, np.tile(np.reshape(bend, (2, 2)), (101, 1, 1)), rtol=0, atol=1e-8
    )
    turn = Rotation.from_quat(run.attitude.to_numpy()) * ATTITUDE.inv()
    assert turn.magnitude().max() < 1e-8


@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_bend_inertia_is_what_moments_on_the_bends_move_on_a_clamped_base(
    vehicle: ca.Vehicle,
) -> None:
    state: dict[str, Any] = {"bend": np.zeros((2, 2)), "model": "independent", "gravity": 0.0}
    answers = [
        np.ravel(ca.accelerations(vehicle, **state, bend_moment=unit.reshape(2, 2))[2])
        for unit in np.eye(4)
    ]
    np.testing.assert_allclose(np.stack(answers) @ bend_inertia(vehicle), np.eye(4), atol=1e-6)


def test_every_section_gets_to_its_bend_at_the_rate_that_was_asked_for_it() -> None:
    """On a base too heavy to be moved, critically damped loops leave (1 + w t) exp(-w t), where the
    arm has next to no spring of its own."""
    heavy = TWO.replace({"uav.mass": 1e4, "uav.inertia": [1e4] * 3})
    heavy = heavy.replace({f"arm.0.section.{k}.youngs_modulus": 1.0 for k in (0, 1)})
    small = np.array([0.02, 0.01, -0.01, 0.03])
    law = ca.hold(heavy, [0, 0, 3], bend=np.zeros(4), bend_rate=[4.0, 6.0])
    q = np.zeros(10)
    q[2], q[6::2] = 3.0, np.hypot(small[::2], small[1::2])
    q[7::2] = np.arctan2(small[1::2], small[::2])
    scenario = ca.Scenario("rates", q, duration=0.5, controller=law, control_period=None)
    run = ca.simulate(heavy, scenario, sample=0.5)
    left = [(1 + w * 0.5) * np.exp(-w * 0.5) for w in (4.0, 4.0, 6.0, 6.0)]
    # The bends are small, not 0: angles of 0.01 make some ten-thousandths.
    np.testing.assert_allclose(run.bend[-1].to_numpy().ravel() / small, left, rtol=2e-3)


def test_an_arm_whose_rate_is_zero_is_left_to_its_spring() -> None:
    run = held(DUAL, [0.0, 0.0, -0.4, 0.1], duration=1.0, bend_rate=[0.0, 5.0])
    pushed = run.command.sel(actuator=["bend_moment_x_1", "bend_moment_y_1"])
    arm = DUAL.arms[0].section[0]
    # What is left is the weight's moment on the bend, at most m g l²/6.
    assert np.abs(pushed).max() < 9.81 * arm.mass * arm.length**2 / 6


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ({"bend": [0.1, 0.2]}, r"bend is \[0.1, 0.2\]; give 4 finite numbers"),
        ({"bend_rate": [1.0, 2.0, 3.0]}, "bend_rate is .*; give a finite number .*, or 2 of them"),
        ({"bend_rate": [1.0, -2.0]}, r"bend_rate is \[1.0, -2.0\]; give rates of 0 or more"),
    ],
)
def test_a_hold_for_other_bends_is_refused_in_one_sentence(
    arguments: dict[str, Any], problem: str
) -> None:
    with pytest.raises(ca.InputError, match=problem):
        ca.hold(TWO, POSITION, **arguments)


def test_a_hold_of_another_vehicle_is_refused_in_one_sentence() -> None:
    law = ca.hold(ca.load_vehicle("paper"), POSITION)
    with pytest.raises(
        ca.InputError, match="the vehicle's sections call for .4,.; make the contro"
    ):
        ca.simulate(TWO, ca.Scenario("hold", START, controller=law))
