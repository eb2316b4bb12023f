"""The linearly implicit step: its order, where RK4 is unstable, and what it says of its error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.engine.engine import Engine
from continuair.flight.steps import automatic_step, fastest_rate
from tests.closed_loop.flights import VEHICLE, designed, scenario

TWO = ca.load_vehicle("two_section")
# Its stiffest mode is thirty times as fast as that of TWO, its slow ones are those of a stiff tip.
STIFF = TWO.replace({"arm.arm.section.tip.youngs_modulus": 5e13})
coarse = pytest.mark.filterwarnings("ignore:step_error reaches", "ignore:step is")


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
        ("dual_arm", "coupled"),
        ("two_section", "decoupled"),
        pytest.param("two_section", "independent", marks=pytest.mark.slow),
        pytest.param("dual_arm", "decoupled", marks=pytest.mark.slow),
    ],
)
def test_steps_are_of_second_order(name: str, model: str) -> None:
    """Against RK4 at a step at which it errs ten thousand times less."""
    vehicle = ca.load_vehicle(name)
    scenario = driven(vehicle)
    reference = ca.simulate(vehicle, scenario, model=model, step=1e-4, sample=0.02)
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
    reference = ca.simulate(TWO, scenario, step=1e-4, sample=0.02)
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
        method: ca.simulate(STIFF, scenario, step=step, sample=step, method=method)
        for method in ("RK4", "implicit")
    }
    reference = ca.simulate(STIFF, scenario, sample=step)
    assert float(reference.step_error) < 1e-5
    assert int(flights["RK4"].status) != 0
    assert int(flights["implicit"].status) == 0
    # It counts as resolved, and rightly so.
    error = float(flights["implicit"].step_error)
    assert apart(flights["implicit"], reference) / reach(STIFF) < error < 1e-3


@coarse
@pytest.mark.parametrize("scenario", [driven, swayed])
@pytest.mark.parametrize("step", [5e-3, 1e-3])
def test_step_error_is_the_error_within_a_factor(scenario: object, step: float) -> None:
    flown = scenario(TWO, duration=0.5)  # type: ignore[operator]
    flight = ca.simulate(TWO, flown, step=step, sample=0.02, method="implicit")
    actual = apart(flight, ca.simulate(TWO, flown, step=1e-4, sample=0.02)) / reach(TWO)
    assert actual / 2 < float(flight.step_error) < 50.0 * actual


def test_steps_that_leave_much_out_are_told_of() -> None:
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        ca.simulate(TWO, driven(TWO), step=0.01, sample=0.02, method="implicit")


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
    reference = ca.simulate(ringing, scenario, step=0.1 / stiffest, sample=4.0 / stiffest)
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        lost = ca.simulate(
            ringing, scenario, step=4.0 / stiffest, sample=4.0 / stiffest, method="implicit"
        )
    assert apart(lost, reference) / reach(ringing) < float(lost.step_error)


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


def test_an_automatic_step_that_leaves_too_much_out_is_halved() -> None:
    released = ca.Scenario("released", [0, 0, 0, 0, 0, 0, 0.3, 0, 0.3, 0], duration=2.0)
    flight = ca.simulate(TWO, released, sample=0.02, method="implicit")
    assert flight.attrs["flown_again"] == 1 and flight.attrs["method"] == "implicit"
    whole = float(automatic_step(Engine(TWO, "coupled"), released.q, method="implicit")[0])
    assert flight.attrs["step"] == 0.5 * min(whole, 0.02)
    reference = ca.simulate(TWO, released, step=1e-3, sample=0.02)
    actual = apart(flight, reference) / reach(TWO)
    assert actual / 2 < float(flight.step_error) < 2.0 * actual


def test_pairs_fly_as_simulate_does() -> None:
    vehicle = TWO.replace({"uav.mass": [1.5, 2.0, 2.5]})
    options = {"step": 2e-3, "sample": 0.01, "method": "implicit"}
    pairs = ca.run_pairs(vehicle, swayed(TWO, 0.2), **options)  # type: ignore[arg-type]
    flights = [
        ca.simulate(vehicle, swayed(TWO, 0.2), model=model, **options)  # type: ignore[arg-type]
        for model in ("coupled", "decoupled")
    ]
    expected = ca.compare(*flights)["rmse_t_m"][:, 0]
    found = pairs["rmse_t_m"].sel(model="decoupled")
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    with pytest.raises(ca.InputError, match="method is 'DOP853'"):
        ca.run_pairs(vehicle, swayed(TWO), method="DOP853")


@coarse
def test_a_closed_loop_flies_with_it_at_second_order() -> None:
    """The paper's law, whose push is held between control instants."""
    loop = scenario(designed(1.0), duration=0.3, control_period=1e-3)
    reference = ca.simulate(VEHICLE, loop, step=2.5e-4, sample=0.05)
    errors = [
        apart(ca.simulate(VEHICLE, loop, step=h, sample=0.05, method="implicit"), reference)
        for h in (1e-3, 5e-4)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


@pytest.mark.filterwarnings("ignore:step_error reaches")
def test_halving_does_not_hide_modes_that_neither_step_resolves() -> None:
    """A stiff section after a limp one, released bent: both steps lose its swing alike."""
    limp = {"length": 0.477, "bending_stiffness": 0.0138, "mass_per_length": 0.0228}
    stiff = {"length": 0.2871, "bending_stiffness": 6.5569, "mass_per_length": 0.0113}
    uav = {"mass": 2.7, "inertia": [0.02, 0.02, 0.03]}
    vehicle = ca.Vehicle(name="limp and stiff", uav=uav, arm=[{"section": [limp, stiff]}])
    q = [0, 0, 3, 0.36, -0.01, 0.42, -0.19, -0.48, -0.44, -2.39]
    released = ca.Scenario("released", q, duration=0.2, force=[11.0, 0.0, 26.6])
    flown, exact = (
        ca.simulate(vehicle, released, method=name, sample=0.01, variables=["tip_position"])
        for name in ("implicit", "RK4")
    )
    assert flown.flown_again == 1
    off = apart(flown, exact) / reach(vehicle)
    assert off > 0.01 and float(flown.step_error) > off


@coarse
def test_a_run_that_ends_early_tells_beside_others_the_error_that_it_tells_alone() -> None:
    """Beyond its end, where the others fly on, what it would do overflows."""
    vehicle = ca.load_vehicle("slender")
    q, qd = np.zeros((2, 2, 8))
    q[:, 2], q[:, 6], qd[0, 6] = 3.0, (0.5, 0.05), 2000.0
    alone, beside = (
        ca.simulate(
            vehicle,
            ca.Scenario("whipped", at, qd=rates, duration=0.5),
            method="implicit",
            step=1e-3,
            variables=["bend"],
        )
        for at, rates in ((q[0], qd[0]), (q, qd))
    )
    assert beside.status.values.tolist() == [2, 0] and int(alone.status) == 2
    assert np.isfinite(alone.step_error)
    assert float(beside.step_error[0]) == pytest.approx(float(alone.step_error), rel=1e-9)
