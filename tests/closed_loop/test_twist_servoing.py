"""Servoing by twists: a vehicle that must tilt to move brings its image home and follows it."""

import numpy as np
import pytest

import continuair as ca
from continuair.equations.camera import facing
from tests.closed_loop.test_flight_controller import QUAD

DAMPED = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
ROTORS = DAMPED.replace({"uav.rotors": QUAD | {"thrust_limits": [0.2, 14.0]}})


def starts(vehicle: ca.Vehicle, target: ca.Target) -> np.ndarray:
    """A bent arm alone; off to all sides; turned by 0.6 rad; all together."""
    q = np.zeros((4, 6 + 2 * vehicle.sections))
    q[:, :3], q[:, 3:6] = facing(vehicle, target.path(0.0)[0][0], target.distance)
    q[:, 6] = 0.1
    q[1, :3] += [0.4, -0.3, 0.2]
    q[2, 5] = 0.6
    q[3, [0, 2, 5]] += [0.3, 0.5, -0.5]
    return q


@pytest.mark.parametrize("vehicle", [ROTORS, ca.load_vehicle("two_section")], ids=lambda v: v.name)
def test_the_image_comes_home_at_the_rate_that_was_asked_for(vehicle: ca.Vehicle) -> None:
    """Rotors that lag by 40 ms; and two soft sections, whose bends are more than the camera needs.

    From the bent start nothing else is off, and the error e-folds once in 2 s.
    """
    target = ca.Target(ca.paths.hold())
    law = ca.twist_servoing(vehicle, 0.5)
    scenario = ca.Scenario(
        "home", starts(vehicle, target), controller=law, target=target, duration=20.0
    )
    run = ca.simulate(vehicle, scenario, sample=0.02, variables=["feature_error", "q"])
    assert (run.status == 0).all()
    error = np.abs(run.feature_error.to_numpy()).max(axis=-1)
    assert error[:, -1].max() < 0.5
    assert error[0, 200] / error[0, 100] == pytest.approx(np.exp(-1.0), rel=0.1)


def test_a_letter_is_followed_by_a_quadrotor_with_the_targets_motion_fed_forward() -> None:
    target = ca.Target(ca.paths.letter("M", duration=50.0))
    q = starts(ROTORS, target)[:1]
    rms = {}
    for ahead in (True, False):
        law = ca.twist_servoing(ROTORS, 1.0, feed_forward=ahead)
        scenario = ca.Scenario("letter", q, controller=law, target=target, duration=50.0)
        run = ca.simulate(ROTORS, scenario, sample=0.02, variables=["feature_error"])
        assert (run.status == 0).all()
        rms[ahead] = np.sqrt((run.feature_error.sel(time=slice(5, None)).to_numpy() ** 2).mean())
    assert rms[True] < 5.0 and rms[False] > 2.0 * rms[True]


def test_what_cannot_be_flown_is_refused() -> None:
    with pytest.raises(ca.InputError, match="servo is 0"):
        ca.twist_servoing(DAMPED, 0.0)
    law = ca.twist_servoing(DAMPED)
    with pytest.raises(ca.InputError, match="target is None"):
        ca.Scenario("x", np.zeros(8), controller=law)
