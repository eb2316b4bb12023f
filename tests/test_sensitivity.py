"""The sensitivity study: what it measures, how it judges, and the paper's sweeps flown."""

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import amiri2026.sensitivity.findings as findings
import amiri2026.sensitivity.once as once
import amiri2026.sensitivity.study as study
import amiri2026.sensitivity.swing as swing
from amiri2026.figures import sensitivity as figures
from amiri2026.sensitivity import report as sensitivity_output
from amiri2026.sensitivity.claims import CLAIMS, verdicts, view
from amiri2026.sensitivity.measures import VARIABLES
from amiri2026.sensitivity.task import (
    PARAMETERS,
    TwoPhaseForce,
    about,
    batch,
    flight,
    of_the_paper,
)
from amiri2026.verdicts import (
    FAILS,
    HOLDS,
    UNDECIDED,
    Judgement,
    all_of,
)
from continuair.analysis.backbone import backbone_point
from continuair.analysis.convergence import RTOL
from continuair.analysis.mass import centre_of_mass, mass_distribution, straight_arm_inertia
from continuair.cli.commands import app
from continuair.figures.style import short
from continuair.flight.simulate import simulate
from continuair.scenario.scenarios import Scenario
from continuair.studies.results import ResultFolder, as_json
from continuair.sweeps import run_pairs
from continuair.vehicle.vehicle import Vehicle, load_vehicle
from tests.new_user import NEW_USER
from tests.refusals import assert_refused, refused

paper_command: Any = import_module("amiri2026.commands.paper")
PAPER = load_vehicle("paper")
DISK = {"position": 0.8, "mass": 0.3, "inertia": (1e-4, 2e-4)}


@pytest.fixture(scope="module")
def flown() -> study.Sensitivity:
    """Two sweeps, so that verdicts on the other parameters have nothing to rest on."""
    return study.sensitivity(PAPER, ["UAV mass", "initial roll"])


def test_the_force_is_the_papers_and_turns_by_a_quarter_at_the_switch() -> None:
    for t in (0.0, 0.3, 2.5):
        expected = (100 * math.sin(10 * t), -100 * math.cos(10 * t), 0.0)
        assert TwoPhaseForce()(t) == pytest.approx(expected, rel=1e-14)
    for t in (2.5 + 1e-12, 4.0):
        expected = (100 * math.cos(10 * t), 100 * math.sin(10 * t), 0.0)
        assert TwoPhaseForce()(t) == pytest.approx(expected, rel=1e-14)
    column = np.array([[0.3], [2.5], [4.0]])
    np.testing.assert_array_equal(
        TwoPhaseForce()(column), [TwoPhaseForce()(t) for t in column[:, 0]]
    )
    # Ten turns per second: a tenth of a second is a whole one.
    assert TwoPhaseForce(hertz=True)(0.1) == pytest.approx((0.0, -100.0, 0.0), abs=1e-12)


def test_the_centre_of_mass_follows_newtons_second_law_whatever_the_arm_does() -> None:
    vehicle = PAPER.replace({"arm.disks": [DISK], "arm.radius": 0.002})
    scenario = flight().replace(q=np.atleast_2d(flight().q))
    flown = simulate(vehicle, scenario, variables=VARIABLES, rtol=1e-6)
    com, _ = mass_distribution(vehicle, np.asarray(flown["bend"]))
    path = centre_of_mass(flown, com)[0, :, :2]
    t = np.asarray(flown["time"])
    # The force integrated twice from rest, before it switches.
    before = t <= 2.5
    x = 100 / 10 * (t - np.sin(10 * t) / 10)
    y = 100 / 100 * (np.cos(10 * t) - 1)
    expected = np.column_stack([x, y])[before] / vehicle.mass
    np.testing.assert_allclose(path[before] - path[0], expected, rtol=0, atol=2e-7)
    # The arm does swing meanwhile.
    assert np.ptp(com[..., 0]) > 0.005


def test_inertia_of_the_straight_arm_is_that_of_a_rod_and_its_disk() -> None:
    vehicle = PAPER.replace({"arm.disks": [DISK]})
    com, inertia = mass_distribution(vehicle, np.zeros((1, 1, 2)))
    rod, length, total = vehicle.arm.backbone_mass, vehicle.arm.length, vehicle.mass
    height = -(rod * length / 2 + 0.3 * 0.8) / total
    assert com[0, 0] == pytest.approx([0, 0, height], rel=1e-14)
    slices = vehicle.arm.density * math.pi * vehicle.arm.radius**4 / 4 * length
    arm = rod * length**2 / 3 + slices + 0.3 * 0.8**2 + 1e-4
    across, axial = 0.024 + arm - total * height**2, 0.047 + 2 * slices + 2e-4
    np.testing.assert_allclose(inertia[0, 0], np.diag([across, across, axial]), rtol=0, atol=1e-14)
    assert straight_arm_inertia(vehicle) == pytest.approx(arm, rel=1e-14)


def test_a_bent_arm_carries_the_momentum_that_its_inertia_and_spin_give() -> None:
    disks = [{"position": 0.5, "mass": 0.3, "inertia": (4e-3, 7e-3)}, DISK]
    vehicle = PAPER.replace({"arm.disks": disks, "arm.radius": 0.02})
    kappa, psi, spin = 1.3, -0.7, np.array([0.3, -0.5, 0.8])
    bend = kappa * np.array([math.cos(psi), math.sin(psi)])
    com, inertia = mass_distribution(vehicle, bend[None, None])
    still = -np.cross(spin, com[0, 0])
    scenario = Scenario("spin", [0] * 6 + [kappa, psi], [*still, *spin, 0, 0], duration=1e-3)
    start = simulate(vehicle, scenario, sample=1e-3).isel(time=0)
    np.testing.assert_allclose(start["linear_momentum"], 0.0, atol=1e-13)
    np.testing.assert_allclose(start["angular_momentum"], inertia[0, 0] @ spin, rtol=1e-12)
    assert float(start["kinetic_energy"]) == pytest.approx(spin @ inertia[0, 0] @ spin / 2)


def test_backbone_point_of_a_half_circle_is_a_diameter_away() -> None:
    bend = np.array([0.6, 0.8]) * math.pi
    point = backbone_point(bend[None], np.ones(1))[0]
    np.testing.assert_allclose(
        point, [0.6 * 2 / math.pi, 0.8 * 2 / math.pi, 0.0], rtol=0, atol=1e-14
    )


def sweep(errors: list[float], many: list[float], converged: bool = True) -> dict[str, Any]:
    """A sweep of one parameter from 1 up, with these errors at few and at many values."""
    rows = [
        {
            "value": i + 1.0,
            "label": f"{i + 1} kg",
            "models": {
                "coupled": {"converged": True},
                "decoupled": {"rmse_xy_m": error, "converged": converged},
            },
        }
        for i, error in enumerate(errors)
    ]
    values = np.linspace(1.0, len(errors), len(many)).tolist()
    between = {"value": values, "rmse_xy_m": {"decoupled": many}}
    return {"UAV mass": {"rows": rows, "between": between, "scale": 1.0, "units": "kg"}}


RISING, FALLING = [0.1, 0.2, 0.3, 0.4, 0.5], [0.5, 0.4, 0.3, 0.2, 0.1]
SCATTER = [0.3, 0.1, 0.5, 0.2, 0.35]


@pytest.mark.parametrize(
    ("few", "many", "converged", "expected"),
    [
        ([1.0, 2.0, 3.0], RISING, True, HOLDS),
        ([1.0, 2.0, 3.0], RISING, False, UNDECIDED),
        # The few values rise by chance, the many do not.
        ([1.0, 2.0, 3.0], SCATTER, True, UNDECIDED),
        ([1.0, 3.0, 2.0], RISING, True, UNDECIDED),
        ([3.0, 1.0, 2.0], FALLING, True, FAILS),
        # A hundredth is no trend.
        ([1.0, 1.001, 1.002], FALLING, True, FAILS),
    ],
)
def test_a_trend_needs_the_few_values_and_the_many(
    few: list[float], many: list[float], converged: bool, expected: str
) -> None:
    found = findings.trend("UAV mass", "error", 1)(sweep(few, many, converged))
    assert found.verdict == expected
    assert f"{few[0]:.3g}" in found.evidence


def test_a_trend_of_few_values_takes_ties_and_looks_at_no_others() -> None:
    falling = findings.trend_of_few("UAV mass", "error", -1)
    assert falling(sweep([3.0, 3.01, 1.0], RISING)).verdict == HOLDS
    assert falling(sweep([3.0, 3.1, 1.0], FALLING)).verdict == FAILS
    assert falling(sweep([3.0, 2.0, 1.0], FALLING, converged=False)).verdict == UNDECIDED
    rows = np.array([[1.0, 2.0, 3.0], [1.0, 3.0, 2.0], [1.0, 1.0, 1.0], [1.0, np.nan, 3.0]])
    assert findings.follows(rows, 1).tolist() == [True, False, False, False]


def test_a_restricted_sweep_is_judged_by_its_upper_values_alone() -> None:
    whole = sweep([1.0, 5.0, 4.0, 3.0], [1.0, 5.0, 4.5, 4.0, 3.5, 3.2, 3.0])
    part = {"UAV mass": findings.restricted(whole["UAV mass"], 1.5)}
    falling = findings.trend("UAV mass", "error", -1)
    assert falling(whole).verdict == UNDECIDED
    assert falling(part).verdict == HOLDS
    assert part["UAV mass"]["between"]["value"][0] == 1.5


def test_frequency_amplitude_and_phase_are_separate() -> None:
    time = np.linspace(0.0, 20.0, 4001)
    one = np.exp(2j * np.pi * time)
    found = swing.differences(one, 1.2 * one * np.exp(0.3j))
    assert found[swing.AMPLITUDE_OFF] == pytest.approx(0.2)
    assert found[swing.PHASE_OFF] == pytest.approx(0.3)
    assert found[swing.FREQUENCY_OFF] == pytest.approx(0.0, abs=1e-9)
    faster = swing.differences(one, np.exp(2.2j * np.pi * time))
    assert faster[swing.FREQUENCY_OFF] == pytest.approx(0.1, rel=1e-2)


@pytest.mark.parametrize(
    ("off", "expected"), [({}, FAILS), ({swing.PHASE_OFF: 0.2}, HOLDS),
                          ({swing.AMPLITUDE_OFF: 0.11}, HOLDS),
                          ({swing.FREQUENCY_OFF: math.nan}, UNDECIDED)]
)  # fmt: skip
def test_an_oscillation_is_missed_if_any_of_its_properties_is(
    off: dict[str, float], expected: str
) -> None:
    part = sweep([0.1, 0.1], SCATTER * 2)["UAV mass"]
    keys = (swing.FREQUENCY_OFF, swing.AMPLITUDE_OFF, swing.PHASE_OFF)
    part["rows"][-1]["models"]["decoupled"] |= dict.fromkeys(keys, 0.05) | off
    part["rows"][-1]["oscillation_m"] = 1.0
    assert view({"arm length": part}, CLAIMS["IV-B.18"].checks).verdict == expected


@pytest.mark.long
def test_a_sweep_flown_once_is_the_sweep_of_the_study(flown: study.Sensitivity) -> None:
    theirs = flown.results["sweeps"]["UAV mass"]
    ours = once.sweep_once(PAPER, "UAV mass")
    for mine, row in zip(ours["rows"], theirs["rows"], strict=True):
        assert mine["models"]["decoupled"]["converged"]
        for key in ("rmse_xy_m", "rmse_xy_by_second_m"):
            right = row["models"]["decoupled"][key]
            assert mine["models"]["decoupled"][key] == pytest.approx(right, rel=1e-3)
        for key in ("value", "label", "mass_kg", "arm_inertia_kg_m2"):
            assert mine[key] == row[key]
        for key in ("displacement_m", "oscillation_m", "com_travel_m"):
            assert mine[key] == pytest.approx(row[key], rel=1e-4)
    assert ours["between"]["unresolved"] == []
    assert len(ours["between"]["value"]) == once.VALUES


@pytest.mark.long
def test_a_straight_arm_at_the_start_is_bent_by_the_force_alone() -> None:
    """Its bend falls with the radius squared, and the travel of the mass with it."""
    found = once.sweep_once(load_vehicle("table1"), "arm radius", straight=True)["rows"]
    bends = [row["largest_bend_1_m"] for row in found]
    assert bends[1] / bends[2] == pytest.approx(4.0, rel=0.3)
    assert bends[2] < 0.01
    with_bend = once.sweep_once(load_vehicle("table1"), "arm radius")["rows"]
    assert with_bend[2]["largest_bend_1_m"] >= 0.1


def test_values_that_are_not_resolved_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(once, "ERROR_SHARE", 0.0)
    found = once.sweep_once(PAPER, "UAV mass")
    assert len(found["between"]["unresolved"]) == once.VALUES - len(found["rows"])
    assert len(found["between"]["value"]) == len(found["rows"])


def test_a_sentence_holds_only_if_all_of_its_parts_do() -> None:
    def combined(*verdicts: str) -> str:
        return all_of([Judgement(verdict, "because") for verdict in verdicts]).verdict

    assert combined(HOLDS, HOLDS) == HOLDS
    assert combined(HOLDS, UNDECIDED) == UNDECIDED
    assert combined(UNDECIDED, FAILS) == FAILS
    assert combined() == UNDECIDED


def test_sentences_about_sweeps_not_flown_cannot_be_decided() -> None:
    judged = verdicts({"sweeps": {}})
    assert [found["id"] for found in judged] == list(CLAIMS)
    # The period of the printed force needs no sweep.
    assert {found["verdict"] for found in judged if found["id"] != "IV-B.4"} == {UNDECIDED}


@pytest.mark.long
def test_verdicts_follow_the_numbers_and_not_the_sentences(flown: study.Sensitivity) -> None:
    """Reversing the flights' displacements reverses the verdict on them."""

    def about_mass(results: dict[str, Any]) -> dict[str, Any]:
        return next(c for c in verdicts(results) if c["id"] == "IV-B.12")

    assert about_mass(flown.results)["verdict"] == HOLDS
    changed = json.loads(as_json(flown.results))
    rows = changed["sweeps"]["UAV mass"]["rows"]
    for row, value in zip(rows, [row["displacement_m"] for row in rows][::-1], strict=True):
        row["displacement_m"] = value
    changed["sweeps"]["UAV mass"]["between"]["displacement_m"].reverse()
    assert about_mass(changed)["verdict"] == FAILS


@pytest.mark.long
def test_flown_sweeps_have_converged_and_meet_at_the_nominal_vehicle(
    flown: study.Sensitivity,
) -> None:
    mass, roll = (flown.results["sweeps"][name]["rows"] for name in ("UAV mass", "initial roll"))
    for row in [*mass, *roll]:
        for model in ("coupled", "decoupled", "independent"):
            assert row["models"][model]["converged"], row
        assert row["models"]["coupled"]["rmse_t_m"] == 0
    # 2 kg without roll is in both: one flight, batched with different others.
    for key in ("rmse_xy_m", "nrmse_t", "angle_rad"):
        pair = [row["models"]["decoupled"][key] for row in (mass[1], roll[0])]
        assert pair[0] == pytest.approx(pair[1], rel=1e-12)
    # The horizontal error is part of the whole one.
    for row in mass:
        entry = row["models"]["decoupled"]
        parts = math.hypot(entry["rmse_x_m"], entry["rmse_y_m"])
        assert entry["rmse_xy_m"] == pytest.approx(parts, rel=1e-13, abs=0)
        assert entry["rmse_xy_m"] < entry["rmse_t_m"]


@pytest.mark.long
def test_values_between_pass_through_the_values_compared(flown: study.Sensitivity) -> None:
    part = flown.results["sweeps"]["initial roll"]
    for row in part["rows"]:
        at = part["between"]["value"].index(row["value"])
        for model in ("decoupled", "independent"):
            found = part["between"]["rmse_xy_m"][model][at]
            assert found == pytest.approx(row["models"][model]["rmse_xy_m"], rel=1e-12)
        displacement = part["between"]["displacement_m"][at]
        assert displacement == pytest.approx(row["displacement_m"], rel=1e-12)


@pytest.mark.long
def test_figures_draw_the_tips_and_the_errors(flown: study.Sensitivity) -> None:
    axes: Any = figures.paths(flown.results, flown.datasets).axes[0]
    drawn = {line.get_label(): line for line in axes.get_lines()}
    dataset = flown.datasets["UAV mass"]
    tip = dataset["tip_position"].sel(model="decoupled").isel(run=2)
    np.testing.assert_array_equal(drawn["_3 kg"].get_ydata(), tip.sel(axis="y"))
    assert drawn["_3 kg"].get_color() == drawn["3 kg"].get_color()
    axes = figures.errors(flown.results).axes[1]
    between = flown.results["sweeps"]["initial roll"]["between"]
    line = next(item for item in axes.get_lines() if item.get_label() == "decoupled")
    np.testing.assert_allclose(line.get_xdata(), np.degrees(between["value"]), rtol=1e-14)
    np.testing.assert_array_equal(line.get_ydata(), between["rmse_xy_m"]["decoupled"])


@pytest.mark.long
def test_the_paths_name_a_failed_flight_by_its_value(flown: study.Sensitivity) -> None:
    """The second of 1, 2 and 3 kg, not the run 1."""
    dataset = flown.datasets["UAV mass"].copy(deep=True)
    dataset["status"].loc[{"model": "decoupled", "run": 1}] = 1
    dataset["end_time"].loc[{"model": "decoupled", "run": 1}] = 0.5
    figure: Any = figures.paths(flown.results, flown.datasets | {"UAV mass": dataset})
    said = " ".join(" ".join(each.get_text() for each in figure.texts).split())
    assert "UAV mass: × Failed: decoupled 2 kg ended at 0.5 s" in said
    # Crosses have the colour of their value, whatever that of the model is.
    crosses = [
        line.get_color()
        for axes in figure.axes
        for line in axes.get_lines()
        if line.get_gid() == "failed"
    ]
    assert crosses == [figures.VALUES[1]] * 2


@pytest.mark.long
def test_values_beside_one_that_was_left_out_are_not_neighbours(flown: study.Sensitivity) -> None:
    results = json.loads(json.dumps(flown.results))
    sweep = next(iter(results["sweeps"].values()))
    between, count = sweep["between"], len(sweep["between"]["value"])
    assert between["follows"] == [True] * (count - 1)

    def lines() -> int:
        return len(figures.errors(results).axes[0].get_lines())

    between["rmse_xy_m"]["decoupled"] = [0.1] * 3 + [0.12] * (count - 3)
    joined = lines()
    assert sensitivity_output.neighbour_ratio(sweep) == pytest.approx(1.2)
    between["follows"][2] = False
    assert sensitivity_output.neighbour_ratio(sweep) == 1.0
    assert lines() in (joined - 1, joined - 2)  # of one model or of both, as the other one's go


@pytest.mark.long
def test_the_title_of_the_paths_is_of_what_is_drawn_below_them(flown: study.Sensitivity) -> None:
    figure: Any = figures.paths(flown.results, flown.datasets)
    below = [axes for axes in figure.axes if axes.get_ylabel() == "apart [m]"]
    farthest = max(float(np.max(each.get_ydata())) for axes in below for each in axes.get_lines())
    assert f"up to {short(farthest)} m" in figure.get_label()


@pytest.mark.long
def test_the_figure_of_errors_tells_the_largest_of_them(flown: study.Sensitivity) -> None:
    figure: Any = figures.errors(flown.results)
    title = " ".join(" ".join(each.get_text() for each in figure.texts).split())
    largest = max(
        max(sweep["between"]["rmse_xy_m"]["decoupled"])
        for sweep in flown.results["sweeps"].values()
    )
    assert f"{short(largest)} m" in title


@pytest.mark.long
def test_stored_results_hold_every_sentence_row_and_trajectory(
    flown: study.Sensitivity, tmp_path: Path
) -> None:
    folder = ResultFolder(tmp_path / "out", "sensitivity")
    sensitivity_output.write(flown, folder)
    folder.finish()
    table = (tmp_path / "out/table.md").read_text("utf-8")
    for claim in flown.results["claims"]:
        assert f"| {claim['id']} | {claim['about']} | {claim['quote']} |" in table
    assert "Every row has converged." in table
    lines = (tmp_path / "out/sensitivity.csv").read_text().splitlines()
    assert len(lines) == 1 + 2 * (3 + 4)
    with xr.open_dataset(tmp_path / "out/sensitivity_uav_mass.nc", engine="h5netcdf") as stored:
        xr.testing.assert_equal(stored.load(), flown.datasets["UAV mass"])
        assert stored["value"].to_numpy().tolist() == [1.0, 2.0, 3.0]


@pytest.mark.long
def test_a_row_that_has_not_converged_is_said_not_to_have(flown: study.Sensitivity) -> None:
    changed = json.loads(as_json(flown.results))
    entry = changed["sweeps"]["UAV mass"]["rows"][1]["models"]["decoupled"]
    entry |= {"converged": False, "relative_error": 0.3}
    said = sensitivity_output.remarks(changed)
    assert any("UAV mass 2 kg, decoupled" in line and "30 %" in line for line in said)
    entry["relative_error"] = math.inf
    (told,) = (line for line in sensitivity_output.remarks(changed) if "2 kg" in line)
    assert "30 %" not in told and "inf" not in told


@pytest.mark.long
def test_values_between_whose_errors_make_their_differences_are_left_out_and_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = study._between
    at = PARAMETERS["UAV mass"]
    before = whole(PAPER, flight(), at)
    assert before["unresolved"] == []
    # As if a difference had to be a hundred million times the error.
    monkeypatch.setattr(study, "ERROR_SHARE", 1e-8)
    after = whole(PAPER, flight(), at)
    assert sorted([*after["value"], *after["unresolved"]]) == before["value"]
    assert len(after["unresolved"]) > 5
    sweep = {"rows": [], "between": after}
    said = sensitivity_output.remarks({"vehicle": PAPER.describe(), "sweeps": {"UAV mass": sweep}})
    assert f"UAV mass: {len(after['unresolved'])} of" in said[1]


@pytest.mark.long
def test_euler_angles_that_samples_do_not_follow_are_said_to_have_no_error(
    flown: study.Sensitivity,
) -> None:
    changed = json.loads(json.dumps(flown.results))
    before = sensitivity_output.remarks(changed)
    changed["sweeps"]["UAV mass"]["rows"][1]["models"]["decoupled"]["nrmse_r"] = math.nan
    (told,) = set(sensitivity_output.remarks(changed)) - set(before)
    assert "NRMSE_R and RMSE_R" in told


def test_an_upper_half_is_that_of_all_values_tried() -> None:
    """Of the values 1 to 20 those above 10 are lost, all but 11; the largest error is at 8."""
    kept = [float(value) for value in range(1, 12)]
    rows = [
        {"label": f"{value}", "models": dict.fromkeys(("coupled", "decoupled"), entry)}
        for value in (1, 2, 3)
        for entry in [{"converged": True, "rmse_xy_m": 4.0 - value}]
    ]
    between = {
        "value": kept,
        "rmse_xy_m": {"decoupled": [float(value == 8.0) for value in kept]},
        "ended_early": [float(value) for value in range(12, 21)],
        "unresolved": [],
    }
    sweep = {"rows": rows, "between": between, "scale": 1.0, "units": "rad"}
    check = findings.largest_above_the_middle("initial roll")
    assert check({"initial roll": sweep}).verdict == FAILS
    sweep["between"] = between | {"ended_early": []}
    assert check({"initial roll": sweep}).verdict == UNDECIDED


@pytest.mark.long
def test_figures_name_values_that_have_not_converged(flown: study.Sensitivity) -> None:
    changed = json.loads(json.dumps(flown.results))
    changed["sweeps"]["UAV mass"]["rows"][1]["models"]["decoupled"]["converged"] = False
    changed["sweeps"]["UAV mass"]["between"]["unresolved"] = [1.5]
    for figure in (figures.errors(changed), figures.paths(changed, flown.datasets)):
        told = " ".join(text.get_text() for text in figure.texts).replace("\n", " ")
        assert "Not converged: UAV mass 2 kg." in told
    told = " ".join(text.get_text() for text in figures.errors(changed).texts)
    assert "not resolved: 1 of UAV mass" in told.replace("\n", " ")


@pytest.mark.long
def test_flights_that_end_early_are_said_to_and_leave_nothing_to_judge_by() -> None:
    """The nominal bend of 0.1 1/m is more than a full circle of an arm of 70 m."""
    long = PAPER.replace({"arm.length": 70.0})
    found = study.sensitivity(long, ["UAV mass"])
    part = found.results["sweeps"]["UAV mass"]
    assert len(part["between"]["ended_early"]) == 41
    assert not part["rows"][0]["models"]["coupled"]["converged"]
    said = "\n".join(sensitivity_output.remarks(found.results))
    assert "UAV mass 1 kg, coupled" in said and "41 of the values" in said
    assert math.isnan(sensitivity_output.neighbour_ratio(part))
    assert math.isnan(sensitivity_output.closer_share(part))
    claims = [c for c in found.results["claims"] if c["about"] == "UAV mass"]
    assert {c["verdict"] for c in claims} == {UNDECIDED}
    sensitivity_output.as_table(found.results)
    assert json.loads(as_json(found.results))
    drawn = [text.get_text() for text in figures.errors(found.results).texts]
    assert any("× " in text and "UAV mass 1, 1.05" in text for text in drawn)


@pytest.mark.long
def test_the_title_of_the_errors_is_the_largest_factor_between_neighbours(
    flown: study.Sensitivity,
) -> None:
    ratio = max(map(sensitivity_output.neighbour_ratio, flown.results["sweeps"].values()))
    title = " ".join(text.get_text() for text in figures.errors(flown.results).texts[:2])
    assert f"up to {ratio:.2g}-fold" in title


@pytest.mark.long
def test_no_line_joins_neighbours_that_differ_wildly(flown: study.Sensitivity) -> None:
    for axes in figures.errors(flown.results).axes:
        for line in axes.get_lines():
            if line.get_linestyle() == "-" and len(np.atleast_1d(line.get_ydata())) == 2:
                first, second = np.asarray(line.get_ydata())
                assert max(first / second, second / first) <= figures.WILD


@pytest.mark.long
def test_the_rows_agree_with_metrics_gathered_while_flying(flown: study.Sensitivity) -> None:
    """`run_pairs` sums up inside the kernel, over steps of each run's own."""
    parameter = PAPER.replace({"uav.mass": PARAMETERS["UAV mass"].values})
    pairs = run_pairs(parameter, flight(), method="Tsit5", rtol=RTOL).sel(model="decoupled")
    rows = flown.results["sweeps"]["UAV mass"]["rows"]
    for name in ("nrmse_t", "rmse_t_m", "angle_rad"):
        mine = [row["models"]["decoupled"][name] for row in rows]
        np.testing.assert_allclose(mine, pairs[name], rtol=5e-11)


def test_what_cannot_be_swept_is_refused_before_any_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "simulate", None)
    with refused("parameters"):
        study.sensitivity(PAPER, ["UAV mas"])
    with refused("vehicle"):
        study.sensitivity(PAPER.replace({"arm.radius": [0.004, 0.005]}))
    with refused("arm.radius"):
        study.sensitivity(PAPER.replace({"arm.length": 0.015}))


def test_a_batch_changes_one_thing_and_leaves_the_rest() -> None:
    vehicle, scenario = batch(PAPER, flight(), PARAMETERS["initial bend"], [0.2, 0.4])
    assert vehicle is PAPER
    np.testing.assert_array_equal(np.asarray(scenario.q)[:, 6], [0.2, 0.4])
    np.testing.assert_array_equal(np.asarray(scenario.q)[:, :6], [flight().q[:6]] * 2)  # type: ignore[index]


def test_a_vehicle_is_varied_about_its_own_values_and_the_papers_as_the_paper_does() -> None:
    assert of_the_paper(PAPER) and of_the_paper(PAPER.replace({"arm.disks": [DISK]}))
    assert not of_the_paper(load_vehicle("slender")) and not of_the_paper(NEW_USER)
    own = about(NEW_USER)
    assert list(own) == list(PARAMETERS)
    assert own["arm radius"].values == pytest.approx((0.64e-3, 0.8e-3, 0.96e-3), rel=1e-12)
    assert own["UAV mass"].values == pytest.approx((0.95, 1.9, 2.85), rel=1e-12)
    assert own["arm length"].values == pytest.approx((0.175, 0.35, 0.525), rel=1e-12)
    assert own["Young's modulus"].values == pytest.approx((30e9, 60e9, 90e9), rel=1e-12)
    for name in ("initial bend", "initial roll"):
        assert own[name] is PARAMETERS[name]
    with refused("vehicle"):
        of_the_paper(load_vehicle("two_section"))


def test_an_arm_given_by_its_stiffness_is_varied_by_that() -> None:
    arm = {"length": 0.4, "bending_stiffness": 0.02, "mass_per_length": 0.03}
    plain = Vehicle(name="plain", uav=NEW_USER.uav, arm=arm)
    own = about(plain)
    assert "arm radius" not in own and "Young's modulus" not in own
    assert own["bending stiffness"].values == pytest.approx((0.01, 0.02, 0.03), rel=1e-12)
    assert own["mass per length"].label(own["mass per length"].values[0]) == "15 g/m"
    for parameter in own.values():
        batch(plain, flight(), parameter, parameter.between())


def test_disks_move_along_with_the_length_of_their_arm() -> None:
    vehicles, _ = batch(NEW_USER, flight(), about(NEW_USER)["arm length"], [0.175, 0.35])
    for run, part in ((0, 0.5), (1, 1.0)):
        places = [disk.position for disk in vehicles.select(run).arm.disks]
        own = [part * disk.position for disk in NEW_USER.arm.disks]
        np.testing.assert_allclose(places, own, rtol=1e-15)


@pytest.mark.long
def test_words_figures_and_tables_say_whose_values_are_varied(
    flown: study.Sensitivity, tmp_path: Path
) -> None:
    found = study.sensitivity(NEW_USER, ["UAV mass"], own=True)
    assert found.results["values"] == "own" and found.results["claims"] == []
    rows = found.results["sweeps"]["UAV mass"]["rows"]
    assert [row["label"] for row in rows] == ["0.95 kg", "1.9 kg", "2.85 kg"]
    errors = found.results["sweeps"]["UAV mass"]["between"]["rmse_xy_m"]["decoupled"]
    table = sensitivity_output.as_table(found.results)
    for part in ("about the vehicle's own", f"2.85 kg: between {min(errors):.4g} and"):
        assert part in table
    assert "The paper's sentences" not in table
    theirs = sensitivity_output.as_table(flown.results)
    assert "The values are the paper's" in theirs and "## The paper's sentences" in theirs
    for results, told in ((found.results, "values about its own"), (flown.results, "the paper's")):
        assert any(told in text.get_text() for text in figures.errors(results).texts)


@pytest.mark.long
def test_the_command_varies_a_vehicle_about_its_own_values(
    flown: study.Sensitivity, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[bool] = []

    def sensitivity(*_: Any, own: bool, **__: Any) -> study.Sensitivity:
        asked.append(own)
        return flown

    monkeypatch.setattr(study, "sensitivity", sensitivity)
    for vehicle in ("paper", "slender"):
        assert CliRunner().invoke(app, ["sensitivity", "--vehicle", vehicle]).exit_code == 0
    assert asked == [False, True]


@pytest.mark.long
def test_the_command_writes_json_tables_and_figures(
    flown: study.Sensitivity, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(study, "sensitivity", lambda *_, **__: flown)
    out = tmp_path / "out"
    result = CliRunner().invoke(app, ["sensitivity", "--json", "-", "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout) == json.loads((out / "sensitivity.json").read_text("utf-8"))
    assert {"table.md", "paths.png", "errors.pdf"} <= {path.name for path in out.iterdir()}
    assert "IV-B.12" in result.stderr and "holds: " in result.stderr


def test_a_folder_of_another_study_is_refused_before_any_flight(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(study, "sensitivity", None)
    ResultFolder(tmp_path, "open_loop")
    result = CliRunner().invoke(app, ["sensitivity", "--out", str(tmp_path)])
    assert_refused(result, "out", "open_loop")


@pytest.mark.parametrize(
    ("vehicle", "redo"),
    [
        ("paper", "continuair sensitivity --vehicle paper"),
        ("slender", "continuair paper --vehicle"),
    ],
)
def test_what_redoes_a_part_of_the_papers_report_varies_the_same_values(
    vehicle: str, redo: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    told: list[str] = []

    @contextmanager
    def results_in(folder: str, name: str, command: str) -> Iterator[str]:
        told.append(command)
        yield folder

    monkeypatch.setattr(paper_command, "results_in", results_in)
    monkeypatch.setattr("amiri2026.report.keeping.keep", lambda *_: None)
    paper_command._keep("sensitivity", None, vehicle, str(tmp_path), quick=False)
    assert told[0].startswith(redo)
