"""The search for vehicles and readings that give the paper's Table I."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
from amiri2026.table.metrics import table_errors
from amiri2026.table.reading import Reading
from amiri2026.table.study import READING, factor, fly_tests
from research.paper_table import study
from research.paper_table.__main__ import app
from research.paper_table.evolution import adapt
from research.paper_table.flights import Accuracy, largest, log_ratios, objective
from research.paper_table.readings import METRICS, READINGS, numbers
from research.paper_table.search import LITERAL, Effort, Search, ranked, search
from research.paper_table.space import MATERIALS, PARAMETERS, Design, drawn
from research.paper_table.study import CAUTION, as_table
from tests.refusals import assert_refused, refused

pytestmark = pytest.mark.targets

ROOT = Path(__file__).parents[2]
QUICK = Effort(draws=8, starts=1, population=6, generations=3)
COARSE = Accuracy(1e-4, 1e-2, 20_000, 4)


@pytest.fixture(scope="module")
def found() -> Search:
    return search(QUICK, seed=1)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder and the standard error of a quick search by the command."""
    out = tmp_path_factory.mktemp("paper_table") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Effort, "times", lambda factor: QUICK)
        patch.setattr(study, "_CONFIRMED", 1)
        result = CliRunner().invoke(app, ["--seed", "1", "--out", str(out)])
    assert result.exit_code == 0, result.output
    return out, result.stderr


@pytest.fixture(scope="module")
def results(written: tuple[Path, str]) -> Any:
    return json.loads((written[0] / "paper_table.json").read_text("utf-8"))


@pytest.mark.parametrize("decoupled", ["element", "block"])
def test_numbers_are_those_of_the_study_under_every_metric(decoupled: str) -> None:
    reading = READING.replace(decoupled=decoupled)
    flown = fly_tests(ca.load_vehicle("table1"), reading, tolerance=1e-5, sample=1e-2, tests="D")
    pair = flown.pairs["D"]
    expected = [table_errors(*pair, reading.replace(**metric)) for metric in METRICS]
    np.testing.assert_array_equal(numbers(*pair), expected)


def test_every_reading_is_counted_once() -> None:
    assert len({READING.replace(**metric) for metric in METRICS}) == len(METRICS)
    assert len(METRICS) == READINGS / 128
    assert READING.replace(**METRICS[LITERAL]) == READING


@pytest.mark.long
def test_readings_that_share_flights_get_the_numbers_of_their_own_flights() -> None:
    vehicle = ca.load_vehicle("table1")
    readings = [
        READING,
        READING.replace(force_sign=1),
        READING.replace(decoupled="block"),
        READING.replace(decoupled="block", rotary_inertia=True),
    ]
    together = log_ratios([(vehicle, reading) for reading in readings], COARSE)
    for reading, logs in zip(readings, together, strict=True):
        np.testing.assert_array_equal(logs, log_ratios([(vehicle, reading)], COARSE)[0])
    tests_abc, test_d = together[..., :3], together[..., 3]
    np.testing.assert_array_equal(tests_abc[0], tests_abc[1])
    assert not np.array_equal(test_d[0], test_d[1])


@pytest.mark.long
def test_log_ratios_give_the_factor_of_the_study() -> None:
    vehicle = ca.load_vehicle("table1")
    logs = log_ratios([(vehicle, READING)], Accuracy(1e-7, 1e-3, 10**6, 8))[0]
    expected = factor(fly_tests(vehicle, READING, tolerance=1e-7).table(READING))
    assert np.exp(largest(logs[LITERAL])) == pytest.approx(expected, rel=1e-12)


def test_a_pair_beyond_the_limit_is_not_flown_further() -> None:
    vehicle = ca.load_vehicle("table1")
    whole = log_ratios([(vehicle, READING)], COARSE)[0]
    limit = float(whole[LITERAL, :, 1].max())
    flown = log_ratios([(vehicle, READING)], COARSE, 0.9 * limit, [LITERAL])[0]
    np.testing.assert_array_equal(flown[..., 1], whole[..., 1])
    assert np.isnan(flown[..., [0, 2, 3]]).all()
    assert np.isinf(objective(flown)).all()


def test_the_objective_lies_between_the_largest_log_ratio_and_its_8th_root_of_8() -> None:
    logs = np.random.default_rng(0).random((50, 2, 4))
    values, least = objective(logs), largest(logs)
    assert (values >= least - 1e-9).all() and (values <= 8.0**0.125 * least + 1e-9).all()
    assert objective(np.full((2, 4), 0.3)) == pytest.approx(8.0**0.125 * 0.3, abs=1e-9)
    logs[3, 1, 2] = np.inf
    assert np.isinf(objective(logs)[3])


def test_drawn_vehicles_are_within_their_bounds() -> None:
    rng = np.random.default_rng(2)
    designs = [drawn(rng) for _ in range(200)]
    assert {design.material for design in designs} == set(MATERIALS)
    for design in designs:
        values, material = design.describe(), MATERIALS[design.material]
        assert material.softest <= values["youngs_modulus"] <= material.stiffest
        assert design.vehicle.arm.density == material.density
        for parameter in PARAMETERS:
            if parameter.name != "modulus":
                assert parameter.lower <= values[parameter.name] <= parameter.upper


def test_a_parameter_at_a_bound_is_reported() -> None:
    shares = np.full(len(PARAMETERS), 0.5)
    shares[[0, 4]] = 0.0, 0.999
    design = Design(shares, "steel")
    assert design.held() == {"uav_mass": "lower", "radius": "upper"}
    assert design.vehicle.uav.mass == PARAMETERS[0].lower


@pytest.mark.long
def test_refinement_improves_on_the_random_vehicles(found: Search) -> None:
    anyhow, literal = np.min(found.drawn, axis=0)
    assert len(found.drawn) == QUICK.draws
    # One start under any reading, and one under that of Table I.
    assert found.vehicles == QUICK.draws + 2 * QUICK.population * QUICK.generations
    assert min(each.factor for each in found.pairs) < 0.9 * anyhow
    assert min(each.factor for each in found.literal) < 0.9 * literal
    assert np.isfinite(literal)


@pytest.mark.long
def test_a_seed_gives_the_same_search_again(found: Search, results: Any) -> None:
    for key, candidates in (("best", found.pairs), ("table1_reading", found.literal)):
        best = ranked(candidates)[0]
        assert results[key]["parameters"] == best.design.describe()
        assert results[key]["reading"] == best.reading.describe()
    assert results["vehicles"] == found.vehicles


@pytest.mark.long
def test_an_interrupted_search_reports_the_best_it_has_found() -> None:
    def stop(done: int, total: int, what: str) -> None:
        if what.startswith("refining"):
            raise KeyboardInterrupt

    found = search(QUICK, seed=1, progress=stop)
    assert found.interrupted and found.vehicles == QUICK.draws
    assert min(each.factor for each in found.pairs) == np.min(found.drawn)


def test_a_search_that_is_interrupted_before_it_found_anything_ends() -> None:
    def stop(done: int, total: int, what: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search(QUICK, seed=1, progress=stop)


@pytest.mark.long
def test_the_reported_factor_is_that_of_an_accurate_flight(results: Any) -> None:
    for key in ("best", "table1_reading"):
        entry = results[key]
        ratios = np.array(entry["ratios"])
        assert entry["factor"] == pytest.approx(np.exp(np.abs(np.log(ratios)).max()))
    assert Reading(**results["table1_reading"]["reading"]) == READING


@pytest.mark.long
def test_the_vehicles_written_give_the_numbers_reported(
    written: tuple[Path, str], results: Any
) -> None:
    for name, key in (("vehicle", "best"), ("vehicle_table1_reading", "table1_reading")):
        reading = Reading(**results[key]["reading"])
        flown = fly_tests(ca.load_vehicle(written[0] / f"{name}.toml"), reading)
        np.testing.assert_array_equal(flown.table(reading), results[key]["ours"])


@pytest.mark.long
def test_the_command_prints_its_table_and_writes_small_files(
    written: tuple[Path, str], results: Any
) -> None:
    out, printed = written
    assert sum(path.stat().st_size for path in out.iterdir()) < 100_000
    table = (out / "table.md").read_text("utf-8")
    assert table in printed and CAUTION in table
    assert "interrupted" not in table
    assert "interrupted" in as_table(results | {"interrupted": True})


def test_the_command_refuses_what_it_cannot_write_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    for field, given in (("out", str(tmp_path)), ("json", "")):
        assert_refused(CliRunner().invoke(app, [f"--{field}", given]), field)


@pytest.mark.parametrize("option", [["--effort", "0"], ["--seed", "-1"], ["--seed", "one"]])
def test_the_command_refuses_bad_numbers(option: list[str]) -> None:
    assert CliRunner().invoke(app, option).exit_code == 2


@pytest.mark.parametrize(
    "effort", [{"draws": 0}, {"starts": -1}, {"population": 3}, {"generations": 1.5}]
)
def test_an_effort_that_is_none_is_refused(effort: dict[str, int]) -> None:
    with refused(next(iter(effort))):
        Effort(**effort)


def test_a_seed_that_is_no_whole_number_is_refused() -> None:
    with refused("seed"):
        search(QUICK, seed=-1)


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
