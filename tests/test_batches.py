"""A run is the same flight in any batch, to the last bit: its steps are its own."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.flight.prepare import prepare
from continuair.flight.provenance import PROVENANCE
from continuair.typing import Model
from tests.refusals import refused

pytestmark = pytest.mark.targets
turns_untold = pytest.mark.filterwarnings("ignore:q. roll, pitch and yaw are not followed")

RADII = [0.0012, 0.003, 0.005, 0.008]
RATIOS = [0.02, 5.0, 0.0, 1.0]
SPINS = [0.0, 0.0, 150.0, 0.0]
RUNS = range(len(RADII))
VEHICLES = ca.load_vehicle("slender").replace({"arm.radius": RADII, "arm.damping_ratio": RATIOS})
Q = np.array([0.1, -0.2, 5.0, 0.1, 0.2, -0.3, 0.5, 0.4])
RATES = np.stack([np.array([0.0, 0, 0, 0, 0, spin, 0.3, 0.2]) for spin in SPINS])
PUSHES = np.array([[3.0, 0.0, 20.0], [0.0, -2.0, 30.0], [1.0, 1.0, 0.0], [0.0, 0.0, 40.0]])


def push(t: float) -> np.ndarray:
    return PUSHES * np.cos(9.0 * t) + (t > 0.0333)


def push_of(run: int, t: float) -> np.ndarray:
    return push(t)[run]


def moment(t: float) -> list[float]:
    return [0.0, 0.3 * np.sin(31.0 * t), 0.1]


def assert_same(alone: xr.Dataset, run: xr.Dataset) -> None:
    assert set(alone.data_vars) | ({"step"} & set(run.data_vars)) == set(run.data_vars)
    # A batch tells of all its runs, and one that is flown alone of itself.
    for name in set(alone.data_vars) - {PROVENANCE}:
        np.testing.assert_array_equal(run[name], alone[name], err_msg=str(name))
    if "step" in run:
        assert float(run["step"]) == alone.attrs["step"]


METHODS: list[dict[str, Any]] = [{}, {"method": "RK4", "step": "auto"}]


@pytest.mark.parametrize("given", METHODS)
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("model", ca.MODELS)
def test_open_loops_of_arms_that_need_different_steps(
    model: Model, threads: int, given: dict[str, Any]
) -> None:
    shared: dict[str, Any] = {"moment": moment, "jumps": (0.0333,), "duration": 0.101}
    together = ca.Scenario("together", Q, RATES, force=push, **shared)
    batch = ca.simulate(VEHICLES, together, model=model, sample=2e-3, threads=threads, **given)
    taken = batch["step"] if given else batch["steps"]
    assert len(np.unique(taken)) == len(RADII), "the runs should need different steps"
    assert batch.indexes["run"].tolist() == list(RUNS)
    for run in RUNS:
        own = ca.Scenario("alone", Q, RATES[run], force=partial(push_of, run), **shared)
        alone = ca.simulate(VEHICLES.select(run), own, model=model, sample=2e-3, **given)
        assert_same(alone, batch.isel(run=run))


@pytest.mark.parametrize("given", METHODS)
@pytest.mark.parametrize("period", [2e-3, None])
def test_closed_loops_of_arms_that_need_different_steps(
    period: float | None, given: dict[str, Any]
) -> None:
    # At every stage a step is 0.1 ms at most, whatever the arm but the most damped one.
    vehicles = VEHICLES.replace({"arm.damping_ratio": [0.02, 40.0, 0.0, 1.0]})
    gains = [ca.design(vehicles.select(run), 2.0, conditioning=0.02) for run in RUNS]
    laws = [ca.servoing(**each) for each in gains]
    target = ca.Target(ca.paths.hold())
    start = [0.1, 0.0, 3.1, 0.0, 0.0, 0.0, 0.1, 0.0]

    def scenario(controller: ca.Controller) -> ca.Scenario:
        return ca.Scenario(
            "loop", start, controller=controller, target=target, control_period=period, duration=0.1
        )

    batch = ca.simulate(vehicles, scenario(ca.stack(laws)), sample=5e-3, **given)
    taken = batch["step"] if given else batch["steps"]
    assert len(np.unique(taken)) > 1, "the runs should need different steps"
    for run in RUNS:
        alone = ca.simulate(vehicles.select(run), scenario(laws[run]), sample=5e-3, **given)
        assert_same(alone, batch.isel(run=run))


def test_inputs_over_time_of_many_runs_are_sampled_in_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    vehicle, runs = ca.load_vehicle("paper"), 12
    pushes = np.linspace(1.0, 2.0, runs)[:, None] * PUSHES[0]

    def scenario(force: Any) -> ca.Scenario:
        return ca.Scenario("many", Q, force=force, duration=0.6)

    apart, shared = scenario(lambda t: pushes * np.cos(t)), scenario(lambda t: PUSHES[0])
    whole = ca.simulate(vehicle, apart, sample=0.01)
    together = ca.run_pairs(vehicle, apart, sample=0.01)
    limit = 5.5 * next(prepare(vehicle, apart, sample=0.01).parts(np.arange(1))).drive.table.nbytes
    monkeypatch.setattr("continuair.flight.cohorts.INPUT_BYTES", {"cpu": limit})
    parts = list(prepare(vehicle, apart, sample=0.01).parts())
    assert [len(part.runs) for part in parts] == [5, 5, 2]
    assert all(part.drive.table.nbytes <= limit for part in parts)
    batch = vehicle.replace({"uav.mass": np.linspace(1.0, 2.0, runs)})
    assert len(list(prepare(batch, shared, step=1e-3, sample=0.01).parts())) == 1
    xr.testing.assert_identical(ca.simulate(vehicle, apart, sample=0.01), whole)
    xr.testing.assert_identical(ca.run_pairs(vehicle, apart, sample=0.01), together)


def test_an_input_that_becomes_one_of_other_runs_is_refused() -> None:
    scenario = ca.Scenario("grows", Q, force=lambda t: PUSHES[: 1 if t < 0.5 else 3], duration=0.9)
    with refused("force"):
        ca.simulate(ca.load_vehicle("paper"), scenario)


@turns_untold
def test_runs_that_cannot_be_flown_far_do_not_change_their_neighbours() -> None:
    bends = [[0.0, 0.0], [6e3, 0.0], [0.0, 0.0]]
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": [0.0, 1.0, 5.0]})
    together = ca.Scenario("ends", Q, bend_moment=bends, duration=0.1)
    batch = ca.simulate(vehicle, together)
    assert batch["status"].values.tolist() == [0, 2, 0]
    for run in range(3):
        own = together.replace(bend_moment=bends[run])
        assert_same(ca.simulate(vehicle.select(run), own), batch.isel(run=run))


@pytest.mark.filterwarnings("ignore:q. roll, pitch and yaw are not followed")
def test_a_run_that_spins_fast_does_not_change_the_angles_of_its_neighbours() -> None:
    # Samples are so far apart that the spin between them says which Euler angles come next.
    rng, runs = np.random.default_rng(0), 60
    q, qd = np.tile(Q, (runs + 1, 1)), np.zeros((runs + 1, 8))
    qd[:runs, 3:6] = rng.uniform(-120.0, 120.0, (runs, 3))
    qd[runs, 3] = 900.0
    q[:, 3:6] = rng.uniform(-1.0, 1.0, (runs + 1, 3)) * [3.0, 1.5, 3.0]
    q[:, 6] = 0.05
    vehicle = ca.load_vehicle("paper").replace({"arm.length": 0.3})

    def angles(at: Any) -> np.ndarray:
        scenario = ca.Scenario("spin", q[at], qd[at], duration=0.3)
        return ca.simulate(vehicle, scenario, sample=0.01, variables=["q"])["q"].to_numpy()

    batch = angles(slice(None))
    for run in range(runs):
        np.testing.assert_array_equal(batch[run], angles(run))


def test_notes_on_one_trajectory_do_not_appear_on_the_next() -> None:
    vehicle, scenario = ca.load_vehicle("paper"), ca.Scenario("short", Q, duration=0.01)
    first = ca.simulate(vehicle, scenario)
    first["axis"].attrs["note"], first["time"].attrs["note"] = "mine", "mine"
    again = ca.simulate(vehicle, scenario)
    assert "note" not in again["axis"].attrs | again["time"].attrs


@pytest.mark.long
def test_arms_one_of_which_has_other_lengths_fly_from_a_single_start() -> None:
    """The other arm, and the start, are those of every run."""
    vehicles = ca.load_vehicle("dual_arm").replace({"arm.right.section.0.length": [0.4, 0.5]})
    flight = ca.Scenario("fall", np.zeros(10), np.full(10, 0.1), duration=0.01)
    batch = ca.simulate(vehicles, flight)
    for run in range(2):
        assert_same(ca.simulate(vehicles.select(run), flight), batch.isel(run=run))
