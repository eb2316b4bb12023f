"""Robustness: what mistakes are, what they cost, and what is written of it."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from amiri2026.figures import robustness as figures
from amiri2026.robustness.flights import GROUNDED, LETTER, SETTING, Wrong, fly, groups
from amiri2026.robustness.mistakes import MISTAKES
from amiri2026.robustness.report import as_table
from amiri2026.robustness.study import BORNE, Robustness, _worst, reason, robustness
from continuair.controllers.gain_files import load_gains
from continuair.scenario.tracking_task import equipped, noise_notes, task
from tests.refusals import assert_refused, refused

CHOSEN = ("heavier", "camera tilted", "side force", "shorter", "latency")
NOMINAL = equipped(ca.load_vehicle("paper"), SETTING)


@pytest.fixture(scope="module")
def study() -> Robustness:
    return robustness(ca.load_vehicle("paper"), ["current"], ["coupled"], CHOSEN)


def test_a_camera_that_is_not_perfect_gets_no_better_by_a_mistake() -> None:
    own = {"camera.noise": 1.0, "camera.frame_rate": 20.0, "camera.latency": 0.03}
    nominal = ca.load_vehicle("paper").replace(own)
    for value in (1.0, 10.0, 80.0):
        noisy, rare, late = (
            nominal.replace(MISTAKES[name].vehicle(nominal, value, (1.0, 0.0))).camera
            for name in ("noise", "frames", "latency")
        )
        assert noisy.noise**2 == pytest.approx(1.0 + value**2)
        assert rare.frame_rate == pytest.approx(min(20.0, 1e3 / value))
        assert late.latency == pytest.approx(0.03 + 1e-3 * value)


@pytest.mark.parametrize("name", MISTAKES)
def test_each_mistake_is_something_of_its_own_and_grows(name: str) -> None:
    mistake = MISTAKES[name]
    assert list(mistake.values) == sorted(set(mistake.values)) and mistake.values[0] > 0.0
    made = []
    for way in mistake.ways.values():
        changed = mistake.vehicle(NOMINAL, mistake.values[0], way)
        acting = mistake.scenario(1.0, way)
        assert changed or acting
        made.append(str((changed, acting)))
        for path in changed:
            assert NOMINAL.replace(changed) != NOMINAL, path
    assert len(set(made)) == len(mistake.ways)


@pytest.mark.long
def test_a_heavier_vehicle_flies_as_one_that_its_law_knows_and_that_is_pushed_down(
    study: Robustness,
) -> None:
    """In steady flight the weight that the law does not carry is a force; it stays below inertia's
    part of it."""
    law = load_gains("current").controller(NOMINAL)
    found = study.results["cases"][0]["mistakes"]["heavier"]["values"][1]
    down = -9.81 * 0.01 * found["value"] * NOMINAL.uav.mass
    start = _letter(law).replace(force=[0.0, 0.0, down])
    flight = ca.simulate(NOMINAL, start, sample=0.01, variables=["feature_error"])
    late = flight["feature_error"].sel(time=slice(SETTING.settled, None))
    rms = float(np.sqrt((late**2).mean()))
    assert found["rms_px"] == pytest.approx(rms, rel=0.02)


def _letter(law: ca.Controller) -> ca.Scenario:
    from continuair.scenario.tracking_task import task

    return task(NOMINAL, [LETTER], law, SETTING.duration)


@pytest.mark.long
def test_what_a_steady_force_leaves_grows_with_it(study: Robustness) -> None:
    values = study.results["cases"][0]["mistakes"]["side force"]["values"]
    small, double = (each["rms_px"] for each in values[:2])
    assert double == pytest.approx(2.0 * small, rel=0.05)


@pytest.mark.long
def test_how_the_camera_is_mounted_and_when_images_arrive_hardly_matters(study: Robustness) -> None:
    """The desired image is one that the same camera took; the target's motion is fed forward."""
    case = study.results["cases"][0]
    for name in ("camera tilted", "latency"):
        for each in case["mistakes"][name]["values"]:
            assert each["rms_px"] < 1.2 * case["without"]["rms_px"]


@pytest.mark.long
def test_a_flight_that_ends_early_is_not_borne_and_says_why(study: Robustness) -> None:
    found = study.results["cases"][0]["mistakes"]["shorter"]
    assert (found["reached"], found["failed_at"]) == (20.0, 40.0)
    assert "lost from view" in found["reason"]
    assert np.isnan(found["values"][-1]["rms_px"])
    borne = study.results["cases"][0]["mistakes"]["side force"]
    most = study.results["cases"][0]["without"]["rms_px"] + BORNE
    reached = [each["value"] for each in borne["values"] if each["rms_px"] <= most]
    assert borne["reached"] == reached[-1]


@pytest.mark.long
def test_a_mistake_of_a_batch_flies_as_it_does_alone() -> None:
    law = load_gains("current").controller(NOMINAL)
    wrong = [Wrong(None), Wrong("heavier", 20.0), Wrong("camera rolled", 10.0, "-")]
    wrong.append(Wrong("noise", 1.0))
    assert groups([*wrong, Wrong("latency", 5.0)]) == [wrong, [Wrong("latency", 5.0)]]
    together = fly(NOMINAL, law, "coupled", wrong)
    for each, found in zip(wrong[:3], together, strict=False):
        (alone,) = fly(NOMINAL, law, "coupled", [each])
        assert found["rms_px"] == pytest.approx(alone["rms_px"], rel=1e-6)


@pytest.mark.long
def test_of_the_ways_to_be_wrong_the_worst_counts() -> None:
    """Constant gains bear an image's centre that is off to one side, and lose the other."""
    nominal = ca.load_vehicle("paper")
    law = load_gains("paper").controller(NOMINAL)
    sides = [Wrong("principal point", 100.0, way) for way in ("+x", "-x")]
    right, left = fly(NOMINAL, law, "coupled", sides)
    assert right["status"] == 0 and left["status"] != 0
    study = robustness(nominal, ["constant"], ["coupled"], ["principal point"])
    (case,) = study.results["cases"]
    found = case["mistakes"]["principal point"]["values"][-1]
    assert found["status"] != 0 and found["end_time_s"] <= left["end_time_s"]


@pytest.mark.long
@pytest.mark.parametrize("rolled", [np.pi / 2, -2.0])
def test_a_camera_rolled_about_its_axis_flies_the_same_letter(rolled: float) -> None:
    """With the vehicle, which is round, turned below it: off and bent as the image has it."""
    turned = NOMINAL.replace({"camera.attitude": Rotation.from_euler("z", rolled).as_quat()})
    one, other = (
        fly(vehicle, load_gains("current").controller(vehicle), "coupled", [Wrong(None)])[0]
        for vehicle in (NOMINAL, turned)
    )
    assert other["rms_px"] == pytest.approx(one["rms_px"], rel=1e-4)
    law = load_gains("paper").controller
    sides = [Wrong("principal point", 100.0, way) for way in ("+x", "-x")]
    for nominal in (NOMINAL, turned):
        found = fly(nominal, law(nominal), "coupled", sides)
        assert [each["status"] == 0 for each in found] == [True, False]


@pytest.mark.long
def test_the_figure_crosses_flights_that_ended_early(study: Robustness) -> None:
    figure = figures.errors(study.results, "coupled")
    crosses = [
        len(np.asarray(line.get_xdata()))
        for axes in figure.axes
        for line in axes.lines
        if line.get_gid() == "failed"
    ]
    assert sum(crosses) == 1


@pytest.mark.long
def test_the_command_writes_tables_and_refuses_what_is_unknown(tmp_path: Path) -> None:
    run = CliRunner().invoke
    given = ["robustness", "--law", "current", "--model", "coupled", "--mistake", "side force"]
    out = run(cli.app, [*given, "--out", str(tmp_path / "out")])
    assert out.exit_code == 0, out.output
    found = json.loads((tmp_path / "out" / "robustness.json").read_text())
    assert found["cases"][0]["mistakes"]["side force"]["reached"] == 1.0
    assert "1 N (not 2 N)" in (tmp_path / "out" / "table.md").read_text()
    assert (tmp_path / "out" / "errors_coupled.png").exists()
    assert_refused(run(cli.app, ["robustness", "--mistake", "bigger"]), "mistakes", "'bigger'")


def test_a_way_in_which_a_point_comes_behind_the_camera_is_worse_than_any_error() -> None:
    there, back = Wrong("side force", 1.0, "+x"), Wrong("side force", 1.0, "-x")
    borne = {"status": 0, "end_time_s": 50.0, "rms_px": 3.0}
    behind = borne | {"rms_px": float("nan")}
    for found in ({there: borne, back: behind}, {there: behind, back: borne}):
        worst = _worst([there, back], found)
        assert np.isnan(worst["rms_px"]) and found[Wrong("side force", 1.0, worst["way"])] is behind
    lost = borne | {"status": 3, "end_time_s": 4.0}
    assert _worst([there, back], {there: behind, back: lost})["way"] == "-x"


@pytest.mark.long
def test_of_a_law_that_loses_the_letter_without_a_mistake_nothing_follows_for_mistakes() -> None:
    """The preset's constant gains lose this vehicle at once, and fly it with a longer arm."""
    uav = {"mass": 2.0, "inertia": [0.02, 0.02, 0.035]}
    arm = {"length": 0.6, "radius": 0.004, "density": 1900.0, "youngs_modulus": 30e9}
    arm |= {"damping_ratio": 0.04, "drag_coefficient": 1.1}
    vehicle = ca.Vehicle(name="lost", uav=uav, arm=arm)
    found = robustness(vehicle, ["constant"], ["coupled"], ["longer"]).results
    (case,) = found["cases"]
    assert case["without"]["status"] != 0
    assert any(each["status"] == 0 for each in case["mistakes"]["longer"]["values"])
    table = as_table(found)
    assert "| lost: " in table and "| undecided |" in table
    said = " ".join(text.get_text() for text in figures.errors(found, "coupled").texts)
    assert "lost by constant" in table and "constant is lost" in said


@pytest.mark.long
def test_a_vehicle_that_its_rotors_do_not_lift_is_not_borne_and_saturation_is_told() -> None:
    """Refused, it would take the whole study with it."""
    weight = 9.81 * (NOMINAL.mass + 0.1)
    rotors = {
        "layout": "hex_tilted", "lever": 0.3, "tilt": 0.5, "torque_per_thrust": 0.02,
        "thrust_limits": [0.0, 1.3 * weight / 6.0 / np.cos(0.5)],
    }  # fmt: skip
    heavy = NOMINAL.replace({"uav.rotors": rotors})
    law = load_gains("current").controller(heavy)
    with pytest.warns(ca.ContinuairWarning, match="saturate"):
        lifted, grounded = fly(heavy, law, "coupled", [Wrong(None), Wrong("heavier", 80.0)])
    assert lifted["status"] == 0 and grounded["status"] == GROUNDED
    assert reason(grounded | {"way": ""}).startswith("the rotors")
    assert _worst([Wrong("heavier", 80.0)], {Wrong("heavier", 80.0): grounded})["status"] < 0
    assert set(lifted) == set(grounded)
    with pytest.warns(ca.ContinuairWarning, match="saturate"):
        told = robustness(heavy, ["current"], ["coupled"], ["heavier"]).results
    (case,) = told["cases"]
    assert case["mistakes"]["heavier"]["failed_at"] in (10.0, 20.0, 40.0)
    asked = [each["largest_saturation"] for each in case["mistakes"]["heavier"]["values"]]
    beyond = np.nanmax([case["without"]["largest_saturation"], *asked])
    assert beyond > 0.0 and f"{beyond:.1%} of their range" in as_table(told)


@pytest.mark.long
def test_of_the_noise_of_a_camera_no_single_draw_decides() -> None:
    noisy = NOMINAL.replace({"camera.noise": 0.4})
    law = load_gains("current").controller(noisy)
    (found,) = fly(noisy, law, "coupled", [Wrong(None)])
    start = task(noisy, [LETTER], law, SETTING.duration)
    own = []
    for seed in range(4):
        flight = ca.simulate(
            noisy,
            start.replace(seed=seed),
            sample=0.01,
            variables=["feature_error"],
            method="Tsit5",
        )
        late = flight.sel(time=slice(SETTING.settled, None))["feature_error"]
        own.append(float(np.sqrt((late**2).mean())))
    assert max(own) > min(own)
    assert found["rms_px"] == pytest.approx(max(own), rel=1e-6)
    assert noise_notes(noisy) and not noise_notes(NOMINAL)


def test_a_mistake_that_starts_out_of_view_is_named_and_does_not_count_as_lost() -> None:
    """From where letters start a lens so long does not see them; that tells nothing of the law."""
    lens = {"camera.focal_length": [1000.0, 1000.0], "camera.image_size": [640, 480]}
    narrow = NOMINAL.replace(lens | {"camera.principal_point": [320.0, 240.0]})
    law = load_gains("current").controller(narrow)
    with refused("mistakes"):
        fly(narrow, law, "coupled", [Wrong("focal length", 40.0)])
