"""Inputs over time that are faster than samples and steps: followed, or refused."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.scenario.excitations import Wave, plus
from tests.refusals import refused

VEHICLE, SLENDER = ca.load_vehicle("paper"), ca.load_vehicle("slender")
LIMP = ca.Vehicle(
    name="limp",
    uav={"mass": 5.0, "inertia": [0.05, 0.05, 0.09]},
    arm={
        "length": 0.5,
        "mass_per_length": 0.03,
        "bending_stiffness": 4e-3,
        "damping_ratio": 0.1,
    },
)


def push(force: Any, **fields: Any) -> ca.Scenario:
    return ca.Scenario("push", np.zeros(8), force=force, duration=0.2, **fields)


def sine(hertz: float, amplitude: float = 200.0) -> Callable[[float], list[float]]:
    return lambda t: [amplitude * np.sin(2.0 * np.pi * hertz * t), 0.0, 0.0]


def apart(one: xr.Dataset, other: xr.Dataset) -> float:
    """The largest distance of the tips [m]."""
    return float(np.linalg.norm(one.tip_position - other.tip_position, axis=-1).max())


@pytest.mark.parametrize("hertz", [1000.0, 500.0, 1999.0])
def test_a_sine_that_samples_would_see_at_its_zeros_is_followed(hertz: float) -> None:
    """Pushed from rest, the vehicle drifts by v̄ t, which an alias would not show; so it does where
    the sine is a design's wave, or stands beside a constant."""
    exact = ca.simulate(VEHICLE, push(sine(hertz)), method="RK4", step=1e-5).tip_position
    moved = float(np.abs(exact[-1] - exact[0])[0])
    assert moved > 1e-4
    wave = Wave(3, 0, 200.0, hertz, hertz, 0.0, 0.2)
    for force in (sine(hertz), wave):
        found = ca.simulate(VEHICLE, push(force)).tip_position
        assert float(np.abs(found - exact).max()) < 1e-3 * moved
    beside = [0.0, 1.0, 0.0]
    found = ca.simulate(VEHICLE, push(plus(wave, np.array(beside)))).tip_position
    alone = ca.simulate(VEHICLE, push(beside)).tip_position
    still = ca.simulate(VEHICLE, push([0.0, 0.0, 0.0])).tip_position
    assert float(np.abs(found - exact - alone + still).max()) < 0.05 * moved


class Lag:
    """A lag of 0.2 s that keeps its state, as if it were asked for one time after the other."""

    def __init__(self) -> None:
        self.time, self.value = 0.0, np.zeros(3)

    def __call__(self, t: float) -> np.ndarray:
        self.time, passed = t, max(t - self.time, 0.0)
        self.value = self.value + (1.0 - np.exp(-passed / 0.2)) * (np.ones(3) - self.value)
        return self.value


def test_functions_that_keep_a_state_or_draw_noise_are_refused() -> None:
    rng = np.random.default_rng(1)
    for force in (Lag(), lambda t: rng.normal(size=3)):
        for given in ({}, {"method": "RK4", "step": 1e-3}):
            with refused("force"):
                ca.simulate(VEHICLE, push(force), **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("odd", [np.ma.masked_equal([0.0, -99.0, 0.0], -99.0), [True, 0.0, 0.0]])
def test_a_function_that_masks_an_entry_or_gives_a_truth_value_is_refused(odd: Any) -> None:
    with refused("force"):
        ca.simulate(VEHICLE, push(lambda t: odd if t >= 0.1 else [0.0, 0.0, 0.0], jumps=[0.1]))


def test_a_fast_moment_does_not_hide_behind_a_steady_force() -> None:
    """Sampled at its crests alone, the moment would turn the vehicle right over."""
    weight = VEHICLE.mass * 9.81
    wrench = ca.Scenario(
        "hover", np.zeros(8), force=[0, 0, weight - 25.0, ], duration=0.3,
        tip_wrench=lambda t: [0, 0, 25, 0, 0.2 * np.cos(2.0 * np.pi * 1000.0 * t), 0],
    )  # fmt: skip
    found = ca.simulate(VEHICLE, wrench, variables=["tip_position"])
    exact = ca.simulate(VEHICLE, wrench, variables=["tip_position"], method="RK4", step=2e-5)
    assert apart(found, exact) < 1e-4


@pytest.mark.parametrize("hertz", [95.0, 200.0])
def test_a_fast_torque_on_a_limp_arm_does_not_hide_behind_the_weight(hertz: float) -> None:
    """Q_κ [N m²] is small beside any force [N] of τ."""
    weight, rate = 9.81 * LIMP.mass, 2.0 * np.pi * hertz

    def tau(t: float) -> list[float]:
        return [0, 0, weight, 0, 0, 0, 4e-3 * np.cos(rate * t), 0]

    q = [0, 0, 3, 0, 0, 0, 0.5, 0]
    polar = ca.simulate(LIMP, ca.Scenario("polar", q, tau=tau, duration=0.5), sample=0.02)
    cartesian = ca.Scenario(
        "bends",
        q,
        force=[0, 0, weight],
        bend_moment=lambda t: [4e-3 * np.cos(rate * t), 0],
        duration=0.5,
    )
    found = ca.simulate(LIMP, cartesian, sample=0.02)
    np.testing.assert_allclose(polar.tip_position, found.tip_position, rtol=0, atol=2e-5)


@pytest.mark.parametrize("runs", [1, 3])
def test_a_constant_in_tau_adds_to_a_force_over_time(runs: int) -> None:
    """Both push along the same axes, as one row and as rows of runs."""
    weight = 9.81 * SLENDER.mass
    tau = np.zeros((runs, 8))
    tau[:, 2] = np.linspace(0.9, 1.1, runs) * weight
    sway = [np.sin, np.cos, np.tanh][:runs]

    def force(t: float) -> Any:
        rows = np.zeros((runs, 3))
        rows[:, 0] = [f(20.0 * t) for f in sway]
        return rows if runs > 1 else rows[0]

    def both(t: float) -> Any:
        return force(t) + (tau[:, :3] if runs > 1 else tau[0, :3])

    q = np.tile([0, 0, 2, 0, 0, 0, 0.1, 0], (runs, 1))
    start = ca.Scenario("s", q if runs > 1 else q[0], duration=0.3)
    beside = start.replace(tau=tau if runs > 1 else tau[0], force=force)
    together = start.replace(force=both)
    for options in ({}, {"method": "RK4", "step": 1e-3}):
        flights = [ca.simulate(SLENDER, each, **options) for each in (beside, together)]  # type: ignore[arg-type]
        assert apart(*flights) < 1e-9


def test_jumps_that_are_close_together_do_not_hide_a_fast_input() -> None:
    """Steps that end at every jump would see the sine at its crests alone."""
    scenario = ca.Scenario(
        "commands", np.zeros(8), force=[0, 0, SLENDER.mass * 9.81], duration=0.5,
        moment=lambda t: [0, 0.3 * np.cos(2.0 * np.pi * 1000.0 * t), 0],
        jumps=tuple(np.arange(1, 250) * 2e-3),
    )  # fmt: skip
    flight = ca.simulate(SLENDER, scenario, sample=0.02, variables=["q"])
    assert abs(float(flight.q.sel(coordinate="pitch")[-1])) < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("hertz", [2000.0, 1999.9])
def test_a_vibration_does_not_hide_beside_a_constant(hertz: float) -> None:
    """Of 0.9 % of the weight, an alias of it would lift the vehicle by 4 cm in 1 s."""
    weight = 9.81 * SLENDER.mass

    def force(t: float) -> list[float]:
        return [0.0, 0.0, weight * (1.0 + 0.009 * np.cos(2.0 * np.pi * hertz * t))]

    start = ca.Scenario("h", (0, 0, 2, 0, 0, 0, 0.1, 0), force=force, duration=1.0)
    found = ca.simulate(SLENDER, start)
    steady = ca.simulate(SLENDER, start.replace(force=[0.0, 0.0, weight]))
    assert apart(found, steady) < 3e-5


def tap(width: float, begin: float, impulse: float) -> Callable[[float], float]:
    """Half a sine."""

    def value(t: float) -> float:
        share = (t - begin) / width
        on = np.sin(np.pi * share) if 0.0 < share < 1.0 else 0.0
        return float(0.5 * np.pi * impulse / width * on)

    return value


@pytest.mark.parametrize("width", [1e-3, 8e-3])
def test_no_tap_is_stepped_over(width: float) -> None:
    """Steps at rest are longer; the momentum is all that the tap gives. Of a batch each run has its
    own, and none beside them changes it."""
    weight, impulse = 9.81 * SLENDER.mass, 0.64
    taps = [tap(width, at, impulse) for at in np.random.default_rng(0).uniform(0.1, 1.5, 5)]
    q = np.tile([0, 0, 3, 0, 0, 0, 0.01, 0], (5, 1))
    together = ca.Scenario(
        "taps",
        q,
        force=lambda t: [[each(t), 0.0, weight] for each in taps],
        duration=1.6,
    )
    found = ca.simulate(SLENDER, together, sample=0.1)
    np.testing.assert_allclose(found.linear_momentum[:, -1, 0], impulse, rtol=1e-4)
    for run in (0, 3):
        own = together.replace(q=q[run], force=lambda t, run=run: [taps[run](t), 0.0, weight])
        alone = ca.simulate(SLENDER, own, sample=0.1)
        np.testing.assert_array_equal(alone.tip_position, found.tip_position[run])


def test_what_begins_from_next_to_nothing_is_met() -> None:
    weight = 9.81 * SLENDER.mass
    scenario = ca.Scenario(
        "gauss", [0, 0, 3, 0, 0, 0, 0, 0], duration=1.4,
        force=lambda t: (10.0 * np.exp(-0.5 * ((t - 1.23) / 0.03) ** 2), 0.0, weight),
    )  # fmt: skip
    found = ca.simulate(SLENDER, scenario, sample=0.01)
    impulse = 10.0 * 0.03 * np.sqrt(2.0 * np.pi)
    assert float(found.linear_momentum[-1, 0]) == pytest.approx(impulse, rel=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("share", [0.3, 0.001])
@pytest.mark.parametrize("beside", ["a slow sine in another component", "the weight", "tau"])
def test_a_burst_hides_behind_nothing_else(beside: str, share: float) -> None:
    """A vibration of which an alias pushes the vehicle away for good; it does not."""
    vehicle = LIMP.replace({"uav.mass": 2.0, "uav.inertia": [0.02, 0.02, 0.04]})
    weight = 9.81 * vehicle.mass

    def burst(t: float) -> float:
        swell = np.sin(np.pi * (t - 10.19) / 0.36) ** 2 * (10.19 < t < 10.55)
        return float(share * weight * np.cos(2.0 * np.pi * 99.0 * t) * swell)

    ways: dict[str, dict[str, Any]] = {
        "a slow sine in another component": {
            "force": lambda t: [burst(t), np.sin(4.0 * np.pi * t), weight]
        },
        "the weight": {"force": lambda t: [0.0, 0.0, weight + burst(t)]},
        "tau": {"tau": [0, 0, weight, 0, 0, 0, 0, 0], "force": lambda t: [burst(t), 0, 0]},
    }
    q = [0, 0, 3, 0, 0, 0, 0.2, 0]
    scenario = ca.Scenario("burst", q, duration=12.0, **ways[beside])
    found = ca.simulate(vehicle, scenario, sample=0.02)
    fine = ca.simulate(vehicle, scenario, sample=0.02, method="RK4", step=4e-4)
    assert apart(found, fine) / 0.5 < 1e-3


ROTORS = {"layout": "quad_x", "lever": 0.24, "torque_per_thrust": 0.015}


@pytest.mark.filterwarnings("ignore:rotors saturate")
def test_commands_that_limits_cut_off_are_followed() -> None:
    vehicle = SLENDER.replace({"uav.rotors": {**ROTORS, "thrust_limits": [0.5, 9.0]}})
    hover = 9.81 * vehicle.mass / 4.0

    def command(t: float) -> Any:
        swing = np.sin([30.0 * t, -30.0 * t, 17.0 * t, -17.0 * t])
        return hover * (1.0 + 1.5 * swing)

    scenario = ca.Scenario("cut", (0, 0, 3, 0, 0, 0, 0.2, 0), rotor_command=command, duration=1.0)
    found = ca.simulate(vehicle, scenario, sample=0.02, check=True)
    exact = ca.simulate(vehicle, scenario, sample=0.02, method="RK4", step=5e-5)
    off = apart(found, exact) / vehicle.arm.length
    assert off < 1e-3
    assert 0.5 * off < float(found.error_estimate) < 2.0 * off


@pytest.mark.long
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_commands_beside_a_controller_are_followed_below_nothing_too(sign: float) -> None:
    """They add to what it asks for, and limits cut off the sum alone."""
    vehicle = SLENDER.replace({"uav.rotors": {**ROTORS, "thrust_limits": [0.0, 12.0], "lag": 0.0}})
    law = ca.flight_controller(vehicle)

    def command(t: float) -> list[float]:
        return [sign * (1.0 + np.cos(2.0 * np.pi * 1000.0 * t)), 0.0, 0.0, 0.0]

    scenario = ca.Scenario(
        "c", (0, 0, 2, 0, 0, 0, 0.1, 0), controller=law, rotor_command=command, duration=0.1
    )
    found = ca.simulate(vehicle, scenario, sample=0.01)
    exact = ca.simulate(vehicle, scenario, sample=0.01, method="RK4", step=2e-5)
    assert apart(found, exact) < 1e-6


@pytest.mark.parametrize(
    "of",
    [
        lambda t: abs(t - 0.1) ** 0.5,
        lambda t: float(np.cbrt(t - 0.1)),
        lambda t: abs(np.sin(10.0 * np.pi * t)) ** 0.5,
    ],
)
def test_inputs_without_a_slope_at_a_time_are_passed(of: Callable[[float], float]) -> None:
    """On both sides of it no polynomial fits: steps end beyond."""
    start = ca.Scenario(
        "s", [0, 0, 0, 0, 0, 0, 0.3, 0.4], force=lambda t: [5.0 * of(t), 0, 0], duration=0.2
    )
    found = ca.simulate(VEHICLE, start)
    exact = ca.simulate(VEHICLE, start, method="RK4", step=2e-5)
    assert int(found.status) == 0 and int(found.steps) < 1000
    assert apart(found, exact) < 3e-5


def test_a_function_that_gives_each_run_its_constant_is_that_constant() -> None:
    """In parts of several threads, too."""
    rows = np.arange(1.0, 17.0)[:, None] * np.array([1.0, 0.0, 0.0])
    start = ca.Scenario("rows", [0, 0, 0, 0, 0, 0, 0.3, 0.4], force=lambda t: rows, duration=0.1)
    found = ca.simulate(VEHICLE, start, threads=2)
    plain = ca.simulate(VEHICLE, start.replace(force=rows), threads=1)
    np.testing.assert_array_equal(found.tip_position, plain.tip_position)
