"""The linearly implicit step: its order, where RK4 is unstable, and what it says of its error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.engine.engine import Engine
from continuair.flight.frequencies import fastest_rate
from continuair.flight.steps import automatic_step
from continuair.typing import Model
from tests.closed_loop.flights import VEHICLE, designed, scenario
from tests.refusals import refused

TWO = ca.load_vehicle("two_section")
# Its stiffest mode is thirty times as fast as that of TWO, its slow ones are those of a stiff tip.
STIFF = TWO.replace({"arm.arm.section.tip.youngs_modulus": 5e13})
coarse = pytest.mark.filterwarnings("ignore:error_estimate reaches", "ignore:step is")


def driven(vehicle: ca.Vehicle, duration: float = 0.2, **fields: Any) -> ca.Scenario:
    """Bent arms that spin with the body, under gravity, a swaying force and bend moments."""
    n = vehicle.sections
    q, qd = np.zeros((2, 6 + 2 * n))
    q[6::2], q[7::2], qd[3:6], qd[6::2] = 0.8, np.linspace(0.3, 1.0, n), (0.3, 0.5, -0.2), 1.0
    inputs: dict[str, Any] = {
        "force": lambda t: [np.sin(30.0 * t), 0.0, 20.0],
        "bend_moment": lambda t: np.full(2 * n, 0.02 * np.cos(50.0 * t)),
    }
    return ca.Scenario("driven", q, qd, duration=duration, **(inputs | fields))


def swayed(vehicle: ca.Vehicle, duration: float = 2.0) -> ca.Scenario:
    """Straight arms at rest, carried and slowly swayed."""
    n, weight = vehicle.sections, 9.81 * vehicle.mass
    return ca.Scenario(
        "swayed",
        np.zeros(6 + 2 * n),
        duration=duration,
        force=lambda t: [2.0 * np.sin(4.0 * t), 0.0, weight],
        moment=lambda t: [0.0, 0.05 * np.sin(6.0 * t), 0.0],
    )


def apart(flight: xr.Dataset, reference: xr.Dataset) -> float:
    """The largest distance of the tips [m]."""
    found = flight.tip_position.to_numpy() - reference.tip_position.to_numpy()
    return float(np.linalg.norm(found, axis=-1).max())


def reach(vehicle: ca.Vehicle) -> float:
    """The length of the longest arm [m]."""
    return float(np.max(vehicle.reach))


@coarse
@pytest.mark.parametrize(
    ("name", "model"),
    [
        ("two_section", "coupled"),
        pytest.param("dual_arm", "coupled", marks=pytest.mark.long),
        pytest.param("two_section", "decoupled", marks=pytest.mark.long),
        pytest.param("two_section", "independent", marks=pytest.mark.soak),
        pytest.param("dual_arm", "decoupled", marks=pytest.mark.soak),
    ],
)
def test_steps_are_of_second_order(name: str, model: Model) -> None:
    """Against RK4 at a step at which it errs ten thousand times less."""
    vehicle = ca.load_vehicle(name)
    scenario = driven(vehicle)
    reference = ca.simulate(vehicle, scenario, model=model, method="RK4", step=1e-4, sample=0.02)
    errors = [
        apart(
            ca.simulate(vehicle, scenario, model=model, step=h, sample=0.02, method="implicit"),
            reference,
        )
        for h in (1e-3, 5e-4, 2.5e-4)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.15)


@coarse
def test_a_jump_that_is_declared_keeps_the_order() -> None:
    scenario = driven(TWO, jumps=(0.0637,), force=lambda t: [5.0 * (t <= 0.0637), 0.0, 20.0])
    reference = ca.simulate(TWO, scenario, method="RK4", step=1e-4, sample=0.02)
    errors = [
        apart(ca.simulate(TWO, scenario, step=h, sample=0.02, method="implicit"), reference)
        for h in (1e-3, 5e-4, 2.5e-4)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.15)


@coarse
def test_slow_motion_is_followed_at_steps_at_which_rk4_is_unstable() -> None:
    """At 4.7 times the stiffest mode's time: RK4's bound is 2.8."""
    scenario = swayed(STIFF)
    stiffest = float(fastest_rate(Engine(STIFF, "coupled"), np.zeros(10))[0])
    step = 4.7 / stiffest
    flights = {
        method: ca.simulate(STIFF, scenario, step=step, sample=step, method=method, check=True)
        for method in ("RK4", "implicit")
    }
    reference = ca.simulate(STIFF, scenario, sample=step, rtol=1e-8)
    assert int(flights["RK4"].status) != 0
    assert int(flights["implicit"].status) == 0
    # It counts as resolved, and rightly so.
    told = float(flights["implicit"].error_estimate)
    assert 0.5 * told < apart(flights["implicit"], reference) / reach(STIFF) < 2.0 * told < 2e-3


def test_a_mode_that_is_lost_is_told_of() -> None:
    """An undamped ringing of the stiffest mode dies in a few steps that do not resolve it."""
    ringing = STIFF.replace(
        {f"arm.arm.section.{name}.damping_ratio": 0.0 for name in ("base", "tip")}
    )
    engine = Engine(ringing, "coupled")
    stiffest = float(fastest_rate(engine, np.zeros(10))[0])
    q = np.zeros(10)
    q[6], q[8] = 0.5, -0.5
    scenario = ca.Scenario("ringing", q, duration=200.0 / stiffest, gravity=0.0)
    reference = ca.simulate(
        ringing, scenario, method="RK4", step=0.1 / stiffest, sample=4.0 / stiffest
    )
    each = 4.0 / stiffest
    with pytest.warns(ca.ContinuairWarning, match="error_estimate"):
        lost = ca.simulate(ringing, scenario, step=each, sample=each, method="implicit", check=True)
    assert apart(lost, reference) / reach(ringing) < 10.0 * float(lost.error_estimate)


def test_the_automatic_step_is_that_of_the_first_mode() -> None:
    """However stiff the other ones are; one that turns fast is resolved likewise."""
    straight, turning = np.zeros(10), np.zeros(10)
    turning[3] = 100.0
    steps = {
        method: [
            float(automatic_step(Engine(vehicle, "coupled"), straight, method=method)[0])
            for vehicle in (TWO, STIFF)
        ]
        for method in ("RK4", "implicit")
    }
    first = ca.modes(STIFF, gravity=0.0).frequencies[1]
    assert steps["RK4"][0] > 10.0 * steps["RK4"][1]
    assert steps["implicit"][1] == pytest.approx(0.05 / first, rel=1e-2)
    fast = automatic_step(Engine(STIFF, "coupled"), straight, turning, method="implicit")
    assert float(fast[0]) == pytest.approx(0.05 / (first + 100.0), rel=1e-2)


@pytest.mark.long
def test_pairs_fly_as_simulate_does() -> None:
    vehicle = TWO.replace({"uav.mass": [1.5, 2.0, 2.5]})
    options = {"step": 2e-3, "sample": 0.01, "method": "implicit"}
    pairs = ca.run_pairs(vehicle, swayed(TWO, 0.2), **options)  # type: ignore[arg-type]
    flights = [
        ca.simulate(vehicle, swayed(TWO, 0.2), model=model, **options)  # type: ignore[arg-type]
        for model in ("coupled", "decoupled")
    ]
    expected = np.asarray(ca.compare(*flights)["rmse_t_m"])[:, 0]
    found = pairs["rmse_t_m"].sel(model="decoupled")
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    with refused("check"):
        ca.run_pairs(vehicle, swayed(TWO), method="implicit", step=1e-3, check=True)


@pytest.mark.long
@coarse
def test_a_closed_loop_flies_with_it_at_second_order() -> None:
    """The paper's law, whose push is held between control instants."""
    loop = scenario(designed(1.0), duration=0.3, control_period=1e-3)
    reference = ca.simulate(VEHICLE, loop, method="RK4", step=2.5e-4, sample=0.05)
    errors = [
        apart(ca.simulate(VEHICLE, loop, step=h, sample=0.05, method="implicit"), reference)
        for h in (1e-3, 5e-4)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)
