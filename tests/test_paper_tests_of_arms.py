"""The paper's open-loop tests and letters, flown by vehicles of several arms and sections."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
from amiri2026.figures import open_loop as open_loop_figures
from amiri2026.figures import tracking as tracking_figures
from amiri2026.open_loop import report as open_loop_report
from amiri2026.open_loop.study import open_loop
from amiri2026.open_loop_tests import bend_torques, open_loop_flight, tip_chirp
from amiri2026.tracking import report as tracking_report
from amiri2026.tracking.study import Tracking, tracking
from continuair.analysis import joint_speed
from continuair.cli.commands import app
from continuair.controllers.gain_files import Gains, load_gains
from continuair.vehicle.arc import polar_of
from tests.refusals import refused
from tests.test_advise_arms import DUAL, TWO, as_list

PAPER = ca.load_vehicle("paper")
AS_LIST = as_list(PAPER)
THREE = ca.load_vehicle(Path(__file__).with_name("three_sections.toml"))
ARMLESS = ca.Vehicle(name="quad", uav={"mass": 1.0, "inertia": [0.01, 0.01, 0.02]})
OF_TABLE = Gains("without bend_rate", load_gains("paper").settings | {"bend_rate": 0.0})


@pytest.mark.parametrize("vehicle", [TWO, DUAL, THREE], ids=lambda vehicle: vehicle.name)
def test_every_section_has_the_bend_and_the_torques_of_the_papers_one(vehicle: ca.Vehicle) -> None:
    for letter in "ABCD":
        kappa, psi = polar_of(np.asarray(open_loop_flight(vehicle, letter).q))
        assert (kappa == 0.1).all() and (psi == 0.0).all()
        assert kappa.size == vehicle.sections
    tau = open_loop_flight(vehicle, "C").tau
    assert callable(tau)
    for t in (0.0, 0.13):
        row = np.asarray(tau(t))
        each = row[6:].reshape(vehicle.sections, 2)
        assert (each == np.asarray(bend_torques(t))[6:]).all()
        assert not row[:6].any()
    assert np.asarray(open_loop_flight(vehicle, "A").tau).tolist() == [
        100.0,
        *[0.0] * (5 + 2 * vehicle.sections),
    ]


@pytest.mark.parametrize(("vehicle", "arm"), [(DUAL, 1), (THREE, 1), (TWO, 0)])
def test_the_tip_wrench_acts_on_the_arm_that_carries_the_camera(
    vehicle: ca.Vehicle, arm: int
) -> None:
    scenario = open_loop_flight(vehicle, "D", f1=3.0)
    assert callable(scenario.tip_wrench) and scenario.tip_wrench_sign == -1
    each = np.reshape(scenario.tip_wrench(0.4), (len(vehicle.arms), 6))
    assert each[arm].tolist() == list(tip_chirp(0.4, 3.0))
    assert not np.delete(each, arm, axis=0).any()
    described: Any = scenario.describe()["tip_wrench"]
    assert described["input"] == "tip_chirp" and described["f1"] == 3.0
    json.dumps(described)


@pytest.mark.long
def test_one_section_of_a_list_has_the_errors_of_a_table() -> None:
    one, twin = (open_loop(vehicle, "CD", ["decoupled"]) for vehicle in (PAPER, AS_LIST))
    assert "arms" not in twin.results
    for letter in "CD":
        own, others = (each.results["tests"][letter]["decoupled"] for each in (one, twin))
        for name in ("nrmse_t", "nrmse_r", "rmse_t_m", "angle_rad"):
            assert others[name] == pytest.approx(own[name], rel=1e-4)
        assert own["converged"] and others["converged"]
    assert [row["kappa_s"] for row in twin.results["kappa_s"]] == [0.5e-3, 2e-3]


@pytest.mark.long
def test_each_arm_has_its_errors_and_figures(tmp_path: Path) -> None:
    study = open_loop(DUAL, "A", ["decoupled"])
    results = study.results
    both = results["arms"]["A"]
    assert list(both) == ["left", "right"]
    assert results["tests"]["A"] == both["right"], "the arm that carries the camera"
    assert both["left"]["decoupled"]["rmse_t_m"] < both["right"]["decoupled"]["rmse_t_m"]
    flights = study.datasets["A"]["tip_position"]
    for index, name in enumerate(both):
        coupled, other = (flights.sel(model=model).isel(arm=index) for model in flights["model"])
        off = np.sqrt(float(((other - coupled) ** 2).sum("axis").mean("time")))
        assert both[name]["decoupled"]["rmse_t_m"] == pytest.approx(off, rel=1e-12)
    rows = list(open_loop_report.records(results))
    assert [(row["arm"], row["model"]) for row in rows] == [
        (arm, model) for arm in both for model in ("coupled", "decoupled")
    ]
    table = open_loop_report.as_table(results)
    assert "| A | left | decoupled |" in table
    assert "acts on arm right, which carries the camera" in table
    open_loop_figures.write(results, study.datasets, lambda name: tmp_path / name)
    drawn = {path.stem for path in tmp_path.glob("*.png")}
    kinds = ("motion", "bending", "differences")
    assert drawn == {"overview", "table"} | {f"test_A_{k}_{arm}" for k in kinds for arm in both}


@pytest.mark.long
def test_the_command_flies_an_arm_of_two_sections() -> None:
    options = ["--vehicle", "two_section", "--tests", "B", "--model", "decoupled"]
    result = CliRunner().invoke(app, ["open-loop", *options])
    assert result.exit_code == 0
    assert "Every section starts with the bend" in result.stderr


@pytest.fixture(scope="module")
def dual() -> Tracking:
    return tracking(DUAL, "L", models=["decoupled"], settings=["fast"])


@pytest.mark.long
def test_one_section_of_a_list_tracks_as_that_of_a_table() -> None:
    table = PAPER.replace({"arm.damping_ratio": 0.03})
    studies = [
        tracking(vehicle, "L", OF_TABLE, ["decoupled"], ["fast"])
        for vehicle in (table, as_list(table))
    ]
    own, others = (study.results["letters"]["L"]["decoupled"] for study in studies)
    for name in ("rms_px", "tip_rms_m", "largest_bend_1_m", "bend_moment_rms_nm2"):
        assert others[name] == pytest.approx(own[name], rel=1e-3)
    assert "ultimate_bound" in studies[0].results and "ultimate_bound" not in studies[1].results
    flights = [study.datasets["fast"].sel(model="coupled", letter="L") for study in studies]
    speeds = [joint_speed(flight) for flight in flights]
    np.testing.assert_allclose(speeds[1], speeds[0], rtol=1e-2, atol=1e-2)


@pytest.mark.long
def test_two_arms_track_by_the_one_that_carries_the_camera(dual: Tracking, tmp_path: Path) -> None:
    for model in ("coupled", "decoupled"):
        entry = dual.results["letters"]["L"][model]
        assert entry["status"] == 0 and entry["rms_px"] < 10.0
    start = dual.datasets["fast"].isel(time=0).sel(model="coupled", letter="L")
    bends = np.linalg.norm(start["bend"].transpose("section", "bend_axis"), axis=1)
    np.testing.assert_allclose(bends, [0.0, 0.1], rtol=0, atol=1e-15)
    at = start["tip_position"].transpose("arm", "axis").to_numpy()
    np.testing.assert_allclose(start["camera_position"].to_numpy(), at[1], rtol=0, atol=1e-12)
    table = tracking_report.as_table(dual.results)
    assert "The camera is at the tip of arm right" in table and "start straight" in table
    assert "## Stability" not in table
    tracking_figures.write(dual.results, dual.datasets, DUAL.camera, lambda name: tmp_path / name)
    assert (tmp_path / "speed_fast.png").exists()


@pytest.mark.parametrize("study", [open_loop, tracking])
def test_a_vehicle_without_an_arm_is_refused_in_a_sentence(study: Any) -> None:
    with refused("vehicle"):
        study(ARMLESS)
