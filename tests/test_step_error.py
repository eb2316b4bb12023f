"""Every run says how well its step resolved it, and one that did not is flown again."""

import warnings
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.flight import rollout
from continuair.scenario.scenarios import Scenario

VEHICLE = ca.load_vehicle("paper")
# A light UAV and a large bend, let go: the swing of the arm throws it about.
LIGHT = VEHICLE.replace(
    {"uav.mass": 0.3, "uav.inertia": [0.003, 0.003, 0.005], "arm.damping_ratio": 0.0}
)


def released(angle: float, duration: float = 1.0) -> Scenario:
    """Bent by an angle [rad] of the tip, off straight down."""
    q = [0, 0, 0, 0.3, -0.2, 0, angle / VEHICLE.arm.length, 0.4]
    return Scenario("released", q, duration=duration)


def error(vehicle: ca.Vehicle, scenario: Scenario, step: float, model: str = "coupled") -> float:
    """The largest error of the tip in arm lengths, against an eighth of the step."""
    tips = [
        ca.simulate(vehicle, scenario, model=model, step=h, sample=0.01).tip_position.to_numpy()
        for h in (step, step / 8)
    ]
    return float(np.linalg.norm(tips[0] - tips[1], axis=1).max() / vehicle.arm.length)


@pytest.mark.parametrize("model", ["coupled", "decoupled", "independent"])
@pytest.mark.parametrize("angle", [0.2, 1.5])
def test_it_is_the_error_of_a_regular_flight_within_a_factor(angle: float, model: str) -> None:
    scenario, step = released(angle, 0.5), 1e-3
    flight = ca.simulate(VEHICLE, scenario, model=model, step=step, sample=0.01)
    actual = error(VEHICLE, scenario, float(flight.attrs["step"]), model)
    assert actual / 2 < float(flight.step_error) < 50 * actual


def test_it_falls_as_steps_become_finer() -> None:
    """By less than the fourth power: far below the automatic step it is a bound."""
    errors = [
        float(ca.simulate(VEHICLE, released(1.0), step=h, sample=0.01).step_error)
        for h in (5e-4, 2.5e-4)
    ]
    assert 2.5 < np.log2(errors[0] / errors[1]) < 4.5


def test_a_step_that_does_not_resolve_a_flight_is_told_of_once() -> None:
    with pytest.warns(ca.ContinuairWarning) as told:
        flight = ca.simulate(LIGHT, released(6.2), step=1e-3, sample=0.01)
    (said,) = [str(each.message) for each in told if "step_error" in str(each.message)]
    assert "steps of 0.001 s do not resolve this flight" in said
    assert float(flight.step_error) > 1e-3
    assert flight.attrs["flown_again"] == 0


@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
def test_a_flight_that_an_automatic_step_does_not_resolve_is_flown_again_at_half() -> None:
    """What is left is measured: close to what a far finer step tells."""
    scenario = released(6.2)
    flight = ca.simulate(LIGHT, scenario, sample=0.01)
    assert flight.attrs["flown_again"] == 1
    taken = flight.attrs["step"]
    same = ca.simulate(LIGHT, scenario, step=taken, sample=0.01)
    np.testing.assert_array_equal(flight.tip_position, same.tip_position)
    actual = error(LIGHT, scenario, taken)
    assert actual / 5 < float(flight.step_error) < 5 * actual


@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
@pytest.mark.parametrize(
    ("force", "sample", "ends"), [(2e3, 0.02, 0), (5e3, 0.02, 2), (5e4, 0.01, 1), (5e4, 0.02, 2)]
)
def test_steps_that_are_too_long_for_what_comes_later_are_not_resolved(
    force: float, sample: float, ends: int
) -> None:
    """Pushed to speeds at which thick air is stiffer than the arm: steps blow up, some at once and
    in the same step as half of them, although the vehicle flies on; what both have flown tells
    nothing."""
    thick = ca.load_vehicle("slender").replace(
        {"arm.youngs_modulus": 4e9, "uav.drag": {"quadratic": [40.0, 40.0, 40.0]}}
    )
    start = ca.Scenario(
        "pushed", (0, 0, 0, 0.1, 0.2, 0, 0.3, 0), force=(force, 0, 9.81 * thick.mass), duration=1.0
    )
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        flight = ca.simulate(thick, start, sample=sample)
    assert flight.attrs["flown_again"] == 1 and float(flight["step_error"]) >= 1.0
    assert int(flight.status) == ends
    exact = ca.simulate(thick, start, sample=sample, method="DOP853")
    assert int(exact.status) == 0


def test_errors_that_do_not_fall_with_the_step_are_told_as_steps_have_them() -> None:
    """An arm that swings at 30 rad/s, let go in air that stops it at hundreds a second: neither
    the step nor half of it follows, and their difference is no fifteenth of anything."""
    arm = {"length": 0.6, "mass_per_length": 0.002, "bending_stiffness": 0.01, "radius": 0.02}
    uav = {"mass": 1.0, "inertia": [0.015, 0.018, 0.03], "mount": [0.0, 0.0, -0.05]}
    light = ca.Vehicle(name="light", uav=uav, arm={**arm, "drag_coefficient": 1.2})
    scenario = Scenario(
        "let go", (0, 0, 3, 0, 0, 0, 4.0, 0.4), force=(0, 0, 9.81 * light.mass), duration=0.5
    )
    flight = ca.simulate(light, scenario, sample=0.02)
    exact = ca.simulate(light, scenario, sample=0.02, method="DOP853")
    off = float(np.linalg.norm(flight.tip_position - exact.tip_position, axis=1).max()) / 0.6
    assert off < max(1e-3, 3.0 * float(flight.step_error))


@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
def test_only_the_unresolved_runs_of_a_batch_are_flown_again() -> None:
    calm, wild = released(0.2), released(6.2)
    both = wild.replace(q=np.stack([calm.q, wild.q]))
    batch = ca.simulate(LIGHT, both, sample=0.01)
    assert batch.attrs["flown_again"] == 1
    for run, scenario in enumerate((calm, wild)):
        alone = ca.simulate(LIGHT, scenario, sample=0.01)
        assert float(batch["step"][run]) == alone.attrs["step"]
        assert float(batch["step_error"][run]) == float(alone["step_error"])
        np.testing.assert_array_equal(batch.tip_position[run], alone.tip_position)


@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
@pytest.mark.parametrize("angle", [0.2, 6.2])
def test_pairs_tell_it_of_every_model(angle: float) -> None:
    pairs = ca.run_pairs(LIGHT, released(angle), ["decoupled"], sample=0.01)
    models = ["coupled", "decoupled"] if angle < 1.0 else ["coupled"]
    for model in models:
        flight = ca.simulate(LIGHT, released(angle), model=model, sample=0.01)
        assert flight.attrs["flown_again"] == (angle > 1.0)
        assert float(pairs["step"][0]) == flight.attrs["step"]
        told = float(pairs["step_error"].sel(model=model)[0])
        assert told == pytest.approx(float(flight.step_error), rel=1e-9)


def test_the_reference_integrator_keeps_its_own_account() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        flight = ca.simulate(VEHICLE, released(0.2, 0.05), method="DOP853", sample=0.05)
    assert np.isnan(float(flight.step_error))


@pytest.mark.filterwarnings("ignore:step_error reaches")
@pytest.mark.parametrize("ratio", [None, 1.0])
def test_a_loop_far_from_its_target_that_a_control_period_does_not_resolve(
    ratio: float | None,
) -> None:
    """Its law multiplies the errors of steps by hundreds."""
    vehicle = VEHICLE if ratio is None else VEHICLE.replace({"arm.damping_ratio": ratio})
    scenario = Scenario(
        "far", [-0.1, 0.1, 2.1 + vehicle.arm.length, 0, 0, 0, 0.1, 0.5],
        controller=ca.servoing(**ca.design(vehicle, bandwidth=4.0)),
        target=ca.Target(ca.paths.letter("R", duration=10.0)), duration=3.0,
    )  # fmt: skip
    flight = ca.simulate(vehicle, scenario, sample=0.01)
    assert flight.attrs["flown_again"] == 1
    actual = error(vehicle, scenario, flight.attrs["step"])
    assert actual / 5 < float(flight.step_error) < 5 * actual


def light(damping_ratio: float = 0.03) -> ca.Vehicle:
    """A racer of 250 g with an arm of 15 cm and 12 g at its tip."""
    return VEHICLE.replace(
        {
            "uav.mass": 0.25, "uav.inertia": [2.2e-4, 2.6e-4, 4.1e-4], "arm.length": 0.15,
            "arm.radius": 0.0015, "arm.density": 1300.0, "arm.youngs_modulus": 2e9,
            "arm.damping_ratio": damping_ratio,
            "arm.disks": [{"position": 0.15, "mass": 0.012, "inertia": [8e-7, 5e-7]}],
        }
    )  # fmt: skip


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_a_loop_around_a_camera_that_multiplies_rounding_is_told_of(dtype: str) -> None:
    """Constant gains throw a light vehicle about: a start 1 nm aside ends elsewhere at any step."""
    vehicle = light()
    law = ca.servoing(**ca.design(vehicle, 6.0))
    starts = np.array([[x, -x, 2.15 + x, 0, 0, 0, 0.1, 1.0] for x in (0.04, 0.06, -0.08)])
    far = Scenario("far", starts, controller=law, target=ca.Target(ca.paths.hold()), duration=1.0)
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches .* in 3 of 3 runs"):
        ca.simulate(vehicle, far, sample=0.01, dtype=dtype)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        near = far.replace(q=starts[0] + [-0.039, 0.039, -0.039, 0, 0, 0, -0.099, 0])
        calm = ca.simulate(vehicle, near, sample=0.01, dtype=dtype)
    assert float(calm.step_error) < 1e-3 and calm.attrs["flown_again"] == 0


def test_errors_that_polar_torques_multiply_are_told_of() -> None:
    """A torque outwards along the bend turns with it: what a step errs by grows a thousandfold."""
    vehicle = ca.load_vehicle("slender").replace({"arm.length": 0.5})
    outwards = vehicle.arm.bending_stiffness
    scenario = Scenario(
        "outwards",
        [0, 0, 3, -0.09628878, 0.01491212, 0.19088877, 0.1225078, -0.44643315],
        [0, 0, 0, 0, 0, 0, 0.70056728, 1.0],
        tau=[0, 0, vehicle.mass * 9.81, 0, 0, 0, outwards, 0],
        duration=0.6,
    )
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        flight = ca.simulate(vehicle, scenario, sample=0.02)
    actual = error(vehicle, scenario, flight.attrs["step"])
    assert 1e-3 < actual < float(flight.step_error)


def under_polar_torque(direction: float, offset: float) -> Scenario:
    """The arm swings through straight, or past it at about an offset [1/m], under a torque on κ."""
    rate = VEHICLE.arm.clamped_frequency
    q = [0, 0, 0, 0, 0, 0, 0.3, direction]
    push = 0.05 * VEHICLE.arm.bending_stiffness
    return Scenario(
        "past straight", q, [0, 0, 0, 0, 0, 0, 0, rate * offset / 0.3], gravity=0.0, duration=0.2,
        tau=lambda t: [0, 0, 0, 0, 0, 0, push * np.sin(0.3 * rate * t + 0.5), 0],
    )  # fmt: skip


def test_polar_torques_past_a_straight_arm_are_told_of_where_they_hang_on_the_step() -> None:
    """In a plane κ changes its sign at any step; beside it, by whether a step sees the turn."""
    straight, beside = (under_polar_torque(0.7, offset) for offset in (0.0, 1e-2))
    assert error(VEHICLE, straight, 1e-3) < 1e-3
    assert float(ca.simulate(VEHICLE, straight, step=1e-3, sample=0.01).step_error) < 1e-3
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        flight = ca.simulate(VEHICLE, beside, step=1e-3, sample=0.01)
        assert error(VEHICLE, beside, 1e-3) > 1e-3
    assert float(flight.step_error) > 1e-2


def test_flights_whose_errors_cannot_grow_so_far_are_flown_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """So are those of loops, which decay."""
    flown: list[object] = []

    def counted(recorder: Any, *runs: Any) -> None:
        flown.append(recorder)
        rollout.record(recorder, *runs)

    monkeypatch.setattr("continuair.flight.resolving.record", counted)
    ca.simulate(VEHICLE, released(0.01, 0.2), sample=0.01)
    loop = Scenario("hold", released(0.2).q, controller=ca.hold(VEHICLE, [0, 0, 0]), duration=2.0)
    ca.simulate(VEHICLE, loop, sample=0.01)
    assert len(flown) == 2
    ca.simulate(VEHICLE, released(0.2, 2.0), sample=0.01)
    assert len(flown) == 3
    ca.simulate(VEHICLE, released(0.2, 20.0), sample=0.01)
    assert len(flown) == 5


def toppling() -> tuple[ca.Vehicle, Scenario]:
    """Two limp arms on top of their UAV, which fall."""

    def limp(mount: list[float], length: float, mass: float, EI: float, tip: float) -> Any:
        return {
            "mount": mount,
            "attitude": [1.0, 0.0, 0.0, 0.0],
            "section": [{"length": length, "mass_per_length": mass, "bending_stiffness": EI}],
            "tip": {"mass": tip, "centre": [0.0, 0.0, 0.02], "inertia": [2e-5, 2e-5, 1e-5]},
        }

    front = {"name": "front"} | limp([0.12, 0.0, 0.05], 0.689, 0.141, 0.1417, 0.0583)
    back = {"name": "back"} | limp([-0.0885, 0.0811, 0.05], 0.2936, 0.00577, 0.000274, 0.1274)
    uav = {"mass": 3.727, "inertia": [0.0863, 0.1007, 0.1583]}
    q = [0, 0, 5, 0, 0, 0, 0, -1.283, 2.928, 0.32]
    scenario = Scenario("topples", q, [1.18, 1.15, 0.38, *[0.0] * 7], force=[0, 0, 39.35])
    return ca.Vehicle(name="two", uav=uav, arm=[front, back], camera={"arm": "back"}), scenario


def test_a_flight_that_only_its_steps_end_is_not_told_as_resolved() -> None:
    """At both steps an arm goes beyond a circle, at other times; at fine ones it does not."""
    vehicle, scenario = toppling()
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        found = ca.simulate(vehicle, scenario, sample=0.02)
    fine = ca.simulate(vehicle, scenario, sample=0.02, step=2e-4)
    assert int(found.status) == 2 and int(fine.status) == 0
    assert float(found.step_error) >= 1.0
