"""Inputs over time that are faster than the steps: followed, or told of."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.flight.prepare import prepare
from continuair.scenario.excitations import Wave, plus

VEHICLE, SLENDER = ca.load_vehicle("paper"), ca.load_vehicle("slender")
unseen = pytest.mark.filterwarnings("ignore:.*jumps within a step")


def push(force: Any, **fields: Any) -> ca.Scenario:
    return ca.Scenario("push", np.zeros(8), force=force, duration=0.2, **fields)


def sine(hertz: float, amplitude: float = 200.0) -> Callable[[float], list[float]]:
    return lambda t: [amplitude * np.sin(2.0 * np.pi * hertz * t), 0.0, 0.0]


@pytest.mark.parametrize("hertz", [1000.0, 500.0, 1999.0])
def test_an_automatic_step_follows_a_sine_that_samples_would_see_at_its_zeros(hertz: float) -> None:
    """Pushed from rest, the vehicle drifts by a v̄ t, which an alias would not show."""
    scenario = push(sine(hertz))
    flight = ca.simulate(VEHICLE, scenario, sample=1e-3)
    exact = ca.simulate(VEHICLE, scenario, step=1e-5, sample=1e-3).tip_position
    moved = float(np.abs(exact[-1] - exact[0])[0])
    assert float(np.abs(flight.tip_position - exact).max()) < 1e-3 * moved
    assert moved > 1e-4


def test_a_wave_of_a_design_is_followed_too() -> None:
    """It tells its frequency; pairs and single flights take one step."""
    wave = Wave(3, 0, 200.0, 1000.0, 1000.0, 0.0, 0.2)
    flights = [ca.simulate(VEHICLE, push(f), sample=1e-3) for f in (wave, sine(1000.0))]
    exact = ca.simulate(VEHICLE, push(wave), step=1e-5, sample=1e-3).tip_position
    for flight in flights:
        assert float(np.abs(flight.tip_position - exact).max()) < 1e-6


@unseen
def test_a_step_that_does_not_follow_an_input_is_told_of() -> None:
    with pytest.warns(ca.ContinuairWarning, match="force changes within steps of 0.001 s"):
        ca.simulate(VEHICLE, push(sine(1000.0)), step=1e-3)


@unseen
def test_one_fast_run_of_a_batch_is_told_of() -> None:
    def forces(t: float) -> list[list[float]]:
        return [sine(hertz)(t) for hertz in (1.0, 1000.0)]

    with pytest.warns(ca.ContinuairWarning, match="force changes within steps"):
        ca.simulate(VEHICLE, push(forces), step=1e-3)


@unseen
def test_what_no_step_follows_is_told_of_at_an_automatic_step() -> None:
    noise = np.random.default_rng(1).normal(size=(300_000, 3))
    with pytest.warns(ca.ContinuairWarning, match="force changes within steps"):
        ca.simulate(VEHICLE, push(lambda t: noise[int(1e6 * t)]))


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
        with pytest.raises(ca.InputError, match="force gives other values when it is asked"):
            ca.simulate(VEHICLE, push(force))


def test_slow_inputs_and_declared_jumps_cost_nothing_and_are_not_told_of() -> None:
    def jumping(t: float) -> list[float]:
        return [10.0 * (t > 0.1) + np.sin(20.0 * t), 0.0, 0.0]

    with warnings.catch_warnings():
        warnings.simplefilter("error", ca.ContinuairWarning)
        for force, jumps in ((sine(8.0), ()), (jumping, (0.1,)), (lambda t: [0, 0, 0], ())):
            flight = ca.simulate(VEHICLE, push(force, jumps=jumps), sample=1e-3)
            assert flight.attrs["step"] == 1e-3


def test_the_step_of_a_run_hangs_on_no_other_run_of_its_batch() -> None:
    """Neither by its neighbours' arms nor by their inputs."""
    radii = np.array([1.0, 1.43, 0.5]) * VEHICLE.arm.radius

    def forces(t: float) -> Any:
        return [sine(hertz)(t) for hertz in (170.0, 3.0, 40.0)]

    whole = ca.simulate(VEHICLE.replace({"arm.radius": radii}), push(forces), sample=2e-3)
    for run, hertz in enumerate((170.0, 3.0, 40.0)):
        one = VEHICLE.replace({"arm.radius": float(radii[run])})
        alone = ca.simulate(one, push(sine(hertz)), sample=2e-3)
        assert float(whole["step"][run]) == alone.attrs["step"]


@pytest.mark.filterwarnings("ignore:.*changes within steps")
@pytest.mark.parametrize("burst", [(0.05037, 0.15093), (0.05012, 0.05042)], ids=["gust", "blow"])
def test_a_jump_that_is_not_declared_is_told_of(burst: tuple[float, float]) -> None:
    def force(t: float) -> list[float]:
        return [20.0 if burst[0] <= t < burst[1] else 0.0, 0.0, 20.0]

    with pytest.warns(ca.ContinuairWarning, match=r"force jumps within a step near t = 0\.0?5"):
        ca.simulate(VEHICLE, push(force), sample=1e-3, step=5e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ca.ContinuairWarning)
        ca.simulate(VEHICLE, push(force, jumps=burst), sample=1e-3, step=5e-4)


@unseen
def test_a_fast_moment_does_not_hide_behind_a_steady_force() -> None:
    """Sampled at its crests alone, the moment would turn the vehicle right over."""
    weight = VEHICLE.mass * 9.81
    wrench = ca.Scenario(
        "hover", np.zeros(8), force=[0, 0, weight - 25.0, ], duration=0.3,
        tip_wrench=lambda t: [0, 0, 25, 0, 0.2 * np.cos(2.0 * np.pi * 1000.0 * t), 0],
    )  # fmt: skip
    steps: tuple[Any, ...] = ("auto", 2e-5)
    tips = [
        ca.simulate(VEHICLE, wrench, sample=1e-3, variables=["tip_position"], step=h).tip_position
        for h in steps
    ]
    assert float(np.abs(tips[0] - tips[1]).max()) < 1e-4


@pytest.mark.parametrize("hertz", [95.0, 100.0, 200.0])
def test_a_fast_torque_on_a_limp_arm_does_not_hide_behind_the_weight(hertz: float) -> None:
    """Q_κ [N m²] is small beside any force [N] of τ: it is held against its own largest alone."""
    uav = {"mass": 5.0, "inertia": [0.05, 0.05, 0.09]}
    section = {"length": 0.5, "mass_per_length": 0.03, "bending_stiffness": 4e-3}
    arm = {"section": [section | {"damping_ratio": 0.1}]}
    vehicle = ca.Vehicle(name="limp", uav=uav, arm=[arm])
    weight, rate = 9.81 * vehicle.mass, 2.0 * np.pi * hertz

    def tau(t: float) -> list[float]:
        return [0, 0, weight, 0, 0, 0, 4e-3 * np.cos(rate * t), 0]

    q = [0, 0, 3, 0, 0, 0, 0.5, 0]
    polar = ca.simulate(vehicle, ca.Scenario("polar", q, tau=tau, duration=0.5), sample=0.02)
    cartesian = ca.Scenario(
        "bends",
        q,
        force=[0, 0, weight],
        bend_moment=lambda t: [4e-3 * np.cos(rate * t), 0],
        duration=0.5,
    )
    found = ca.simulate(vehicle, cartesian, sample=0.02)
    assert polar.attrs["step"] == found.attrs["step"] < 0.02 / 4
    np.testing.assert_allclose(polar.tip_position, found.tip_position, rtol=0, atol=1e-5)


@pytest.mark.long
def test_the_reference_integrator_does_not_step_over_a_gust() -> None:
    def gust(t: float) -> list[float]:
        return [200.0 * np.exp(-(((t - 1.6) / 5e-3) ** 2)), 0.0, 0.0]

    scenario = ca.Scenario("gust", np.zeros(8), force=gust, gravity=0.0, duration=2.0)
    flights = [
        ca.simulate(VEHICLE, scenario, sample=0.01, method=name, variables=["position"])
        for name in ("RK4", "DOP853")
    ]
    ends = [float(flight.position[-1, 0]) for flight in flights]
    assert ends[1] > 0.1
    assert ends[0] == pytest.approx(ends[1], rel=1e-5)


@pytest.mark.parametrize(("period", "hertz"), [(2e-3, 1000.0), (4e-3, 500.0)])
def test_jumps_that_are_close_together_do_not_hide_a_fast_input(
    period: float, hertz: float
) -> None:
    """Steps that end at every jump would see the sine at its crests alone."""
    vehicle = ca.load_vehicle("slender")
    scenario = ca.Scenario(
        "commands", np.zeros(8), force=[0, 0, vehicle.mass * 9.81], duration=0.5,
        moment=lambda t: [0, 0.3 * np.cos(2.0 * np.pi * hertz * t), 0],
        jumps=tuple(np.arange(1, round(0.5 / period)) * period),
    )  # fmt: skip
    flight = ca.simulate(vehicle, scenario, sample=0.02)
    assert abs(float(flight.q.sel(coordinate="pitch")[-1])) < 1e-3


@unseen
@pytest.mark.filterwarnings("ignore:force changes within steps", "ignore:step is 0.001 s")
@pytest.mark.parametrize(
    "force",
    [sine(1000.0), Wave(3, 0, 200.0, 1000.0, 1000.0, 0.0, 0.2), plus(sine(1000.0), np.ones(3))],
)
def test_no_step_error_is_claimed_where_steps_miss_an_input(force: Any) -> None:
    flight = ca.simulate(VEHICLE, push(force), step=1e-3)
    assert np.isinf(flight.step_error)
    assert np.isfinite(ca.simulate(VEHICLE, push(force)).step_error)


def test_an_excitation_plus_a_constant_is_probed_as_it_is_alone() -> None:
    """The sum tells a rate if the excitation does, and no other."""
    wave = Wave(3, 0, 200.0, 1000.0, 1000.0, 0.0, 0.2)
    steps = [
        prepare(VEHICLE, push(plus(force, np.ones(3))), sample=1e-2).steps[0]
        for force in (wave, sine(1000.0), sine(1.0))
    ]
    assert steps[0] < 1e-4
    assert steps[1] < 2e-4
    assert steps[2] > 1e-3


def test_an_implicit_step_that_misses_the_lag_of_rotors_says_so() -> None:
    """It distorts nothing that it does not resolve, but what is missed is missed."""
    rotors = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 20.0], "lag": 1e-3}
    vehicle = VEHICLE.replace({"uav.rotors": rotors | {"torque_per_thrust": 0.016}})
    start = ca.Scenario("hover", (0, 0, 2, 0, 0, 0, 0.1, 0), duration=0.02)
    with pytest.warns(ca.ContinuairWarning, match="inputs or rotors change by more than"):
        found = ca.simulate(vehicle, start, step=2e-3, sample=0.01, method="implicit")
    assert float(found["step_error"]) == np.inf


def test_an_input_that_is_known_at_stages_alone_hides_no_fast_one_beside_it() -> None:
    def known(t: float) -> list[float]:
        if abs(t - 5e-4 * round(t / 5e-4)) > 1e-7:
            raise KeyError(t)
        return [0.0, 0.0, 25.0]

    def whirl(t: float) -> list[float]:
        return [0.0, 0.5 * np.sin(2.0 * np.pi * 2000.0 * t + 0.3), 0.0]

    with pytest.warns(ca.ContinuairWarning, match="moment changes within steps"):
        flight = ca.simulate(VEHICLE, push(known, moment=whirl), step=1e-3, sample=0.01)
    assert np.isinf(flight.step_error)


@pytest.mark.parametrize("odd", [np.ma.masked_equal([0.0, -99.0, 0.0], -99.0), [True, 0.0, 0.0]])
def test_a_function_that_masks_an_entry_or_gives_a_truth_value_is_refused(odd: Any) -> None:
    with pytest.raises(
        ca.InputError, match="force holds a truth value, a masked entry or a unit at t = 0.1"
    ):
        ca.simulate(VEHICLE, push(lambda t: odd if t >= 0.1 else [0.0, 0.0, 0.0], jumps=[0.1]))


def tap(length: float, begins: float = 0.3) -> Callable[[float], list[float]]:
    """Half a sine of 60 N in a flight that lasts forty times as long, or more."""

    def force(t: float) -> list[float]:
        within = begins < t < begins + length
        return [60.0 * np.sin(np.pi * (t - begins) / length) * within, 0.0, 0.0]

    return force


def tapped(length: float = 0.025, **fields: Any) -> ca.Scenario:
    return ca.Scenario("tap", np.zeros(8), force=tap(length), duration=4.0, gravity=0.0, **fields)


@pytest.mark.parametrize("step", ["auto", 3e-3, 2e-3, 1e-3])
@pytest.mark.filterwarnings("ignore:step_error reaches")
def test_a_tap_between_the_probed_steps_is_in_step_error(step: Any) -> None:
    """It begins and ends within steps, which makes its impulse wrong."""
    flight = ca.simulate(SLENDER, tapped(), step=step, sample=0.02)
    exact = ca.simulate(SLENDER, tapped(jumps=[0.3, 0.325]), step=1e-4, sample=0.02)
    off = float(np.linalg.norm(flight.tip_position - exact.tip_position, axis=-1).max())
    assert off / SLENDER.arm.length < 1.2 * float(flight.step_error)
    assert float(flight.step_error) < 0.02


def test_taps_whose_ends_are_named_are_not_told_of_and_cost_nothing_once_steps_follow_them() -> (
    None
):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        coarse, fine = (
            ca.simulate(SLENDER, tapped(jumps=[0.3, 0.325]), sample=sample)
            for sample in (0.01, 0.001)
        )
    assert float(coarse.step_error) < 1e-3 and float(fine.step_error) < 1e-3
    assert fine.attrs["flown_again"] == 0


@pytest.mark.parametrize("hertz", [495.0, 500.0])
def test_a_burst_that_stages_see_as_a_swell_is_told_of(hertz: float) -> None:
    def burst(t: float) -> list[float]:
        swell = np.sin(np.pi * (t - 5.3) / 0.1) ** 2 * (5.3 < t < 5.4)
        return [6.0 * np.cos(2.0 * np.pi * hertz * t) * swell, 0.0, 0.0]

    scenario = ca.Scenario("burst", np.zeros(8), force=burst, duration=20.0, gravity=0.0)
    with pytest.warns(ca.ContinuairWarning, match="force changes within steps of 0.004 s"):
        flight = ca.simulate(SLENDER, scenario, step=4e-3, sample=0.02)
    assert np.isinf(flight.step_error)


@pytest.mark.filterwarnings("ignore:step_error reaches")
def test_taps_of_a_batch_are_judged_run_by_run() -> None:
    def forces(t: float) -> list[list[float]]:
        return [tap(0.025, begins)(t) for begins in (0.3, 1.7)] + [sine(0.5, 1.0)(t)]

    scenario = ca.Scenario("taps", np.zeros((3, 8)), force=forces, duration=4.0, gravity=0.0)
    together = ca.simulate(SLENDER, scenario, sample=0.02)
    for run in (0, 2):
        alone = ca.simulate(
            SLENDER,
            scenario.replace(q=np.zeros(8), force=lambda t, run=run: forces(t)[run]),
            sample=0.02,
        )
        assert float(alone.step_error) == float(together.step_error[run])
        np.testing.assert_array_equal(alone.tip_position, together.tip_position[run])
    assert float(together.step_error[2]) < 1e-6 < 1e-3 < float(together.step_error[0])
    pairs = ca.run_pairs(SLENDER, scenario, sample=0.02)
    np.testing.assert_allclose(
        pairs.step_error.sel(model="coupled"), together.step_error, rtol=1e-3
    )


@pytest.mark.filterwarnings("ignore:step_error reaches")
@pytest.mark.filterwarnings("ignore:rotors saturate")
def test_commands_that_limits_cut_off_within_steps_are_in_step_error() -> None:
    rotors = {"layout": "quad_x", "lever": 0.24, "thrust_limits": [0.5, 9.0]}
    vehicle = SLENDER.replace({"uav.rotors": {**rotors, "torque_per_thrust": 0.015}})
    hover = 9.81 * vehicle.mass / 4.0

    def command(t: float) -> Any:
        swing = np.sin([30.0 * t, -30.0 * t, 17.0 * t, -17.0 * t])
        return hover * (1.0 + 1.5 * swing)

    scenario = ca.Scenario("cut", (0, 0, 3, 0, 0, 0, 0.2, 0), rotor_command=command, duration=1.0)
    found, exact = (ca.simulate(vehicle, scenario, sample=0.02, step=h) for h in (2e-3, 1e-4))
    off = float(np.linalg.norm(found.tip_position - exact.tip_position, axis=-1).max())
    assert 1e-5 < off / vehicle.arm.length < float(found.step_error) < 0.01


def test_the_reference_integrator_meets_what_begins_from_next_to_nothing() -> None:
    """Squares of a step's errors vanish there: SciPy divides 0 by 0, and takes a shorter step."""
    weight = 9.81 * SLENDER.mass
    scenario = ca.Scenario(
        "gauss", [0, 0, 3, 0, 0, 0, 0, 0], duration=1.4,
        force=lambda t: (10.0 * np.exp(-0.5 * ((t - 1.23) / 0.03) ** 2), 0.0, weight),
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = ca.simulate(SLENDER, scenario, method="DOP853", sample=0.01)
    impulse = 10.0 * 0.03 * np.sqrt(2.0 * np.pi)
    assert float(found.linear_momentum[-1, 0]) == pytest.approx(impulse, rel=1e-6)


@pytest.mark.parametrize("hertz", [4000.0, 3999.9, 4001.0])
@pytest.mark.parametrize("step", ["auto", 1e-3, 5e-4])
def test_a_vibration_in_step_with_the_stages_does_not_hide_beside_a_constant(
    step: Any, hertz: float
) -> None:
    """Of 0.9 % of the weight, it would lift the vehicle by a metre in 5 s."""
    weight = 9.81 * SLENDER.mass

    def force(t: float) -> list[float]:
        return [0.0, 0.0, weight * (1.0 + 0.009 * np.cos(2.0 * np.pi * hertz * t))]

    scenario = ca.Scenario("h", (0, 0, 2, 0, 0, 0, 0.1, 0), force=force, duration=1.0)
    with pytest.warns(ca.ContinuairWarning, match="force changes within steps"):
        flight = ca.simulate(SLENDER, scenario, step=step)
    assert float(flight.step_error) == np.inf


@unseen
@pytest.mark.filterwarnings("ignore:force changes within steps")
def test_a_run_of_a_batch_of_many_steps_is_judged_as_it_is_alone() -> None:
    steps = np.sort(1e-2 / np.arange(10, 22))
    weight, hertz = 9.81 * SLENDER.mass, np.full(12, 0.5)
    hertz[0] = 4.0 / steps[0]

    def force(t: float) -> Any:
        lift = weight * (1.0 + 0.025 * np.cos(2.0 * np.pi * hertz * t))
        return np.column_stack([np.zeros((12, 2)), lift])

    q = np.tile([0, 0, 2, 0, 0, 0, 0.1, 0], (12, 1)).astype(float)
    scenario = ca.Scenario("b", q, force=force, duration=0.2)
    batch = ca.simulate(SLENDER, scenario, sample=0.01, step=steps)
    for run in (0, 11):
        own = scenario.replace(q=q[run], force=lambda t, run=run: force(t)[run])
        alone = ca.simulate(SLENDER, own, sample=0.01, step=float(steps[run]))
        assert float(batch.step_error[run]) == float(alone.step_error)
    assert float(batch.step_error[0]) == np.inf and float(batch.step_error[11]) < 1e-3


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_commands_beside_a_controller_are_followed_below_nothing_too(sign: float) -> None:
    """They add to what it asks for, and limits cut off the sum alone."""
    vehicle = SLENDER.replace(
        {"uav.rotors": {"layout": "quad_x", "lever": 0.24, "thrust_limits": [0.0, 12.0],
                        "torque_per_thrust": 0.015, "lag": 0.0}}
    )  # fmt: skip
    law = ca.flight_controller(vehicle)

    def command(t: float) -> list[float]:
        return [sign * (1.0 + np.cos(2.0 * np.pi * 1000.0 * t)), 0.0, 0.0, 0.0]

    scenario = ca.Scenario(
        "c", (0, 0, 2, 0, 0, 0, 0.1, 0), controller=law, rotor_command=command, duration=0.1
    )
    flight = ca.simulate(vehicle, scenario, sample=0.01)
    exact = ca.simulate(vehicle, scenario, sample=0.01, step=2e-5)
    off = float(np.linalg.norm(flight.tip_position - exact.tip_position, axis=-1).max())
    assert flight.attrs["step"] < 5e-4 and off < 1e-6
