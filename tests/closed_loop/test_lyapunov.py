"""`lyapunov`: each condition breaks by its name alone, and V and V̇ are what they say they are."""

import dataclasses
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.analysis.target_motion import largest_norms
from continuair.controllers.gain_files import load_gains
from continuair.kernels.dynamics import MODELS
from continuair.kernels.step import UNSEEN
from continuair.scenario import paths
from continuair.scenario.tracking_task import SETTINGS, equipped, task
from continuair.typing import Model
from tests.closed_loop import flights
from tests.refusals import refused

SCALARS: dict[str, Any] = {"Kp": 20.0, "Kd": 0.5, "Cp": 1.5, "Cd": 0.1, "Cs": 0.05, "sigma": 0.02}
NEGATIVE = np.diag([1.0] * 7 + [-1e-3])
SKEWED = np.eye(8) + 1e-3 * np.diag(np.ones(7), 1)
LINKED = np.eye(8) + 0.9 * (np.eye(8)[[1, 0, *range(2, 8)]] - np.diag([0, 0] + [1] * 6))
STEP = 5e-5
# The image follows at up to some 1,500 1/s: differences over two steps h are off by (1500 h)²/6.
DIFFERENCES = 1e-3
UNEQUAL = np.array([100.0] + [1.0] * 7)


def loop(gains: dict[str, Any] | None = None, **choices: Any) -> ca.Scenario:
    """A still target under continuous control, elasticity cancelled; choices of `servoing`."""
    chosen = SCALARS | {"compensation": "literal"} | (gains or {}) | choices
    return flights.scenario(ca.servoing(**chosen), 0.1, control_period=None)


def by_hand(**gains: Any) -> ca.Scenario:
    """The same with gains that `servoing` refuses."""
    controller = loop().controller
    assert controller is not None
    made = dataclasses.replace(controller, gains={**controller.gains, **gains})
    return loop().replace(controller=made)


def broken(scenario: ca.Scenario, statement: str, flight: xr.Dataset | None = None) -> list[str]:
    found = ca.lyapunov(flights.VEHICLE, scenario, flight)
    return [each.name for each in found.broken(statement)]


def test_gains_made_for_it_fulfil_the_theorem_and_the_sound_statement_and_not_the_proof() -> None:
    assert not broken(loop(), "theorem") and not broken(loop(), "sound")
    assert broken(loop(), "proof") == ["C_d = 0", "C_p + C_s D/σ = 1 at every e"]


SYMMETRIC = "symmetric positive definite"
CONTINUOUS = "control continuous, control_period None"
LITERAL = "G cancelled in full, compensation literal"
OF_THEOREM = [
    *((by_hand(**{n: A}), f"{n[0]}_{n[1]} {SYMMETRIC}")
      for n in ("Kp", "Kd", "Cp", "Cd", "Cs") for A in (NEGATIVE, SKEWED)),
    (by_hand(sigma=-0.02), "σ positive"),
    (loop(compensation="gravity_only"), LITERAL),
    (loop(damping="feature"), "damping on J_L q̇, damping camera"),
    (loop(feed_forward=False), "ė holds the target, feed_forward on"),
    (loop(posture_damping=0.3), "no posture damping"),
    (loop().replace(control_period=1e-3), CONTINUOUS),
]  # fmt: skip


@pytest.mark.parametrize(("scenario", "name"), OF_THEOREM)
def test_each_condition_of_the_theorem_breaks_alone(scenario: ca.Scenario, name: str) -> None:
    assert broken(scenario, "theorem") == [name]


DAMPED = "symmetric part of K_p C_d + K_d not negative"
# All of symmetric positive definite factors but the last two.
OF_SOUND = [
    (loop({"Kp": UNEQUAL, "Cp": LINKED}), f"K_p C_p {SYMMETRIC}", 0.5),
    (loop({"Cs": LINKED}), "K_p C_s diagonal, not negative", 0.9 / 1.9),
    (loop({"Kp": UNEQUAL, "Cd": LINKED}), DAMPED, 0.5 + 101 / 2 - np.hypot(99 / 2, 90.9 / 2)),
    (loop().replace(control_period=1e-3), CONTINUOUS, 1e-3),
    (
        loop().replace(target=ca.Target(paths.line([0, 0, 0], [0.05, 0, 0], 0.1, 0.5))),
        "target at rest",
        1.0,
    ),
    (by_hand(posture=-1.0), "damping of the bend not negative", None),
    (by_hand(sigma=-0.02), "σ positive", -0.02),
]


@pytest.mark.parametrize(("scenario", "name", "value"), OF_SOUND)
def test_each_condition_of_the_sound_statement_breaks_alone_by_its_number(
    scenario: ca.Scenario, name: str, value: float | None
) -> None:
    found = ca.lyapunov(flights.VEHICLE, scenario).broken("sound")
    assert [each.name for each in found] == [name]
    if value is None:
        arm = flights.VEHICLE.arm
        value = arm.structural_damping * arm.length - 1.0
    if "symmetric positive" in name:
        # ‖A - Aᵀ‖ = 0.9 · 99 as a share of ‖K_p‖ ‖C_p‖ = 100 · 1.9.
        value = 0.9 * 99.0 / 190.0
    assert found[0].value == pytest.approx(value, rel=1e-3)


def test_each_need_of_the_proof_breaks_alone() -> None:
    fulfilled = {"Cd": np.zeros((8, 8)), "Cp": np.eye(8), "Cs": np.zeros((8, 8))}
    assert not broken(by_hand(**fulfilled), "proof")
    crossed = "C_p + C_s D/σ = 1 at every e"
    assert broken(by_hand(**fulfilled | {"Cd": 1e-9 * np.eye(8)}), "proof") == ["C_d = 0"]
    for off in ({"Cp": 1.1 * np.eye(8)}, {"Cs": 1e-6 * np.eye(8)}):
        assert broken(by_hand(**fulfilled | off), "proof") == [crossed]
    # Neither may be symmetric positive definite, which the theorem asks of both.
    excluded = [f"C_d {SYMMETRIC}", f"C_s {SYMMETRIC}"]
    assert broken(by_hand(**fulfilled), "theorem") == excluded


@pytest.fixture(scope="module")
def settling() -> xr.Dataset:
    return ca.simulate(flights.VEHICLE, loop(), method="RK4", step=2.5e-4, sample=2.5e-4)


def test_conditions_of_a_flight_break_alone(settling: xr.Dataset) -> None:
    lost = settling.in_view.copy()
    lost[7, 2] = 0.0
    free = settling.assign(flown_model=settling.flown_model * 0 + MODELS.index("independent"))
    for statement in ("theorem", "sound"):
        assert not broken(loop(), statement, settling)
        found = broken(loop(), statement, settling.assign(in_view=lost))
        assert found == ["every point in view"]
        assert broken(loop(), statement, free) == ["plant coupled or decoupled"]
        # Lost between two samples, as its status tells.
        ended = settling.assign(status=settling.status * 0 + UNSEEN)
        assert broken(loop(), statement, ended) == ["every point in view"]


def test_where_the_needs_of_the_proof_hold_its_v_falls_by_k_d_alone() -> None:
    """And not by -λ‖e_a‖²: at rest it does not fall at all, whatever e_a is."""
    scenario = by_hand(Cd=np.zeros((8, 8)), Cp=np.eye(8), Cs=np.zeros((8, 8)))
    run = ca.simulate(flights.VEHICLE, scenario, method="RK4", step=STEP, sample=STEP)
    found = ca.lyapunov(flights.VEHICLE, scenario, run).over_time
    bend_rate = (run.bend_rate**2).sum("bend_axis").to_numpy()
    arm = flights.VEHICLE.arm
    expected = -0.5 * (image_rate(run) ** 2).sum(-1)
    expected -= arm.structural_damping * arm.length * bend_rate
    rate = found.lyapunov_paper_rate.to_numpy()
    assert np.abs(rate - expected)[1:-1].max() < DIFFERENCES * np.abs(expected).max()
    assert np.diff(found.lyapunov_paper).max() < 0.0
    assert abs(rate[0]) < 1e-2 * np.abs(rate).max() and found.servo_error[0] > 0.05


def image_rate(run: xr.Dataset) -> np.ndarray:
    """ė, normalised, by differences of samples."""
    e = run.feature_error.transpose("time", "pixel").to_numpy() / 800.0
    return np.gradient(e, run.time.to_numpy(), axis=0)


@pytest.mark.parametrize("compensation", ["gravity_only", "literal"])
def test_the_sound_v_of_a_still_target_falls_by_its_two_dampings(compensation: str) -> None:
    scenario = loop(compensation=compensation, posture_damping=0.3)
    run = ca.simulate(flights.VEHICLE, scenario, method="RK4", step=STEP, sample=STEP)
    rate = ca.lyapunov(flights.VEHICLE, scenario, run).over_time.lyapunov_sound_rate.to_numpy()
    arm = flights.VEHICLE.arm
    bend_rate = (run.bend_rate**2).sum("bend_axis").to_numpy()
    expected = -(20.0 * 0.1 + 0.5) * (image_rate(run) ** 2).sum(-1)
    expected -= (arm.structural_damping * arm.length + 0.3) * bend_rate
    assert np.abs(rate - expected)[1:-1].max() < DIFFERENCES * np.abs(expected).max()


@pytest.mark.parametrize("model", ca.MODELS)
@pytest.mark.parametrize("compensation", ["gravity_only", "literal"])
def test_the_rate_of_the_sound_v_is_its_slope_also_with_a_held_push_and_a_moving_target(
    model: Model, compensation: str
) -> None:
    settings = {**load_gains("paper").settings, "compensation": compensation}
    gains = dataclasses.replace(load_gains("paper"), settings=settings)
    controller = gains.controller(flights.VEHICLE)
    scenario = task(flights.VEHICLE, ["M", "L"], controller, 10.0).replace(duration=0.3)
    run = ca.simulate(flights.VEHICLE, scenario, model=model, method="RK4", step=STEP, sample=STEP)
    found = ca.lyapunov(flights.VEHICLE, scenario, run).over_time
    V, rate = (found[f"lyapunov_sound{kind}"].to_numpy() for kind in ("", "_rate"))
    # Every 1 ms the push, and with it the rate, jumps: inside of a period it has a slope.
    inside = np.arange(10, V.shape[-1] - 10, 20)
    slope = (V[:, inside + 1] - V[:, inside - 1]) / (2 * STEP)
    assert np.abs(rate[:, inside] - slope).max() < DIFFERENCES * np.abs(slope).max()


def test_the_rate_of_the_sound_v_is_its_slope_also_of_gains_that_have_no_potential() -> None:
    """Products that are neither symmetric nor diagonal: V is what their symmetric part stores."""
    scenario = loop({"Kp": 5.0 * UNEQUAL**0.25, "Cp": LINKED, "Cs": 0.05 * LINKED, "Cd": 0.2})
    assert len(broken(scenario, "sound")) == 2
    run = ca.simulate(flights.VEHICLE, scenario, method="RK4", step=STEP, sample=STEP)
    found = ca.lyapunov(flights.VEHICLE, scenario, run).over_time
    slope = np.gradient(found.lyapunov_sound, STEP)[1:-1]
    rate = found.lyapunov_sound_rate.to_numpy()[1:-1]
    assert np.abs(rate - slope).max() < DIFFERENCES * np.abs(slope).max()


def test_the_preset_gains_break_what_they_break_by_name() -> None:
    vehicle = equipped(ca.load_vehicle("paper"), SETTINGS["nominal"])
    controller = load_gains("paper").controller(vehicle)
    found = ca.lyapunov(vehicle, task(vehicle, ["M"], controller, 50.0))
    names = {each: [c.name for c in found.broken(each)] for each in found.conditions}
    assert names == {
        "theorem": [LITERAL, CONTINUOUS],
        "proof": ["C_d = 0", "C_p + C_s D/σ = 1 at every e"],
        "sound": ["target at rest", "K_p C_s diagonal, not negative", CONTINUOUS],
    }


def test_the_radius_over_time_is_within_the_ultimate_one_and_ends_with_the_motion() -> None:
    target = ca.Target(paths.line([0, 0, 0], [0.01, 0, 0], 0.1, 0.5))
    scenario = loop().replace(target=target, duration=0.2)
    run = ca.simulate(flights.VEHICLE, scenario, method="RK4", step=2.5e-4, sample=2.5e-4)
    found = ca.lyapunov(flights.VEHICLE, scenario, run)
    radius = found.over_time.ultimate_radius
    assert 0.5 * found.bound["radius_least"] < radius.max() < found.bound["radius_least"]
    assert (radius.sel(time=slice(0.11, None)) == 0.0).all()
    turned = ca.lyapunov(flights.VEHICLE, scenario, run.isel(axis=[2, 0, 1], bend_axis=[1, 0]))
    xr.testing.assert_identical(turned.over_time, found.over_time)


@pytest.mark.parametrize(
    ("scenario", "match"),
    [
        (loop().replace(tip_wrench=[0.0] * 6), "scenario"),
        (loop().replace(controller=ca.stack([ca.servoing(**SCALARS)])), "scenario"),
        (loop().replace(controller=ca.hold(flights.VEHICLE, [0, 0, 3])), "scenario"),
        (None, "scenario"),
    ],
)
def test_other_loops_are_refused_by_what_they_have(scenario: Any, match: str) -> None:
    with refused(match):
        ca.lyapunov(flights.VEHICLE, scenario)


def test_a_flight_that_cannot_tell_is_refused(settling: xr.Dataset) -> None:
    flights_without: list[Any] = [3, settling.drop_vars(["depth", "command"])]
    for flight in flights_without:
        with refused("flight"):
            ca.lyapunov(flights.VEHICLE, loop(), flight)
    with refused("flight"):
        two = loop().replace(target=[flights.STILL, flights.STILL])
        ca.lyapunov(flights.VEHICLE, two, settling)


@pytest.mark.slow
def test_a_target_counts_for_as_long_as_the_flight_lasts() -> None:
    late = ca.paths.from_function(lambda t: [0.01 * max(t - 0.15, 0.0) ** 3, 0, 0], duration=1.0)
    scenario = loop().replace(target=ca.Target(late))
    flight = ca.simulate(
        flights.VEHICLE, scenario, duration=0.3, method="RK4", step=2.5e-4, sample=2.5e-4
    )
    assert "target at rest" not in broken(scenario, "sound")
    assert "target at rest" in broken(scenario, "sound", flight)
    found = ca.lyapunov(flights.VEHICLE, scenario, flight)
    assert found.bound["target_speed_m_s"] == pytest.approx(3 * 0.01 * 0.15**2, rel=1e-2)
    assert float(found.over_time.ultimate_radius[-1]) > 0.0


@pytest.mark.long
@pytest.mark.parametrize("flown", [1.0, 60.0, 400.0])
def test_the_ultimate_bound_knows_the_corners_of_a_target_however_long_it_flies(
    flown: float,
) -> None:
    """A corner of width w at the speed V is a spline of 2.25 V/w and 9 V/w² at the most."""
    corner = 0.04
    speed = 0.3 / (1.0 - corner)
    line = ca.Target(paths.line([0, 0, 0], [0.3, 0, 0], 1.0, corner))
    bound = ca.lyapunov(flights.VEHICLE, loop().replace(target=line, duration=flown)).bound
    told = [bound[f"target_{name}"] for name in ("acceleration_m_s2", "jerk_m_s3")]
    assert told == pytest.approx([2.25 * speed / corner, 9.0 * speed / corner**2], rel=0.03)


def slow_circle(t: float) -> list[float]:
    turned = 2.0 * np.pi * t / 60.0
    return [1.0 + 0.4 * np.cos(turned), 0.4 * np.sin(turned), 0.5]


@pytest.mark.long
def test_rounding_of_a_path_from_a_function_is_no_jerk_without_bound() -> None:
    path = paths.from_function(slow_circle, 60.0)
    scenario = loop().replace(target=ca.Target(path), duration=60.0)
    rate = 2.0 * np.pi / 60.0
    ratio = largest_norms(scenario)[0] / [0.4 * rate, 0.4 * rate**2, 0.4 * rate**3]
    # It adds to the largest jerk, a bound, and takes nothing away.
    assert (ratio > 1.0 - 1e-4).all() and (ratio < [1.001, 1.001, 1.3]).all()


@pytest.mark.long
@pytest.mark.parametrize(
    ("motion", "bounded"),
    [
        (paths.line([0, 0, 0], [0.3, 0, 0], 50.0, 1e-5), [True, False, True]),
        (paths.from_function(lambda t: [max(t - 1.0, 0.0) ** 2, 0, 0], 2.0), [True, True, False]),
        (paths.from_function(slow_circle, 60.0), [True, True, True]),
    ],
)
def test_what_is_seen_to_have_no_bound_is_given_none(motion: Any, bounded: list[bool]) -> None:
    scenario = loop().replace(target=ca.Target(motion), duration=motion.duration)
    assert np.isfinite(largest_norms(scenario)[0]).tolist() == bounded


def test_a_target_without_bounds_leaves_none_to_the_error() -> None:
    corner = ca.Target(paths.line([0, 0, 0], [0.3, 0, 0], 50.0, 1e-5))
    given = ca.lyapunov(flights.VEHICLE, loop().replace(target=corner, duration=50.0))
    assert np.isinf(given.bound["r_max"])


@pytest.mark.parametrize(
    ("field", "other"),
    [
        ("controller", loop({"Kp": 10.0})),
        ("gravity", loop().replace(gravity=1.62)),
        ("control_period", loop().replace(control_period=1e-3)),
    ],
)
def test_a_flight_of_another_scenario_is_refused(
    settling: xr.Dataset, field: str, other: ca.Scenario
) -> None:
    with refused("flight"):
        ca.lyapunov(flights.VEHICLE, other, settling)


def test_a_flight_after_another_target_of_the_same_name_is_refused() -> None:
    slow, fast = (
        loop().replace(target=ca.Target(paths.line([0, 0, 0], [far, 0, 0], 0.1, 0.5)))
        for far in (0.01, 0.02)
    )
    flight = ca.simulate(flights.VEHICLE, slow)
    ca.lyapunov(flights.VEHICLE, slow, flight)
    with refused("flight"):
        ca.lyapunov(flights.VEHICLE, fast, flight)


def test_a_flight_of_means_of_attitudes_is_refused(settling: xr.Dataset) -> None:
    shorter = settling.assign(attitude=0.5 * settling["attitude"])
    with refused("attitude"):
        ca.lyapunov(flights.VEHICLE, loop(), shorter)


def test_a_flight_of_another_vehicle_is_refused(settling: xr.Dataset) -> None:
    heavier = flights.VEHICLE.replace({"uav.mass": 4.0})
    with refused("flight"):
        ca.lyapunov(heavier, loop(), settling)


def test_runs_in_another_order_are_not_given_the_targets_of_others() -> None:
    targets = [ca.Target(ca.paths.circle(0.1, 10.0)), ca.Target(ca.paths.hold())]
    scenario = loop().replace(q=np.tile(flights.start(), (2, 1)), target=targets, duration=0.02)
    run = ca.simulate(flights.VEHICLE, scenario)
    radius = ca.lyapunov(flights.VEHICLE, scenario, run).over_time.ultimate_radius.max("time")
    assert radius[0] > 0.0 == radius[1]
    with refused("flight"):
        ca.lyapunov(flights.VEHICLE, scenario, run.isel(run=[1, 0]))


def test_vehicles_with_power_of_their_own_are_refused() -> None:
    """Rotors lag and saturate, and drag takes power, which the functions do not count."""
    scenario = flights.scenario(flights.designed())
    for change in (
        {
            "uav.rotors": {
                "layout": "hex_tilted",
                "tilt": 0.3,
                "lever": 0.25,
                "thrust_limits": [0.0, 12.0],
                "torque_per_thrust": 0.02,
            }
        },
        {"uav.drag": {"linear": [0.3, 0.3, 0.3]}},
        {"arm.drag_coefficient": 1.1},
    ):
        with refused("vehicle"):
            ca.lyapunov(flights.VEHICLE.replace(change), scenario)
