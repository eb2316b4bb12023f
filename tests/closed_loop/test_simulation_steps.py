"""Stepping from outside is `simulate` with the same held inputs."""

import copy
from threading import Thread
from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026 import open_loop_test
from continuair.typing import Model
from tests.closed_loop import flights
from tests.refusals import refused

PERIOD, PERIODS = 2e-3, 150
VEHICLE = flights.VEHICLE.replace({"uav.mount": [0.02, -0.01, 0.03]})
HELD = np.random.default_rng(9).normal(0.0, [2, 2, 2, 0.1, 0.1, 0.1, 0.5, 0.2], (PERIODS, 8))
HELD[:, 2] += 26.0
INSTANTS = PERIOD * np.arange(1, PERIODS)
turns_untold = pytest.mark.filterwarnings("ignore:q. roll, pitch and yaw are not followed")


def wrench(t: float) -> list[float]:
    """Jumps inside a control period, and at the start of one."""
    return [1.0 + (t > 0.0511), np.sin(9.0 * t), 2.0 * (t > 0.1), 0.0, 0.1, 0.0]


def scenario(**changes: Any) -> ca.Scenario:
    fields: dict[str, Any] = {"q": [0.1, -0.2, 3.0, 0.1, -0.1, 0.3, 0.4, 0.7], "target": None}
    fields |= {"qd": [0.1, 0, 0, 0.2, 0.5, -0.3, 1.0, 2.0]}
    fields |= {"tip_wrench": wrench, "jumps": (0.0511, 0.1), "duration": PERIOD * PERIODS}
    return ca.Scenario("held", **(fields | changes))


def held(t: float) -> Any:
    return HELD[np.searchsorted(INSTANTS, t, side="right")]


@pytest.mark.filterwarnings("ignore:step")
@pytest.mark.parametrize("model", ca.MODELS)
def test_held_inputs_give_the_same_flight_to_rounding(model: Model) -> None:
    jumping = scenario(jumps=(*INSTANTS.tolist(), 0.0511))
    sim = ca.Simulation(VEHICLE, jumping, model=model, control_period=PERIOD)
    for tau in HELD:
        sim.step(tau)
    given = jumping.replace(tau=held)
    stepped = sim.trajectory()
    whole = ca.simulate(
        VEHICLE, given, model=model, sample=PERIOD, method="RK4", step=stepped.attrs["step"]
    )
    assert sim.time == pytest.approx(PERIOD * PERIODS, rel=1e-13)
    assert stepped.status == whole.status == 0
    assert set(stepped.data_vars) == set(whole.data_vars)
    for name in set(stepped.data_vars) - {"provenance"}:
        # The inputs at the very end differ: `held` has none of its own there.
        one, other = (np.asarray(run.isel(time=slice(-1))[name], float) for run in (stepped, whole))
        scale = 1.0 + np.abs(other).max()
        np.testing.assert_allclose(one, other, atol=1e-11 * scale, rtol=0.0, err_msg=str(name))
    np.testing.assert_allclose(sim.state[:3], whole.position[-1], rtol=0, atol=2e-11)
    np.testing.assert_allclose(sim.q[:3], sim.state[:3], rtol=0, atol=0)


@pytest.mark.parametrize(
    ("period", "jumps"),
    [
        (0.01, (0.35,)),
        (0.01, (0.41, 0.41 + 1e-13)),
        (1e-3, (0.009, 0.013)),
        (1e-3, (0.009 - 1e-13, 0.009)),
    ],
)
def test_a_jump_at_an_edge_that_rounds_past_it_is_met_from_its_own_side(
    period: float, jumps: tuple[float, ...]
) -> None:
    """n periods round to above the jump or below it, and the push of either side is 40 N."""

    def force(t: float) -> Any:
        return [40.0 if t >= max(jumps) else 0.0, 0.0, 26.0]

    periods = round(max(jumps) / period) + 3
    push = scenario(tip_wrench=None, force=force, jumps=jumps, duration=periods * period)
    sim = ca.Simulation(VEHICLE, push, step=period / 8, control_period=period)
    for _ in range(periods):
        sim.step(np.zeros(8))
    stepped, whole = (
        sim.trajectory(),
        ca.simulate(VEHICLE, push, sample=period, method="RK4", step=period / 8),
    )
    for name in ("position", "bend", "velocity", "bend_rate", "base_force", "time"):
        np.testing.assert_allclose(stepped[name], whole[name], rtol=0, atol=1e-9, err_msg=name)


def test_a_flight_that_ends_at_a_jump_meets_it_from_before() -> None:
    push = scenario(tip_wrench=None, force=lambda t: [40.0 * (t >= 0.02), 0, 26.0], jumps=(0.02,))
    ended, still = (
        ca.simulate(VEHICLE, each, duration=0.02, sample=1e-3, method="RK4", step=1e-3)
        for each in (push, push.replace(force=[0, 0, 26.0], jumps=()))
    )
    np.testing.assert_allclose(ended.position, still.position, rtol=0, atol=1e-14)


def test_rates_are_the_slopes_of_the_coordinates() -> None:
    sim = ca.Simulation(VEHICLE, scenario(), control_period=1e-4)
    np.testing.assert_allclose(sim.q, np.asarray(scenario().q), rtol=0, atol=5e-15)
    np.testing.assert_allclose(sim.qd, np.asarray(scenario().qd), rtol=0, atol=5e-15)
    rows = []
    for _ in range(3):
        sim.step(HELD[0])
        rows.append((sim.q, sim.qd))
    slope = (rows[2][0] - rows[0][0]) / 2e-4
    np.testing.assert_allclose(rows[1][1], slope, rtol=1e-3, atol=1e-4)


def test_rates_beside_a_straight_arm_are_those_of_the_start() -> None:
    """A bend below kappa_s, by which the paper's torques alone are divided."""
    start = ca.Scenario("beside", [0, 0, 3, 0, 0, 0, 5e-4, 0.3], qd=[0, 0, 0, 0, 0, 0, 0.2, 700.0])
    assert VEHICLE.arm.kappa_s > 5e-4
    np.testing.assert_allclose(ca.Simulation(VEHICLE, start).qd, np.asarray(start.qd), rtol=1e-12)


@turns_untold
def test_angles_pass_through_a_tumble_as_those_of_simulate_do() -> None:
    q = [0, 0, 5.0, 0, 0, 0, 0.1, 0]
    tumble = ca.Scenario("tumble", q, qd=[0, 0, 0, 0.3, 8.0, 0.2, 0, 0], moment=[0, 4.0, 0])
    sim = ca.Simulation(VEHICLE, tumble, control_period=1e-2)
    found = [sim.q]
    for _ in range(100):
        sim.step(np.zeros(8))
        found.append(sim.q)
    euler = np.array(found)[:, 3:6]
    assert np.abs(np.diff(euler, axis=0)).max() < 2.0
    # Past straight up, and round and round.
    assert np.abs(euler).max() > 3 * np.pi
    whole = ca.simulate(VEHICLE, tumble, duration=1.0, sample=1e-2, rtol=1e-9, variables=["q"])
    np.testing.assert_allclose(found, whole.q, rtol=0, atol=1e-3)


def test_it_sees_what_the_closed_loop_sees() -> None:
    target = ca.Target(ca.paths.circle(0.1, period=1.0))
    start = flights.start()
    sim = ca.Simulation(flights.VEHICLE, flights.scenario(None, q=start, target=target))
    run = ca.simulate(
        flights.VEHICLE, flights.scenario(flights.designed(), 0.01, q=start, target=target)
    )
    seen, first = sim.observe(), run.isel(time=0)
    # Rounding of some 500 px, and of metres.
    np.testing.assert_allclose(seen.features, first.features, rtol=0, atol=5e-12)
    np.testing.assert_allclose(
        seen.desired - seen.features, first.feature_error, rtol=0, atol=5e-12
    )
    np.testing.assert_allclose(seen.depth, first.depth, rtol=0, atol=1e-14)
    np.testing.assert_allclose(seen.target_velocity, first.target_velocity, rtol=0, atol=1e-14)
    np.testing.assert_allclose(seen.camera_position, first.camera_position, rtol=0, atol=1e-14)
    assert seen.in_view.all()
    for _ in range(5):
        sim.step([0, 0, 26.0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(
        sim.trajectory().features[-1], sim.observe().features, rtol=0, atol=5e-12
    )


def test_a_flight_that_bends_too_far_ends_and_keeps_what_was_recorded() -> None:
    sim = ca.Simulation(flights.VEHICLE, flights.scenario(None, target=None), control_period=0.01)
    while sim.status == "ok":
        sim.step([0, 0, 26.0, 0, 0, 0, 2000.0, 0])
    run = sim.trajectory()
    assert run.status == 2
    assert sim.time <= float(run.end_time) <= sim.time + 0.01
    assert np.isfinite(run.bend).all() and len(run.time) == round(sim.time / 0.01) + 1
    with refused("step"):
        sim.step(np.zeros(8))


def test_nothing_has_flown_yet() -> None:
    run = ca.Simulation(VEHICLE, scenario()).trajectory()
    assert float(run.end_time) == 0.0 and run.sizes["time"] == 1


@pytest.mark.filterwarnings("ignore:step")
def test_named_pushes_are_those_of_a_scenario() -> None:
    """They add up with one another and with the scenario's own."""
    pushes = {
        "force": [0.5, -0.2, 26.0],
        "moment": [0.01, -0.02, 0.005],
        "bend_moment": [0.4, -0.3],
        "tip_wrench": [0.2, 0.1, -0.3, 0.01, 0.02, -0.01],
        "tau": [0.1, 0.2, 0.3, 0.01, 0.02, -0.01, 0.2, 0.1],
    }
    sim = ca.Simulation(VEHICLE, scenario(tip_wrench=None, jumps=()), control_period=PERIOD)
    for _ in range(50):
        sim.step(**pushes)
    stepped = sim.trajectory()
    given = scenario(**pushes, jumps=(), duration=50 * PERIOD)
    whole = ca.simulate(VEHICLE, given, sample=PERIOD, method="RK4", step=stepped.attrs["step"])
    for name in ("attitude", "bend", "tip_position", "base_force", "base_moment"):
        one, other = stepped[name].to_numpy(), whole[name].to_numpy()
        # What acts is kept from the start of a period on, and the first row is of the first.
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-10 * (1 + np.abs(other).max()))


def test_a_spring_at_the_tip_that_a_program_adds_takes_and_gives_back_energy() -> None:
    """A force held for a period errs by the first power of its length."""
    rest, stiffness = 2.0, 40.0

    def lost(period: float) -> float:
        start = {"q": [0, 0, 3.0, 0.1, 0, 0, 0.4, 0.7], "qd": None, "tip_wrench": None, "jumps": ()}
        undamped = ca.load_vehicle("paper")
        sim = ca.Simulation(undamped, scenario(**start), control_period=period)
        stored = []
        for _ in range(round(0.3 / period)):
            flight = sim.trajectory().isel(time=-1)
            deep = rest - float(flight.tip_position[2])
            stored.append(float(flight.kinetic_energy + flight.gravity_energy))
            stored[-1] += float(flight.elastic_energy) + 0.5 * stiffness * deep**2
            sim.step(tip_wrench=[0, 0, stiffness * deep, 0, 0, 0])
        assert deep > 0.2
        return stored[-1] - stored[0]

    coarse, fine, finest = lost(1e-2), lost(5e-3), lost(2.5e-3)
    assert fine == pytest.approx(coarse / 2.0, rel=0.2)
    assert finest == pytest.approx(fine / 2.0, rel=0.1)


def simulation(**words: Any) -> ca.Simulation:
    given: dict[str, Any] = {"vehicle": VEHICLE, "scenario": scenario()} | words
    return ca.Simulation(given.pop("vehicle"), given.pop("scenario"), **given)


REFUSED: dict[str, tuple[Any, str]] = {
    "vehicle": (lambda: simulation(vehicle=3), "vehicle"),
    "scenario": (lambda: simulation(scenario="A"), "scenario"),
    "model": (lambda: simulation(model="stiff"), "model"),
    "step": (lambda: simulation(step=0), "step"),
    "period": (lambda: simulation(control_period=0), "control_period"),
    "tau": (lambda: simulation().step([1, 2]), "tau"),
    "tau nan": (lambda: simulation().step([np.nan] * 8), "tau"),
    "tip wrench": (lambda: simulation().step(tip_wrench=[1.0]), "tip_wrench"),
    "wind": (
        lambda: simulation().step(wind=[1, 0, 0]),
        "wind",
    ),
    "rotors": (
        lambda: simulation().step(rotor_command=[1]),
        "rotor_command",
    ),
    "no target": (lambda: simulation().observe(), "target"),
    "controller": (
        lambda: simulation(scenario=flights.scenario(flights.designed())),
        "controller",
    ),
    "vehicles": (
        lambda: simulation(vehicle=VEHICLE.replace({"uav.mass": [2.0, 2.1]})),
        "vehicle",
    ),
    "starts": (
        lambda: simulation(scenario=scenario(q=[scenario().q, scenario().q])),
        "vehicle",
    ),
    "functions": (
        lambda: simulation(scenario=scenario(force=lambda t: [[1.0, 0.0, 0.0], [0.0, t, 0.0]])),
        "vehicle",
    ),
    "winds": (
        lambda: simulation(
            vehicle=VEHICLE.replace({"uav.drag": {"linear": [0.1, 0.1, 0.1]}}),
            scenario=scenario(wind=ca.dryden(5.0, 10.0, 5.0, seed=[1, 2, 3])),
        ),
        "vehicle",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_stepped_is_refused_in_one_sentence(case: str) -> None:
    act, field = REFUSED[case]
    with refused(field):
        act()


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_a_simulation_is_not_copied_as_both_would_fly_one_flight(copied: Any) -> None:
    one = ca.Simulation(ca.load_vehicle("paper"), open_loop_test("B"), control_period=0.01)
    with refused("Simulation"):
        copied(one)


def test_threads_that_step_one_simulation_at_a_time_are_told() -> None:
    """Of steps that are asked for at once all but one are refused, and none is mixed up."""
    sim = ca.Simulation(VEHICLE, scenario(), control_period=PERIOD)
    sim.step()
    refused: list[str] = []

    def step() -> None:
        for _ in range(100):
            try:
                sim.step()
            except ca.InputError as error:
                refused.append(str(error))

    threads = [Thread(target=step) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all("another thread" in each for each in refused)
    taken = 1 + 400 - len(refused)
    assert sim.time == pytest.approx(taken * PERIOD)
    alone = ca.Simulation(VEHICLE, scenario(), control_period=PERIOD)
    for _ in range(taken):
        alone.step()
    np.testing.assert_array_equal(sim.state, alone.state)
