"""The open-loop study: what it calls converged, what it stores, and the paper's tests flown."""

import functools
import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import amiri2026.open_loop.study as study
from amiri2026.figures import overview
from amiri2026.open_loop import report as open_loop_output
from amiri2026.open_loop.study import open_loop
from continuair.studies.results import ResultFolder, as_json
from continuair.vehicle.vehicle import load_vehicle
from tests.refusals import numbers_of, refused
from tests.synthetic import OFFSETS, flight

PAPER = load_vehicle("paper")


@pytest.fixture
def synthetic(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "simulate", flight)


ROTORS = {"layout": "quad_x", "lever": 0.3, "thrust_limits": [0, 20], "torque_per_thrust": 0.02}


def with_rotors() -> Any:
    said: dict[str, Any] = PAPER.describe()
    return type(PAPER)(**said | {"uav": said["uav"] | {"rotors": ROTORS}})


@pytest.mark.long
@pytest.mark.parametrize("test", "BD")
def test_no_lift_acts_in_tests_of_a_vehicle_with_rotors(test: str) -> None:
    studies = [open_loop(each, test, ["decoupled"]) for each in (PAPER, with_rotors())]
    told = [
        "Rotors stand still here" in open_loop_output.as_table(each.results) for each in studies
    ]
    assert told == [False, True]
    flights = [each.datasets[test] for each in studies]
    np.testing.assert_allclose(
        flights[1]["tip_position"], flights[0]["tip_position"], rtol=0, atol=1e-11
    )
    fallen = flights[1]["position"].isel(time=-1, axis=2) - 5.0
    if test == "B":
        np.testing.assert_allclose(fallen, -0.5 * 9.81, rtol=5e-3)


def test_coupled_is_always_flown_and_differs_in_nothing_from_itself(synthetic: None) -> None:
    entries = open_loop(PAPER, "B", ["independent"]).results["tests"]["B"]
    assert list(entries) == ["coupled", "independent"]
    assert entries["coupled"]["rmse_t_m"] == entries["coupled"]["angle_rad"] == 0
    # The mean of (0.4 t²)² over 1 s is 0.16/5; 1001 samples add 3e-3 of it.
    expected = OFFSETS["independent"] / math.sqrt(5)
    assert entries["independent"]["rmse_t_m"] == pytest.approx(expected, rel=3e-3)


def test_a_flight_that_ended_early_is_told_once_and_not_warned_of(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def ended(*arguments: Any, **options: Any) -> xr.Dataset:
        return flight(*arguments, **options).assign(status=2, end_time=0.5)

    monkeypatch.setattr(study, "simulate", ended)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        results = open_loop(PAPER, "BC", ["decoupled"]).results
    told = [line for line in open_loop_output.remarks(results) if "ended at 0.5 s" in line]
    assert [line.count("coupled and decoupled") for line in told] == [1] * 2, "two tests"


def test_where_the_reference_ends_early_the_other_models_are_told_of_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def ended(*arguments: Any, **options: Any) -> xr.Dataset:
        dataset = flight(*arguments, **options)
        if options["model"] != "coupled":
            return dataset
        flown = dataset["time"] < 0.5
        changed: xr.Dataset = dataset.assign(
            status=((), np.int8(2)),
            end_time=((), 0.5),
            tip_position=dataset["tip_position"].where(flown),
            tip_attitude=dataset["tip_attitude"].where(flown),
        )
        return changed

    monkeypatch.setattr(study, "simulate", ended)
    lines = open_loop_output.remarks(open_loop(PAPER, "A").results)
    coupled, others = (line for line in lines if "has not converged" in line)
    assert "Test A, coupled," in coupled and numbers_of(coupled) == [0.5, 2.0]
    assert "Test A, decoupled and independent," in others
    assert "inf" not in " ".join(lines)


def test_relative_error_is_that_of_both_flights_over_the_rms_of_their_difference(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    error = 1e-4
    monkeypatch.setattr(study, "simulate", functools.partial(flight, error=error))
    entry = open_loop(PAPER, "B", ["decoupled"]).results["tests"]["B"]["decoupled"]
    expected = 2.0 * error / min(entry["rmse_t_m"] / PAPER.arm.length, entry["angle_rad"])
    assert entry["relative_error"] == pytest.approx(expected, rel=1e-12, abs=0)
    assert entry["converged"]


@pytest.mark.parametrize("changes", [{"uav.mass": 3.0}, {"name": "mine"}], ids=str)
def test_the_papers_numbers_stand_beside_the_preset_alone(
    changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever another vehicle is called."""
    monkeypatch.setattr(study, "simulate", flight)
    for vehicle, beside in ((PAPER, True), (PAPER.replace(changes), False)):
        results = open_loop(vehicle, "B", ["decoupled"]).results
        assert ("paper NRMSE_T" in open_loop_output.as_table(results)) == beside
        drawn = overview.table(results)
        texts = [text.get_text() for axes in drawn.axes for text in axes.texts]
        assert ("0.2378" in texts) == beside


def test_what_has_not_converged_is_said_not_to_have_and_why(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(study, "simulate", functools.partial(flight, error=1.0))
    results = open_loop(PAPER, "C", ["decoupled"]).results
    entry = results["tests"]["C"]["decoupled"]
    assert not entry["converged"]
    assert "Q_psi_a" in entry["reason"]
    assert "has not converged" in open_loop_output.as_table(results)


def test_a_run_that_ended_early_is_not_converged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def ended(*arguments: Any, **policy: Any) -> xr.Dataset:
        dataset = flight(*arguments, **policy)
        late = dataset["time"] > 0.5
        changed: xr.Dataset = dataset.assign(
            status=((), np.int8(2)),
            end_time=((), 0.5),
            tip_position=dataset["tip_position"].where(~late),
            tip_attitude=dataset["tip_attitude"].where(~late),
        )
        return changed

    monkeypatch.setattr(study, "simulate", ended)
    results = open_loop(PAPER, "B").results
    entry = results["tests"]["B"]["decoupled"]
    assert numbers_of(entry["reason"]) == [0.5, 2.0]
    assert not entry["converged"]
    # JSON has no NaN: numbers that do not exist are null.
    stored = json.loads(as_json(results))
    assert stored["tests"]["B"]["decoupled"]["rmse_t_m"] is None


def test_only_test_c_is_repeated_with_half_and_twice_kappa_s(synthetic: None) -> None:
    assert open_loop(PAPER, "ABD").results["kappa_s"] == []
    rows = open_loop(PAPER, "C").results["kappa_s"]
    assert [row["kappa_s"] for row in rows] == [0.5e-3, 2e-3]


def test_progress_counts_every_flight(synthetic: None) -> None:
    calls: list[tuple[int, int, str]] = []
    open_loop(PAPER, "AC", progress=lambda *call: calls.append(call))
    assert [done for done, _, _ in calls] == list(range(len(calls)))
    assert all(done < total for done, total, _ in calls)
    assert calls[-1][1] == len(calls) == 3 * (1 + 1 + 2)


def test_a_batched_vehicle_is_refused(synthetic: None) -> None:
    with refused("vehicle"):
        open_loop(PAPER.replace({"arm.radius": [0.004, 0.005]}))


def test_stored_trajectories_and_tables_hold_what_was_computed(
    synthetic: None, tmp_path: Path
) -> None:
    result = open_loop(PAPER, "AB")
    folder = ResultFolder(tmp_path / "out", "open_loop")
    open_loop_output.write(result, folder)
    folder.finish()
    with xr.open_dataset(tmp_path / "out/open_loop_B.nc", engine="h5netcdf") as stored:
        xr.testing.assert_equal(stored.load(), result.datasets["B"])
        assert list(stored["model"].values) == ["coupled", "decoupled", "independent"]
    lines = (tmp_path / "out/open_loop.csv").read_text().splitlines()
    assert len(lines) == 1 + 2 * 3
    table = (tmp_path / "out/table.md").read_text("utf-8")
    assert "| B | decoupled | 0.2378 | 0.2751 |" in table


def test_a_folder_of_another_study_is_refused(tmp_path: Path) -> None:
    ResultFolder(tmp_path, "other")
    with refused("out"):
        ResultFolder(tmp_path, "open_loop")


def test_a_file_that_a_study_has_not_written_is_never_replaced(tmp_path: Path) -> None:
    folder = ResultFolder(tmp_path, "open_loop")
    (tmp_path / "table.md").write_text("mine")
    with refused("out"):
        folder.write_text("table.md", "ours")
    assert (tmp_path / "table.md").read_text() == "mine"


def test_a_marker_cannot_make_a_study_remove_files_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("mine")
    out = tmp_path / "out"
    ResultFolder(out, "open_loop")
    (out / ".continuair").write_text('{"study": "open_loop", "files": ["../precious"]}')
    ResultFolder(out, "open_loop").finish()
    assert (tmp_path / "precious").exists()


def test_flown_tests_have_converged_and_the_models_agree_on_the_fall() -> None:
    result = open_loop(PAPER, "BCD")
    for letter in "BCD":
        for entry in result.results["tests"][letter].values():
            assert entry["converged"], entry
    # Coupling moves the tip about the centre of mass, not the centre of mass: within the arm's
    # swing of 0.1 m, z of all models is the same fall.
    tip = result.datasets["B"]["tip_position"].sel(axis="z").transpose("model", "time").to_numpy()
    np.testing.assert_allclose(tip[1:], tip[:1].repeat(2, axis=0), rtol=0, atol=0.01)
    # In free fall from rest nothing turns the decoupled UAV, so its arm swings as on a fixed base.
    entries = result.results["tests"]["B"]
    for key in ("rmse_t_m", "angle_rad"):
        assert entries["decoupled"][key] == pytest.approx(entries["independent"][key], rel=1e-12)
