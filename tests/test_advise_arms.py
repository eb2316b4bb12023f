"""Advice on vehicles with [[arm]]: the arm that is excited, its scales, and what the text says."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from amiri2026.robustness.study import robustness
from continuair.analysis.excited import excited_arm
from continuair.analysis.groups import place
from continuair.figures import advise as figures
from continuair.scenario.tracking_task import SETTINGS, equipped, task
from continuair.studies.advise import study as advise
from continuair.studies.advise.excitations import excite
from continuair.studies.advise.report import as_table
from continuair.studies.standard_excitations import EXCITATIONS, sample_time, standard_scenario
from tests.refusals import refused

PAPER, TWO, DUAL = (ca.load_vehicle(name) for name in ("paper", "two_section", "dual_arm"))


def as_list(vehicle: ca.Vehicle) -> ca.Vehicle:
    """The same vehicle, its [arm] written as [[arm]]."""
    section = {name: value for name, value in vehicle.arm if name != "name"}
    arm = {"name": "only", "mount": vehicle.uav.mount, "section": [section]}
    uav = vehicle.uav.having(mount=(0.0, 0.0, 0.0))
    return ca.Vehicle(name=vehicle.name, uav=uav, arm=[arm], camera=vehicle.camera)


MOUNTED = PAPER.replace({"uav.mount": [0.02, 0.01, -0.05], "arm.damping_ratio": 0.03})
TWIN = as_list(MOUNTED)


@pytest.mark.parametrize("name", ["force", "moment", "tip"])
def test_what_excites_an_arm_turns_with_it(name: str) -> None:
    """One arm that sticks out level, in axes of the body that are called otherwise."""
    section = {"length": 0.4, "bending_stiffness": 0.4, "mass_per_length": 0.08}
    uav = {"mass": 1.5, "inertia": [0.02, 0.02, 0.03]}
    quarter = Rotation.from_euler("z", 90, degrees=True)
    ahead = Rotation.from_euler("y", -90, degrees=True)
    scenarios = []
    for turn in (ahead, quarter * ahead):
        arm = {"attitude": turn.as_quat(), "section": [section], "tip": {"mass": 0.1}}
        level = ca.Vehicle(name="level", uav=uav, arm=[arm])
        scenarios.append(standard_scenario(name, level))
    channel = "tip_wrench" if name == "tip" else name
    one, turned = (np.asarray(getattr(each, channel)(0.05))[:3] for each in scenarios)
    np.testing.assert_allclose(turned, quarter.apply(one), rtol=0, atol=1e-9 * abs(one).max())
    along = ahead.apply([0.0, 0.0, -1.0])
    still = np.asarray(getattr(scenarios[0], channel)(0.0))[:3]
    assert abs((one - still) @ along) < 1e-9 * abs(one - still).max()


@pytest.mark.parametrize("name", EXCITATIONS)
def test_one_section_of_a_list_is_excited_as_that_of_a_table(name: str) -> None:
    one, twin = (standard_scenario(name, vehicle) for vehicle in (MOUNTED, TWIN))
    assert twin.duration == pytest.approx(one.duration, rel=1e-6)
    np.testing.assert_allclose(np.asarray(twin.q), np.asarray(one.q), rtol=1e-12)
    for field in ("force", "moment", "bend_moment", "tip_wrench"):
        own, others = (getattr(scenario, field) for scenario in (one, twin))
        assert (own is None) == (others is None)
        if own is not None:
            at = [each(0.03) if callable(each) else each for each in (own, others)]
            np.testing.assert_allclose(at[1], at[0], rtol=1e-6, atol=1e-9)


def test_one_section_of_a_list_has_the_place_and_the_errors_of_a_table() -> None:
    groups, others = place(MOUNTED), place(TWIN)
    for name in others:
        assert others[name] == pytest.approx(groups[name], rel=1e-6)
    found, twin = (excite(vehicle, "moment", 0.02)["models"] for vehicle in (MOUNTED, TWIN))
    for model, entry in found.items():
        assert twin[model]["error"] == pytest.approx(entry["error"], rel=1e-4)
        assert twin[model]["limit_hz"] == pytest.approx(entry["limit_hz"], rel=1e-4)


@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_the_excited_arm_is_the_cameras_at_its_lowest_clamped_mode(vehicle: ca.Vehicle) -> None:
    lightly = {
        f"arm.{arm.name}.section.{section.name}.damping": 1e-4 * section.structural_damping
        for arm in vehicle.arms
        for section in arm.section
    }
    # The frequency is that of the undamped arm, which its damping changes to second order.
    found = ca.modes(vehicle.replace(lightly), base="clamped", gravity=0.0)
    arm = excited_arm(vehicle)
    assert arm.index == vehicle.camera_arm
    # Of the two arms of dual_arm the right one carries the camera and a tool, and is slower.
    assert arm.frequency == pytest.approx(found.frequencies[0], rel=1e-6)
    assert arm.damping_ratio == pytest.approx(1e4 * found.damping[0], rel=1e-6)
    assert sample_time(vehicle) == pytest.approx(2.0 * np.pi / found.frequencies[0] / 40, rel=1e-6)


@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_loads_on_tip_and_bends_turn_the_arms_end_by_the_angle_they_are_named_by(
    vehicle: ca.Vehicle,
) -> None:
    arm, load = excited_arm(vehicle), 1e-3
    sections = [section for each in vehicle.arms for section in each.section]
    peak = 0.25 * 2.0 * np.pi / (0.5 * float(arm.frequency))
    bend = standard_scenario("bend", vehicle, load, bend=0.0, gravity=0.0).bend_moment
    tip = standard_scenario("tip", vehicle, load, bend=0.0, gravity=0.0).tip_wrench
    assert callable(bend) and callable(tip)
    along = np.asarray(bend(peak))[::2]
    curvatures = along / [each.bending_stiffness * each.length for each in sections]
    of_arm = curvatures[list(arm.places)]
    np.testing.assert_allclose(of_arm, load / arm.length, rtol=1e-6)
    assert np.count_nonzero(curvatures) == len(of_arm)
    # A world force along x lies across both arms of dual_arm, too.
    held = ca.trim(vehicle, tip_wrench=tip(peak), gravity=0.0).q
    angle = sum(held[6 + 2 * k] * sections[k].length for k in arm.places)
    assert angle == pytest.approx(load, rel=1e-4)


@pytest.mark.long
def test_a_letter_starts_with_the_camera_above_it_whichever_way_its_arm_leans() -> None:
    vehicle = equipped(DUAL, SETTINGS["nominal"])
    law = ca.servoing(**ca.design(vehicle, 6.0))
    scenario = task(vehicle, ["L"], law, 50.0)
    run = ca.simulate(vehicle, scenario, duration=8.0, sample=0.02)
    assert float(run["in_view"].min()) == 1.0
    assert np.abs(run["feature_error"][0, -1]).max() < 1.0


@pytest.fixture(scope="module")
def contact() -> dict[str, Any]:
    return advise.advise(TWO, ["contact"], advise.Tolerance(tip=0.1))


@pytest.mark.slow
def test_advice_names_what_was_varied_and_that_the_atlas_is_of_other_vehicles(
    contact: dict[str, Any], tmp_path: Path
) -> None:
    text = as_table(contact)
    assert "sections base, tip" in text and "outside of both" in text
    assert "(55 mm)" in text  # a tenth of the arm of 0.3 m and 0.25 m
    assert contact["excitations"]["tip"]["responsible"]
    drawn: list[str] = []

    def file(name: str) -> Path:
        drawn.append(name)
        return tmp_path / name

    figures.write(contact, None, file)  # type: ignore[arg-type]
    assert {Path(name).stem for name in drawn} == {"advise"}


def test_studies_of_the_paper_refuse_several_sections_in_a_sentence() -> None:
    with refused("vehicle"):
        robustness(TWO)
