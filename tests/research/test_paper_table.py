"""The readings of the paper's table, and the search for the vehicle behind it."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc
from typer.testing import CliRunner

import continuair as ca
from continuair.scenario.paper_tests import bend_torques
from continuair.studies.open_loop.study import open_loop
from continuair.vehicle import vehicle as vehicle_module
from research.paper_table import objective as objective_module
from research.paper_table import search as search_module
from research.paper_table.__main__ import app
from research.paper_table.evolution import adapt
from research.paper_table.flights import FINAL, SEARCH
from research.paper_table.objective import TABLE, evaluate, objective, read
from research.paper_table.readings import ANGLES, READINGS, TIP_FORCES, Flight, Reading
from research.paper_table.search import Effort, search
from research.paper_table.space import PARAMETERS, held, values, vehicles
from research.paper_table.study import CAUTION, as_table, numbers_of, sentence

pytestmark = pytest.mark.targets

ROOT = Path(__file__).parents[2]
PRINTED_WAY = Flight("block", "down", 1, "reversed")


def batch_of(vehicle: ca.Vehicle, runs: int = 1) -> ca.Vehicle:
    return vehicle.replace({"uav.mass": np.full(runs, vehicle.uav.mass)})


def some_shares(runs: int, seed: int = 0) -> np.ndarray:
    """Vehicles away from the corners of the bounds."""
    return 0.3 + 0.4 * np.random.default_rng(seed).random((runs, len(PARAMETERS)))


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


def test_no_number_hangs_on_the_last_bits_of_a_flight() -> None:
    # One whose Frenet frame rolls by half a turn in Test C, to which rounding alone gives a sign.
    vehicle = vehicles(np.random.default_rng(0).random((2, len(PARAMETERS)))[1:])
    nearly = vehicle.replace({"arm.youngs_modulus": vehicle.arm.youngs_modulus * (1.0 + 1e-15)})
    chosen = [Reading(PRINTED_WAY, "rmse", angles) for angles in ANGLES]
    found, again = (read(v, chosen, SEARCH) for v in (vehicle, nearly))
    # A second of flight grows 1e-15 some thousandfold.
    np.testing.assert_allclose(again, found, rtol=1e-10)


def test_a_parameter_at_a_bound_is_reported() -> None:
    share = np.full(len(PARAMETERS), 0.5)
    share[0], share[4] = 0.0, 0.999
    assert held(share) == {"uav_mass": "lower", "radius": "upper"}
    assert values(share[None])["uav_mass"][0] == PARAMETERS[0].lower


QUICK = Effort(samples=4, evolved=1, population=6, generations=1, refined=1)


@pytest.fixture
def few_readings(monkeypatch: pytest.MonkeyPatch) -> tuple[Reading, ...]:
    """One kind of flight instead of eight, and fewer to be flown accurately."""
    few = tuple(reading for reading in READINGS if reading.flight == PRINTED_WAY)
    monkeypatch.setattr(search_module, "READINGS", few)
    monkeypatch.setattr(search_module, "_CONFIRMED", 2)
    return few


@pytest.mark.long
def test_the_search_improves_on_its_samples_and_repeats_itself(
    few_readings: tuple[Reading, ...],
) -> None:
    first, again = search(QUICK, seed=3), search(QUICK, seed=3)
    assert first.ranking[0].objective == again.ranking[0].objective
    assert first.ranking[0].reading == again.ranking[0].reading
    np.testing.assert_array_equal(first.ranking[0].share, again.ranking[0].share)
    points = qmc.Sobol(len(PARAMETERS), seed=3).random(4)
    assert first.ranking[0].objective < evaluate(points, few_readings, SEARCH).min()


@pytest.mark.long
def test_refinement_comes_near_the_vehicle_that_made_a_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reading = Reading(PRINTED_WAY, "rmse", "geodesic")
    share = some_shares(1, seed=6)[0]
    table = read(vehicles(share[None]), [reading], SEARCH)[0, 0]
    monkeypatch.setattr(objective_module, "TABLE", table)
    near = np.clip(share + 0.02 * np.random.default_rng(1).normal(size=len(share)), 0.0, 1.0)
    found = search_module.Search(0, Effort(population=24, generations=6))
    found.note(near[None], evaluate(near[None], [reading], SEARCH), [reading])
    before = found.ranking[0].objective
    search_module._refine(found, found.ranking[0], lambda *_: None)
    # 144 flights; with seeds 0 to 7 they end at 0.15 to 0.32 of where they began.
    assert found.ranking[0].objective < 0.6 * before


DESCENT = """
import numpy as np
from research.paper_table.evolution import adapt

best = np.full(1, np.inf)

def valley(rows):
    scaled = (rows - 0.4) * 10.0 ** np.linspace(0.0, 3.0, rows.shape[1])
    values = np.sum((scaled + 0.5 * np.roll(scaled, 1, axis=1)) ** 2, axis=1)
    best[0] = min(best[0], values.min())
    return values

adapt(valley, np.full(11, 0.5), spread=0.1, population=16, generations=150, seed=0)
print(best[0])
"""


def descent(processor: str) -> float:
    """Where the adaptation ends when BLAS works as on a processor."""
    settings = os.environ | {"OPENBLAS_CORETYPE": processor, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", DESCENT], env=settings, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def test_covariance_adaptation_is_the_same_whatever_the_processor_of_blas() -> None:
    # All of x86-64; elsewhere the names are not known, and nothing changes.
    ends = [descent(processor) for processor in ("Prescott", "Nehalem", "Haswell")]
    np.testing.assert_allclose(ends, ends[0], rtol=1e-6)


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
        if what.startswith(("block", "independent")):
            raise KeyboardInterrupt

    found = search(QUICK, seed=0, progress=stop)
    assert found.interrupted
    assert found.ranking[0].objective < np.inf


@pytest.mark.usefixtures("few_readings")
def test_the_command_writes_table_json_and_the_vehicle_that_gives_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(Effort, "times", lambda factor: QUICK)
    out = tmp_path / "out"
    result = CliRunner().invoke(app, ["--seed", "1", "--out", str(out)])
    assert result.exit_code == 0, result.output
    results = json.loads((out / "paper_table.json").read_text("utf-8"))
    table = (out / "table.md").read_text("utf-8")
    assert table in result.stderr
    assert CAUTION in table and "interrupted" not in table
    assert "interrupted" in as_table(results | {"interrupted": True})
    reading = results["best"]["reading"]
    flight = Flight(*(reading[key] for key in ("decoupled", "arm", "bend", "tip_force")))
    chosen = Reading(flight, reading["metric"], reading["angles"])
    found = numbers_of(ca.load_vehicle(out / "table1.toml"), chosen)
    np.testing.assert_allclose(found, results["best"]["numbers"], rtol=1e-6)
    assert results["best"]["objective"] == pytest.approx(objective(found))


def test_the_command_refuses_what_it_cannot_write_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    for arguments, part in ((["--out", str(tmp_path)], "out is "), (["--json", ""], "json is ")):
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 2
        assert result.stderr.startswith(part)
        assert len(result.stderr.strip().splitlines()) == 1


def test_the_preset_table1_gives_the_numbers_that_its_file_states() -> None:
    path = Path(vehicle_module.__file__).parents[1] / "presets" / "table1.toml"
    text = path.read_text(encoding="utf-8")
    chosen = next(r for r in READINGS if f"Reading: {sentence(r.describe())}.\n" in text)
    found = numbers_of(ca.load_vehicle("table1"), chosen)
    stated = [float(number) for number in re.findall(r"[ABCD] ([0-9.]+) \(printed", text)]
    # The file rounds to 4 decimals, and the objective to 3.
    np.testing.assert_allclose(found, np.reshape(stated, (2, 4)), rtol=0.0, atol=5.01e-5)
    total = float(re.findall(r"eight numbers: ([0-9.]+)\.\n", text)[0])
    assert objective(found) == pytest.approx(total, abs=5.01e-4)
