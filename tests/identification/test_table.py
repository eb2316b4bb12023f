"""The readings of the paper's table, and the search for the vehicle behind it."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import qmc
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.equations import forward_dynamics
from continuair.flight.time_grid import make_grid, sample_inputs, stage_times
from continuair.identification import search as search_module
from continuair.identification.diagonal import DiagonalEngine
from continuair.identification.evolution import adapt
from continuair.identification.flights import FINAL, SEARCH
from continuair.identification.objective import TABLE, evaluate, objective, read
from continuair.identification.readings import READINGS, TIP_FORCES, Flight, Reading
from continuair.identification.search import Effort, search
from continuair.identification.space import PARAMETERS, held, values, vehicles
from continuair.identification.table import CAUTION, as_table, numbers_of, sentence, summarise
from continuair.scenario.paper_tests import bend_torques, tip_chirp
from continuair.studies.open_loop.study import open_loop
from continuair.vehicle import vehicle as vehicle_module
from continuair.vehicle.layout import ONE_SECTION

PRINTED_WAY = Flight("block", "down", 1, "reversed")


def batch_of(vehicle: ca.Vehicle, runs: int = 1) -> ca.Vehicle:
    return vehicle.replace({"uav.mass": np.full(runs, vehicle.uav.mass)})


def some_shares(runs: int, seed: int = 0) -> np.ndarray:
    """Vehicles away from the corners of the bounds."""
    return 0.3 + 0.4 * np.random.default_rng(seed).random((runs, len(PARAMETERS)))


def test_the_diagonal_reading_is_that_of_the_readable_form() -> None:
    disk = {"position": 0.9, "mass": 0.1, "inertia": [1e-4, 5e-5]}
    changes: dict[str, Any] = {"arm.disks": [disk], "uav.mount": [0.01, 0.02, -0.1]}
    vehicle = ca.load_vehicle("paper").replace(changes | {"arm.damping": 0.3})
    rng = np.random.default_rng(0)
    states, inputs = rng.normal(size=(6, 16)), rng.normal(size=(6, 11))
    states[:, 6] = 1.5, -2.0, 0.4, 0.02, -3.0, 4e-4  # the last is below kappa_s
    found = DiagonalEngine(batch_of(vehicle, 6), 1).accelerations(states, inputs, 9.81)
    for state, row, ours in zip(states, inputs, found, strict=True):
        wrench = np.append(row[8:], np.zeros(3))
        theirs = forward_dynamics(
            vehicle, state[:8], state[8:], row[:8], wrench, mask="diagonal", nodes=24
        )
        # Ten Gauss nodes against 24, and Appendix A, which cancels at small bends.
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


def test_the_diagonal_roll_out_is_the_readable_form_integrated() -> None:
    vehicle, until = ca.load_vehicle("paper"), 0.02
    scenario = ca.open_loop_test("D")
    grid = make_grid(until, 2.5e-4, 0.01)
    table, stride = sample_inputs(scenario, stage_times(grid), ONE_SECTION)
    inputs = np.zeros((len(table), 11))
    inputs[:, 8:] = table[:, 0, ONE_SECTION.tip_wrench][:, :3]
    start = np.append(scenario.q, np.zeros(8))
    # Away from straight, where M_88 vanishes and κ_s makes the rates jump.
    start[6] = 1.5
    found = DiagonalEngine(vehicle, 1).roll_out(start[None], grid, (inputs, stride), 9.81)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        wrench = -np.array(tip_chirp(t))
        a = forward_dynamics(vehicle, y[:8], y[8:], 0.0, wrench, mask="diagonal", nodes=12)
        return np.append(y[8:], a)

    exact = solve_ivp(rate, (0.0, until), start, "DOP853", rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found[0, -1], exact.y[:, -1], rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("metric", ["nrmse", "rmse"])
def test_the_readings_of_the_study_open_loop_are_among_them(metric: str) -> None:
    vehicle = ca.load_vehicle("paper")
    found = read(batch_of(vehicle), [Reading(PRINTED_WAY, metric, "euler")], FINAL)[0, 0]
    entries = open_loop(vehicle, "ABD", ["decoupled"]).results["tests"]
    keys = ("nrmse_t", "nrmse_r") if metric == "nrmse" else ("rmse_t_m", "rmse_r_rad")
    for column, test in ((0, "A"), (1, "B"), (3, "D")):
        for row, key in enumerate(keys):
            assert found[row, column] == pytest.approx(entries[test]["decoupled"][key], rel=1e-3)


@pytest.mark.parametrize("decoupled", ["block", "independent"])
def test_an_arm_that_stands_flies_as_a_vehicle_turned_upside_down(decoupled: str) -> None:
    vehicle = ca.load_vehicle("paper").replace({"uav.mount": [0.0, 0.0, -0.1]})
    flight = Flight(decoupled, "up", 1, "reversed")
    chosen = [Reading(flight, "rmse", "euler"), Reading(flight, "rmse", "geodesic")]
    found = read(batch_of(vehicle), chosen, FINAL)[0]
    model = {"block": "decoupled"}.get(decoupled, decoupled)
    for column, test in enumerate("ABCD"):
        scenario = ca.open_loop_test(test)
        q = np.array(scenario.q)
        q[3] = np.pi
        if test == "C":  # seen from below, the bend turns the other way
            turned = np.array([1, 1, 1, 1, 1, 1, 1, -1])
            scenario = scenario.replace(tau=lambda t, turned=turned: turned * bend_torques(t))
        flown = [
            ca.simulate(vehicle, scenario.replace(q=q), model=name, step=2.5e-4)
            for name in ("coupled", model)
        ]
        apart = ca.compare(*flown)
        # Test C divides by the bend, and remembers every step.
        rel = 0.02 if test == "C" else 1e-4
        assert found[0, 0, column] == pytest.approx(apart["rmse_t_m"], rel=rel)
        assert found[1, 1, column] == pytest.approx(apart["angle_rad"], rel=rel)


def test_the_frenet_frame_differs_only_where_the_bend_turns() -> None:
    pair = [Reading(PRINTED_WAY, "rmse", angles) for angles in ("euler", "frenet")]
    found = read(batch_of(ca.load_vehicle("paper")), pair, FINAL)[0]
    np.testing.assert_allclose(found[0, 1, :2], found[1, 1, :2], rtol=1e-9)  # planar
    assert abs(found[1, 1, 2] / found[0, 1, 2] - 1.0) > 0.05


def test_the_tip_force_reads_as_four_flights_of_test_d_alone() -> None:
    signs = {flight.force_signs for flight in map(_with_tip_force, TIP_FORCES)}
    assert len(signs) == 4
    readings = [Reading(_with_tip_force(force), "rmse", "euler") for force in TIP_FORCES]
    found = read(batch_of(ca.load_vehicle("paper")), readings, SEARCH)[0]
    np.testing.assert_array_equal(found[:, :, :3], np.broadcast_to(found[:1, :, :3], (4, 2, 3)))
    assert len(set(found[:, 0, 3])) == 4


def _with_tip_force(force: str) -> Flight:
    return dataclasses.replace(PRINTED_WAY, tip_force=force)


def test_the_objective_is_the_rms_log_ratio_to_the_printed_numbers() -> None:
    assert objective(TABLE) == 0.0
    assert objective(2.0 * TABLE) == pytest.approx(np.log(2.0))
    off = TABLE.copy()
    off[1, 2] *= 3.0
    assert objective(off) == pytest.approx(np.log(3.0) / np.sqrt(8.0))
    assert objective(np.full((2, 4), np.nan)) == np.inf


def test_no_number_depends_on_the_batch_it_was_flown_in() -> None:
    shares = some_shares(6)
    together = evaluate(shares, READINGS[:40], SEARCH)
    alone = evaluate(shares[4:5], READINGS[:40], SEARCH)
    np.testing.assert_allclose(together[4], alone[0], rtol=1e-9)


def test_a_parameter_at_a_bound_is_reported() -> None:
    share = np.full(len(PARAMETERS), 0.5)
    share[0], share[4] = 0.0, 0.999
    assert held(share) == {"uav_mass": "lower", "radius": "upper"}
    assert values(share[None])["uav_mass"][0] == PARAMETERS[0].lower


QUICK = Effort(samples=8, evolved=1, population=6, generations=1, refined=1)


@pytest.fixture
def few_readings(monkeypatch: pytest.MonkeyPatch) -> tuple[Reading, ...]:
    """Two kinds of flight instead of twelve."""
    few = tuple(
        reading
        for reading in READINGS
        if reading.flight.decoupled != "diagonal"
        and (reading.flight.arm, reading.flight.bend) == ("down", 1)
        and reading.flight.tip_force == "reversed"
    )
    monkeypatch.setattr(search_module, "READINGS", few)
    return few


def test_the_search_improves_on_its_samples_and_repeats_itself(
    few_readings: tuple[Reading, ...],
) -> None:
    first, again = search(QUICK, seed=3), search(QUICK, seed=3)
    assert first.ranking[0].objective == again.ranking[0].objective
    assert first.ranking[0].reading == again.ranking[0].reading
    np.testing.assert_array_equal(first.ranking[0].share, again.ranking[0].share)
    points = qmc.Sobol(len(PARAMETERS), seed=3).random(8)
    assert first.ranking[0].objective < evaluate(points, few_readings, SEARCH).min()


def test_refinement_finds_the_vehicle_that_made_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    reading = Reading(PRINTED_WAY, "rmse", "geodesic")
    share = some_shares(1, seed=6)[0]
    table = read(vehicles(share[None]), [reading], SEARCH)[0, 0]
    monkeypatch.setattr("continuair.identification.objective.TABLE", table)
    near = np.clip(share + 0.02 * np.random.default_rng(1).normal(size=len(share)), 0.0, 1.0)
    found = search_module.Search(0, Effort(population=24, generations=20))
    found.note(near[None], evaluate(near[None], [reading], SEARCH), [reading])
    before = found.ranking[0].objective
    search_module._refine(found, found.ranking[0], lambda *_: None)
    assert found.ranking[0].objective < 0.1 * before


def test_covariance_adaptation_descends_a_narrow_valley() -> None:
    best = [np.inf]

    def valley(rows: np.ndarray) -> np.ndarray:
        x, y = 4.0 * rows[:, 0] - 2.0, 4.0 * rows[:, 1] - 1.0
        values = (1.0 - x) ** 2 + 100.0 * (y - x**2) ** 2
        best[0] = min(best[0], float(values.min()))
        return np.asarray(values)

    adapt(valley, np.array([0.2, 0.3]), spread=0.1, population=16, generations=100, seed=0)
    assert best[0] < 1e-8


@pytest.mark.usefixtures("few_readings")
def test_an_interrupted_search_reports_the_best_it_has_found() -> None:
    def stop(done: int, total: int, what: str) -> None:
        if what.startswith(("block", "independent", "diagonal")):
            raise KeyboardInterrupt

    found = search(QUICK, seed=0, progress=stop)
    assert found.interrupted
    results = summarise(found)
    text = as_table(results)
    assert "interrupted" in text and CAUTION in text
    assert results["best"]["objective"] < np.inf


@pytest.mark.usefixtures("few_readings")
def test_the_command_writes_table_json_and_the_vehicle_that_gives_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(Effort, "times", lambda factor: QUICK)
    out = tmp_path / "out"
    result = CliRunner().invoke(cli.app, ["identify", "--seed", "1", "--out", str(out)])
    assert result.exit_code == 0, result.output
    results = json.loads((out / "identify.json").read_text("utf-8"))
    assert (out / "table.md").read_text("utf-8") in result.stderr
    reading = results["best"]["reading"]
    flight = Flight(*(reading[key] for key in ("decoupled", "arm", "bend", "tip_force")))
    chosen = Reading(flight, reading["metric"], reading["angles"])
    found = numbers_of(ca.load_vehicle(out / "table1.toml"), chosen)
    np.testing.assert_allclose(found, results["best"]["numbers"], rtol=1e-6)
    assert results["best"]["objective"] == pytest.approx(objective(found))


def test_the_preset_table1_gives_the_numbers_that_its_file_states() -> None:
    path = Path(vehicle_module.__file__).parent / "presets" / "table1.toml"
    text = path.read_text(encoding="utf-8")
    chosen = next(r for r in READINGS if f"Reading: {sentence(r.describe())}.\n" in text)
    found = numbers_of(ca.load_vehicle("table1"), chosen)
    stated = [float(number) for number in re.findall(r"[ABCD] ([0-9.]+) \(printed", text)]
    # The file rounds to 4 digits; Test C divides by the bend and feels the last bit of rounding.
    np.testing.assert_allclose(found, np.reshape(stated, (2, 4)), rtol=2e-2, atol=1e-4)
    total = float(re.findall(r"eight numbers: ([0-9.]+)\.\n", text)[0])
    assert objective(found) == pytest.approx(total, abs=0.01)
