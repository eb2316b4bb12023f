"""The automatic step where air and pulls on the tip make arms faster than their stiffness does."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.engine.engine import Engine
from continuair.flight.loaded_rates import drag_rate, pull_rate, strongest
from continuair.vehicle.rotors import AIR_DENSITY

SLENDER = ca.load_vehicle("slender")
ARM = {"length": 0.5, "mass_per_length": 0.01, "bending_stiffness": 0.02, "radius": 0.01}


def vehicle(uav_mass: float = 1.5, shift: float = -0.05, **arm: Any) -> ca.Vehicle:
    inertia = [0.015 * uav_mass, 0.018 * uav_mass, 0.03 * uav_mass]
    uav = {"mass": uav_mass, "inertia": inertia, "mount": [0.0, 0.0, shift]}
    return ca.Vehicle(name="light", uav=uav, arm={**ARM, "damping_ratio": 0.02, **arm})


def test_drag_of_a_straight_arm_on_a_heavy_body_decays_as_by_hand() -> None:
    """c |v| v across has the slope 2 c |v| along v; the arm's ends move by s²/2 of its bend."""
    heavy = vehicle(1e7, drag_coefficient=1.1)
    speed, q = np.array([0.0, 4.0, 12.0]), np.zeros((1, 8))
    arm = heavy.arm
    slope = AIR_DENSITY * 1.1 * arm.radius * 2.0 * speed
    expected = slope * arm.length**5 / 20.0 / arm.straight_modal_mass
    found = drag_rate(Engine(heavy, "coupled"), q, speed)
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-9)


def test_a_pull_on_the_tip_of_a_straight_arm_stiffens_it_as_by_hand() -> None:
    """The tip rises by κ² l³/6, which a pull F takes work for: E I l and F l³/3 add up."""
    heavy = vehicle(1e9, shift=0.0)
    pull, q = np.array([[0.0], [2.0], [30.0]]), np.zeros((1, 8))
    arm = heavy.arm
    stiffness = arm.bending_stiffness * arm.length + pull[:, 0] * arm.length**3 / 3.0
    expected = np.sqrt(stiffness / arm.straight_modal_mass) * (pull[:, 0] > 0.0)
    found = pull_rate(Engine(heavy, "coupled"), q, pull)
    np.testing.assert_allclose(found, expected, rtol=2e-3)


def test_every_run_of_a_batch_has_the_rates_that_it_has_alone() -> None:
    lengths = np.array([0.4, 0.5, 0.7])
    batch = vehicle(drag_coefficient=1.0).replace({"arm.length": lengths})
    speed, pull = np.array([3.0, 8.0, 0.0]), np.array([[5.0], [0.0], [9.0]])
    engine, q = Engine(batch, "coupled"), np.zeros((1, 8))
    found = drag_rate(engine, q, speed), pull_rate(engine, q, pull)
    for run, length in enumerate(lengths):
        one = Engine(vehicle(drag_coefficient=1.0, length=float(length)), "coupled")
        alone = drag_rate(one, q, speed[run, None]), pull_rate(one, q, pull[run, None])
        np.testing.assert_allclose([each[run] for each in found], np.ravel(alone), rtol=1e-6)


def test_the_strongest_wind_is_that_of_all_times_and_runs() -> None:
    drags = vehicle(drag_coefficient=1.0)
    layout = Engine(drags, "coupled").layout
    start = np.zeros(8)

    def of(wind: Any, duration: float = 2.0, **fields: Any) -> Any:
        scenario = ca.Scenario("blown", start, wind=wind, duration=duration, **fields)
        return strongest("wind", scenario, layout, duration).ravel().tolist()

    assert of(None) == [0.0] and of((3.0, 0.0, -4.0)) == [5.0]
    assert of([[1.0, 0.0, 0.0], [0.0, 0.0, 2.0]]) == [1.0, 2.0]
    short = ca.gust([0.0, 12.0, 0.0], 30.0, 0.1)
    assert of(short, 60.0)[0] == pytest.approx(12.0, rel=0.02)
    assert of(lambda t: [7.0 * (t == 1.23456), 0.0, 0.0], jumps=[1.23456]) == [7.0]


def apart(flight: Any, vehicle: ca.Vehicle, scenario: ca.Scenario, sample: float) -> float:
    """The largest distance of tips from those of the reference [arm lengths]."""
    exact = ca.simulate(vehicle, scenario, sample=sample, method="DOP853")
    assert int(exact.status) == int(flight.status) == 0
    off = np.linalg.norm(flight.tip_position - exact.tip_position, axis=-1)
    return float(off.max()) / float(vehicle.reach)


@pytest.mark.parametrize("model", ["coupled", "decoupled"])
@pytest.mark.parametrize(
    ("arm", "uav_mass", "wind"),
    [
        (dict(mass_per_length=0.00524, radius=0.0221, bending_stiffness=0.00549, length=0.561),
         1.58, 29.9),
        (dict(mass_per_length=0.00114, radius=0.0192, bending_stiffness=0.00255, length=0.837),
         0.557, 16.0),
    ],
)  # fmt: skip
def test_light_arms_in_a_wind_are_resolved(
    arm: dict[str, float], uav_mass: float, wind: float, model: str
) -> None:
    """By their stiffness alone the step would be 7 to 20 ms, and the flight wrong or over."""
    light = vehicle(uav_mass, drag_coefficient=1.1, **arm)
    weight = 9.81 * light.mass
    scenario = ca.Scenario(
        "blown", (0, 0, 3, 0, 0, 0, 0.1, 0), wind=(wind, 0, 0), force=(0, 0, weight), duration=0.5
    )
    flight = ca.simulate(light, scenario, model=model, sample=0.02)
    assert int(flight.status) == 0 and float(flight.step_error) < 1e-3
    if model == "coupled":
        assert apart(flight, light, scenario, 0.02) < 1e-4


def test_a_vehicle_that_starts_fast_in_still_air_is_resolved() -> None:
    light = vehicle(0.557, drag_coefficient=1.2, mass_per_length=0.0012, radius=0.019)
    start, rate = (0, 0, 3, 0, 0, 0, 0.1, 0), (20.0, 0, 0, 0, 0, 0, 0, 0)
    scenario = ca.Scenario("fast", start, rate, force=(0, 0, 9.81 * light.mass), duration=0.5)
    flight = ca.simulate(light, scenario, sample=0.02)
    assert apart(flight, light, scenario, 0.02) < 1e-4


@pytest.mark.parametrize("down", [24.1, 74.2])
def test_a_soft_arm_that_is_pulled_is_resolved(down: float) -> None:
    soft = vehicle(
        6.25, length=0.711, bending_stiffness=0.0293, mass_per_length=0.0173, radius=0.002
    )
    scenario = ca.Scenario(
        "pulled", (0, 0, 3, 0, 0, 0, 0.064, -2.36), tip_wrench=(0, 0, -down, 0, 0, 0),
        force=(0, 0, 9.81 * soft.mass + down), duration=1.0,
    )  # fmt: skip
    flight = ca.simulate(soft, scenario, sample=0.02)
    assert apart(flight, soft, scenario, 0.02) < max(5e-4, 3.0 * float(flight.step_error))


def test_without_air_or_pulls_steps_are_those_of_the_stiffness_alone() -> None:
    start = (0, 0, 3, 0, 0, 0, 0.3, 0)
    hover = ca.Scenario("hover", start, force=(0, 0, 9.81 * SLENDER.mass), duration=0.2)
    weak = hover.replace(tip_wrench=(0, 0, -0.01, 0, 0, 0))
    steps = [ca.simulate(SLENDER, each, sample=0.01).attrs["step"] for each in (hover, weak)]
    assert steps[1] == pytest.approx(steps[0], rel=0.01)


@pytest.mark.parametrize("wind", [16.0, 30.0, 60.0])
def test_implicit_steps_that_wind_breaks_are_flown_again_and_told_of(wind: float) -> None:
    """They are for stiff bends, and know nothing of drag, which ends the flight in some steps."""
    light = vehicle(
        0.557, drag_coefficient=1.1, mass_per_length=0.00114, radius=0.0192,
        bending_stiffness=0.00255, length=0.837,
    )  # fmt: skip
    scenario = ca.Scenario(
        "blown", (0, 0, 3, 0, 0, 0, 0.1, 0), wind=(wind, 0, 0), force=(0, 0, 9.81 * light.mass),
        duration=0.5,
    )  # fmt: skip
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        flight = ca.simulate(light, scenario, sample=0.02, method="implicit")
    assert flight.attrs["flown_again"] == 1 and 1.0 <= float(flight.step_error) < np.inf
