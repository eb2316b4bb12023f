"""Visual servoing before a still target: every model, precision and way of acting arrives."""

from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.typing import Model
from tests.closed_loop import flights

pytestmark = pytest.mark.targets


def largest_error(run: xr.Dataset) -> float:
    """Feature error [px] at the end of a run that ended well."""
    assert run.status == 0
    return float(np.abs(run.feature_error[-1]).max())


@pytest.mark.parametrize("model", ca.MODELS)
def test_the_papers_law_reaches_the_desired_image_on_every_plant(model: Model) -> None:
    # Straight, so that what `independent` freezes of the arm is what it is in the end.
    scenario = flights.scenario(flights.designed(), duration=6.0, q=flights.start(kappa=0.0))
    run = ca.simulate(flights.VEHICLE, scenario, model=model)
    assert np.abs(run.feature_error[0]).max() > 40.0
    # Of 43 px, (1 + ω t) exp(-ω t) leaves 1e-5 px in 6 s at 3 rad/s; the arm, some more.
    assert largest_error(run) < 1e-3


@pytest.mark.parametrize(
    "choices",
    [
        {"damping": "feature"},
        {"feed_forward": False},
        {"posture_damping": 0.05},
        {"compensation": "literal", "posture_damping": 0.05},
    ],
    ids=str,
)
def test_every_named_choice_of_the_law_reaches_a_still_target(choices: dict[str, Any]) -> None:
    scenario = flights.scenario(flights.designed(**choices), duration=6.0)
    assert largest_error(ca.simulate(flights.VEHICLE, scenario)) < 0.5


@pytest.mark.long
def test_classic_servoing_reaches_the_desired_image_at_its_rate() -> None:
    scenario = flights.scenario(ca.classic(flights.VEHICLE, rate=0.5), duration=16.0)
    run = ca.simulate(flights.VEHICLE, scenario)
    assert largest_error(run) < 0.1
    size = np.linalg.norm(run.feature_error.to_numpy(), axis=1)
    # Between 6 and 10 s only exp(-λ t) is left; the velocity loop delays λ by a twelfth.
    assert np.log(size[6000] / size[10000]) / 4.0 == pytest.approx(0.5, rel=0.15)


@pytest.mark.slow
def test_classic_servoing_comes_home_at_its_rate_also_before_a_small_far_target() -> None:
    """From where it looks at the centre aslant, the motion that an image of 20 px hardly shows."""
    aslant, far = 0.01, 5.0
    law = ca.classic(flights.VEHICLE, rate=1.0, inner=20.0)
    reach = far + flights.VEHICLE.arm.length
    q = [reach * np.sin(aslant), 0.0, reach * np.cos(aslant), 0.0, aslant, 0.0, 1e-5, 0.0]
    target = ca.Target(ca.paths.hold(), points=ca.square(0.1), distance=far)
    scenario = ca.Scenario("far", q, controller=law, target=target, control_period=None)
    run = ca.simulate(flights.VEHICLE, scenario, duration=5.0, sample=0.5, variables=["q"])
    left = np.abs(run.q.sel(coordinate="pitch").to_numpy())
    # The velocity loop quickens λ by a twentieth.
    assert np.log(left[6] / left[10]) / 2.0 == pytest.approx(1.05, rel=0.05)


def test_a_moving_target_is_followed_without_lag_only_with_feed_forward() -> None:
    """The rate left out is C_p e = C_d L v_t: 2/ω of the target's speed in the image."""
    path = ca.paths.line([0.0, 0.0, 0.0], [0.4, 0.0, 0.0], duration=8.0)
    speed = float(np.linalg.norm(path(4.0)[1][0]))
    errors = []
    for feed_forward in (True, False):
        scenario = flights.scenario(
            flights.designed(feed_forward=feed_forward),
            duration=4.0,
            q=flights.start(x=0.0, z=0.0, kappa=0.0),
            target=ca.Target(path),
        )
        run = ca.simulate(flights.VEHICLE, scenario)
        errors.append(float(np.abs(run.feature_error[-1, ::2]).mean()))
    lag = 2.0 / 3.0 * 800.0 / 2.0 * speed
    assert errors[0] < 1e-3 * lag
    assert errors[1] == pytest.approx(lag, rel=2e-3)


@pytest.mark.long
def test_float32_stays_close_to_float64() -> None:
    scenario = flights.scenario(flights.designed(), duration=6.0)
    exact, short = (
        ca.simulate(flights.VEHICLE, scenario, dtype=dtype).features.to_numpy()
        for dtype in ("float64", "float32")
    )
    assert short.dtype == np.float32
    # J_Lᵀ W e cancels to 1e-3 of its terms, so that the push is rounded at 1e-4 of its size: on
    # the way from an error of 142 px that makes a third of a pixel, and nothing at its end.
    assert np.abs(exact - short).max() < 0.5
    assert np.abs(exact[-1] - short[-1]).max() < 0.01


@pytest.mark.parametrize("tip_frame", ["untwisted", "frenet"])
def test_acting_at_every_stage_keeps_the_fourth_order_of_the_steps(tip_frame: str) -> None:
    """The bend turns, so that the frenet frame spins within a step; its spring is cancelled, as
    that frame is wild where the arm swings through straight."""
    vehicle = flights.VEHICLE.replace({"camera.tip_frame": tip_frame})
    gains: dict[str, Any] = {"Kp": 0.1, "Kd": 0.001, "Cp": 1.0, "Cd": 0.05, "Cs": 0.01}
    scenario = flights.scenario(
        ca.servoing(**gains, sigma=0.1, compensation="literal"),
        0.05,
        q=flights.start(x=-0.9, kappa=0.4),
        qd=[0, 0, 0, 0, 0, 0, 0, 10.0],
        control_period=None,
    )
    ends = [
        ca.simulate(vehicle, scenario, method="RK4", step=step, sample=0.05).features[-1].to_numpy()
        for step in (1e-3, 5e-4, 6.25e-5)
    ]
    coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert np.log2(coarse / fine) > 3.7


def test_the_automatic_step_of_a_law_at_every_stage_resolves_the_loop_too() -> None:
    """A soft arm alone would do with steps of 1 ms, which this loop does not survive."""
    soft = flights.VEHICLE.replace({"arm.youngs_modulus": 2e9})
    scenario = flights.scenario(flights.designed(8.0), 0.2, control_period=None)

    def image(step: float | Literal["auto"]) -> np.ndarray:
        run = ca.simulate(soft, scenario, method="RK4", step=step, sample=0.01)
        assert run.status == 0
        return run.features.to_numpy()

    error = np.abs(image("auto") - image(5e-5)).max()
    assert error < 0.01 * np.abs(image(1e-3) - image(5e-5)).max()


def test_a_faster_hold_comes_close_to_acting_at_every_stage() -> None:
    """The held push is on average half a period old: the difference halves with the period."""
    runs = [
        ca.simulate(
            flights.VEHICLE,
            flights.scenario(flights.designed(2.0), duration=1.0, control_period=period),
            method="RK4",
            step=1.25e-4,
        ).features.to_numpy()
        for period in (2.5e-4, 1.25e-4, None)
    ]
    slow, fast = (np.abs(run - runs[2])[100:].max() for run in runs[:2])
    assert slow / fast == pytest.approx(2.0, rel=0.1)
