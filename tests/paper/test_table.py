"""Table I of the paper beside ours."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.overview import overview
from amiri2026.table import report
from amiri2026.table.reading import Reading
from amiri2026.table.study import (
    PRINTED,
    READING,
    factor,
    fly_tests,
    table1,
)
from continuair.cli.commands import app
from continuair.vehicle.vehicle import load_vehicle
from tests.refusals import refused

pytestmark = pytest.mark.targets


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return table1()


@pytest.mark.long
def test_all_eight_numbers_agree_within_fifteen_percent(found: dict[str, Any]) -> None:
    ours = np.array(found["ours"])
    assert ours.shape == PRINTED.shape == (2, 4)
    assert found["factor"] == pytest.approx(factor(ours))
    assert found["factor"] <= 1.15
    assert max(found["factor_by_sample"].values()) <= 1.15


@pytest.mark.long
def test_the_numbers_do_not_depend_on_the_tolerance(found: dict[str, Any]) -> None:
    """Between 1e-6 and 1e-9; in Test D the arm crosses the jump of Remark 1."""
    every = np.array([found["ours_by_tolerance"][name] for name in ("1e-06", "1e-09")])
    moved = np.abs(np.diff(every, axis=0))[0]
    assert moved[:, :2].max() <= 1e-3
    assert moved[:, 2:].max() <= 1e-2


@pytest.mark.long
def test_the_test_called_negligible_errs_most_in_metres(found: dict[str, Any]) -> None:
    metres = {test: row["rmse_t_m"] for test, row in found["in_metres_and_radians"].items()}
    assert max(metres, key=lambda test: metres[test]) == "A"
    assert metres["A"] > load_vehicle("table1").arm.length
    assert metres["C"] < 0.025


@pytest.mark.long
def test_each_other_meaning_of_decoupled_misses_the_table(found: dict[str, Any]) -> None:
    factors = {entry["change"]: entry["factor"] for entry in found["ablations"]}
    assert min(value for name, value in factors.items() if "decoupled" in name) > 2.0


@pytest.mark.long
def test_a_flight_that_stops_early_has_a_reason_and_no_number(found: dict[str, Any]) -> None:
    (without,) = (entry for entry in found["ablations"] if entry["change"] == "without Remark 1")
    numbers = np.array(without["ours"])
    assert np.isfinite(numbers[:, :2]).all()
    assert np.isnan(numbers[:, 2:]).all() and np.isnan(without["factor"])
    assert set(without["ended"]) == {"Test C, element", "Test D, element"}
    lines = "\n".join(report.ablations(found))
    assert "nan" not in lines and "singular" in lines


def test_a_vehicle_without_a_mirror_plane_flies_all_coordinates() -> None:
    """Its Test A leaves the plane, where that of `table1` stays in it to the last bit."""
    vehicle = load_vehicle("table1")
    tilted = vehicle.replace({"uav.mount": [0.0, 0.02, 0.0]})
    reading = Reading(decoupled="block")
    pairs = {
        name: fly_tests(each, reading, tests="A", sample=0.01).pairs["A"]
        for name, each in (("plane", vehicle), ("tilted", tilted))
    }
    assert np.abs(pairs["plane"][0].position[:, 1]).max() == 0.0
    assert np.abs(pairs["tilted"][0].position[:, 1]).max() > 1e-3


@pytest.mark.long
def test_flights_are_kept_by_what_they_depend_on() -> None:
    evidence = Evidence(load_vehicle("paper"))
    vehicle = load_vehicle("table1")
    first = evidence.printed(vehicle, READING)
    assert evidence.printed(vehicle, READING.replace(metric="rmse", axes="xyz")) is first
    assert evidence.printed(vehicle, READING.replace(decoupled="block")) is not first


@pytest.mark.parametrize(
    ("changes", "options", "field"),
    [
        ({}, {"sample": 0.003}, "sample"),
        ({}, {"sample": 0.0}, "sample"),
        ({}, {"tolerance": 0.0}, "tolerance"),
        ({}, {"tolerance": 0.1}, "tolerance"),
        ({}, {"tests": "E"}, "test"),
        ({"arm.kappa_s": 100.0}, {}, "arm.kappa_s"),
        ({"arm.drag_coefficient": 1.2}, {}, "vehicle"),
    ],
)
def test_what_cannot_be_flown_is_refused(
    changes: dict[str, Any], options: dict[str, Any], field: str
) -> None:
    vehicle = load_vehicle("table1").replace(changes)
    with refused(field):
        fly_tests(vehicle, **options)
    with refused("force_sign"):
        Reading(force_sign=7)  # type: ignore[arg-type]


@pytest.mark.long
def test_a_massless_disk_changes_nothing() -> None:
    vehicle = load_vehicle("table1")
    with_disk = vehicle.replace({"arm.disks": [{"position": 0.1, "mass": 0.0}]})
    tables = [fly_tests(each).table(READING) for each in (vehicle, with_disk)]
    np.testing.assert_array_equal(tables[0], tables[1])


@pytest.mark.long
def test_the_command_writes_the_table(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["paper", "--only", "table", "--quick", "--out", str(out)])
    assert done.exit_code == 0, done.output
    results = json.loads((out / "paper.json").read_text(encoding="utf-8"))
    assert [entry["id"] for entry in results["sentences"]] == ["IV-A.T1"]
    table = results["table1"]
    assert {"vehicle", "reading", "ours", "printed", "factor"} <= set(table)
    assert set(table["reading"]) == {
        "decoupled", "remark1", "metric", "axes", "angles", "range", "force_sign", "kappa",
        "damping", "rotary_inertia",
    }  # fmt: skip
    assert table["factor"] <= 1.15
    assert table["vehicle"]["name"] == "table1"
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Table I, and ours" in page and f"{table['factor']:.3f}" in page
    assert (out / "table" / "table.png").is_file()
    assert any("advise" in line for line in overview(results))
