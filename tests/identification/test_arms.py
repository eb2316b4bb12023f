"""Fits of vehicles with several sections and arms recover what made their flights."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.identification import Fit, fit, load_recording
from continuair.identification.fields import fitted_fields
from tests.identification.flights import SAMPLE, write
from tests.identification.test_fitting import run
from tests.refusals import assert_refused, refused
from tests.sections.strains import flying, rod
from tests.test_arms import TOML

pytestmark = pytest.mark.targets

POSE = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
PUSHES = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")


@pytest.fixture(autouse=True)
def own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def headings(sections: int) -> tuple[str, ...]:
    """Columns of a recording of two sections or more."""
    bends, moments = (
        [f"{name}_{axis}_{k}" for k in range(1, sections + 1) for axis in "xy"]
        for name in ("bend", "bend_moment")
    )
    return (*POSE, *bends, *PUSHES, *moments)


def record(vehicle: ca.Vehicle, seed: int | None = None, duration: float = 1.0) -> None:
    """Write flight.csv: pushed from side to side about its weight, every section on its own."""
    time = SAMPLE * np.arange(round(duration / SAMPLE) + 1)
    sections = [section for arm in vehicle.arms for section in arm.section]
    rows = np.zeros((len(time), 6 + 2 * len(sections)))
    rows[:, 2] = 9.81 * vehicle.mass
    rows[:, :2] = np.sin(np.outer(time, [11.0, 7.0])) * [8.0, 5.0]
    rows[:, 3:6] = 0.1 * np.sin(np.outer(time, [9.0, 8.0, 6.0]))
    for k, section in enumerate(sections):
        rows[:, 6 + 2 * k : 8 + 2 * k] = section.bending_stiffness * np.cos(
            np.outer(time, [13.0 + 4.0 * k, 15.0 + 5.0 * k])
        )

    def held(t: float) -> np.ndarray:
        return rows[int(np.searchsorted(time, t, side="right")) - 1]

    scenario = ca.Scenario(
        "held",
        [0.3, -0.2, 5.0, 0.05, -0.04, 0.2, *[0.4, 0.5] * len(sections)],
        [0.2, 0.1, -0.1, 0.3, 0.2, -0.1, *[0.5, 0.3] * len(sections)],
        force=lambda t: held(t)[:3],
        moment=lambda t: held(t)[3:6],
        bend_moment=lambda t: held(t)[6:],
        jumps=tuple(time[1:-1]),
        duration=duration,
    )
    found = ca.simulate(vehicle, scenario, sample=SAMPLE, method="RK4", step=5e-4)
    write(Path("flight.csv"), found, rows, headings(len(sections)), seed)


def fitted(name: str, wrong: dict[str, float], fields: Any = None, seed: int | None = None) -> Fit:
    vehicle = ca.load_vehicle(name)
    record(vehicle, seed)
    recording = load_recording("flight.csv", vehicle)
    return fit(vehicle.replace(wrong), recording, list(wrong) if fields is None else fields)


TWO_SECTION = {
    "arm.arm.section.base.youngs_modulus": 75e9,
    "arm.arm.section.tip.youngs_modulus": 40e9,
    "arm.arm.section.base.damping_ratio": 0.08,
    "arm.arm.tip.mass": 0.1,
    "uav.mass": 2.2,
}
TRUE_TWO_SECTION = np.array([54e9, 54e9, 0.05, 0.08, 1.8])


@pytest.mark.long
def test_a_flight_of_two_sections_gives_back_each_sections_stiffness_and_the_gripper() -> None:
    found = fitted("two_section", TWO_SECTION)
    assert found.converged and found.doubts == ()
    np.testing.assert_allclose(found.values, TRUE_TWO_SECTION, rtol=1e-5)
    assert found.vehicle.arms[0].section[1].youngs_modulus == pytest.approx(54e9, rel=1e-5)


@pytest.mark.parametrize("name", ["mount", "centre"])
def test_names_of_arms_and_sections_are_no_places(name: str) -> None:
    """A modulus is fitted as a factor, a coordinate by its metres."""
    vehicle = ca.load_vehicle("two_section").replace({"arm.arm.section.tip.name": name})
    vehicle = vehicle.replace({"arm.arm.name": name, "camera.arm": name})
    fields = [f"arm.{name}.section.{name}.youngs_modulus", f"arm.{name}.mount.2", "uav.mass"]
    assert fitted_fields(vehicle, fields).linear.tolist() == [False, True, False]


@pytest.mark.long
def test_a_noisy_flight_of_two_sections_is_fitted_within_its_standard_errors() -> None:
    found = fitted("two_section", TWO_SECTION, seed=2)
    off = (found.values - TRUE_TWO_SECTION) / found.errors
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(off**2)) < 2.0
    # The mass of the gripper is known to a few percent, that of the UAV to better than one.
    assert (found.errors / TRUE_TWO_SECTION)[3:].max() < 0.05


@pytest.mark.long
def test_two_arms_of_one_file_are_told_apart_by_name_or_index() -> None:
    wrong = {
        "arm.left.section.0.youngs_modulus": 3.2e9,
        "arm.right.section.0.youngs_modulus": 2.0e9,
        "arm.right.section.0.disks.0.mass": 0.07,
        "arm.left.mount.1": 0.15,
    }
    asked = ["arm.0.section.0.youngs_modulus", "arm.1.section.0.youngs_modulus", *list(wrong)[2:]]
    found = fitted("dual_arm", wrong, asked)
    assert found.fields == tuple(wrong)
    np.testing.assert_allclose(found.values, [2.5e9, 2.5e9, 0.05, 0.16], rtol=1e-5)


STRAINED = flying(rod(bending=1, nodes=5, damping_ratio=0.03, name="rod"), name="arm")


def record_strained(duration: float = 0.6) -> ca.Vehicle:
    """Write flight.csv as `to_csv` does, of STRAINED pushed about its weight; return that."""
    time = SAMPLE * np.arange(round(duration / SAMPLE) + 1)
    rows = np.zeros((len(time), 10))
    rows[:, 2] = 9.81 * STRAINED.mass
    rows[:, :2] = np.sin(np.outer(time, [11.0, 7.0])) * [2.0, 1.5]
    rows[:, 6:] = 0.01 * np.cos(np.outer(time, [13.0, 17.0, 15.0, 20.0]))

    def held(t: float) -> np.ndarray:
        return rows[int(np.searchsorted(time, t, side="right")) - 1]

    scenario = ca.Scenario(
        "held", [0.3, -0.2, 5.0, 0.05, -0.04, 0.2, 0.4, 0.3, -0.2, 0.1],
        force=lambda t: held(t)[:3], bend_moment=lambda t: held(t)[6:],
        jumps=tuple(time[1:-1]), duration=duration,
    )  # fmt: skip
    found = ca.simulate(STRAINED, scenario, sample=SAMPLE, method="RK4", step=2e-4)
    ca.to_csv(found, "flight.csv", scenario=scenario)
    return STRAINED


@pytest.mark.filterwarnings("ignore:flight.csv. ignores")
def test_a_flight_of_a_strained_section_gives_back_its_stiffness_and_damping() -> None:
    vehicle = record_strained()
    wrong = {
        "arm.arm.section.rod.youngs_modulus": 7e7,
        "arm.arm.section.rod.damping_ratio": 0.06,
    }
    recording = load_recording("flight.csv", vehicle)
    assert recording.bend.shape[1] == 4 and recording.inputs is not None
    found = fit(vehicle.replace(wrong), recording, None)
    assert found.fields == tuple(wrong)
    assert found.converged and found.doubts == ()
    np.testing.assert_allclose(found.values, [5e7, 0.03], rtol=1e-4)


@pytest.mark.filterwarnings("ignore:flight.csv. ignores")
def test_strains_beyond_a_full_circle_are_refused() -> None:
    """By the sums of the coefficients along each axis, as the flights judge them."""
    recording = load_recording("flight.csv", record_strained(0.1))
    bend = recording.bend.copy()
    bend[3] = [7.0, 6.0, 0.0, 0.0]
    with refused("bend"):
        fit(STRAINED, dataclasses.replace(recording, bend=bend), None)


def test_by_default_stiffness_and_damping_of_every_section_are_fitted() -> None:
    # Flights of this vehicle take a minute to compile.
    assert fitted_fields(ca.load_vehicle(TOML), None).names == (
        "arm.left.section.base.youngs_modulus",
        "arm.left.section.base.damping_ratio",
        "arm.left.section.tip.bending_stiffness",
        "arm.1.section.0.bending_stiffness",
    )


def test_a_recording_of_other_sections_is_refused_in_one_sentence() -> None:
    record(ca.load_vehicle("two_section"), duration=0.1)
    data = ("--data", "flight.csv", "--vehicle")
    assert_refused(run(*data, str(TOML)), "bend_x_3", place="flight.csv")
    assert_refused(run(*data, "paper"), "bend_x", place="flight.csv")
    recording = load_recording("flight.csv", ca.load_vehicle("two_section"))
    with refused("recording"):
        fit(ca.load_vehicle(TOML), recording)


@pytest.mark.parametrize(
    ("option", "given", "fact"),
    [
        ("fit", "arm.youngs_modulus", "arm.youngs_modulus"),
        ("fit", "arm.arm.section.2.length", "arm.arm.section.2.length"),
        ("fit", "arm.0.section.tip.length,arm.arm.section.1.length", "arm.arm.section.tip.length"),
        ("test", "C", "'C'"),
    ],
)
def test_unusable_options_are_refused_in_one_sentence(option: str, given: str, fact: str) -> None:
    record(ca.load_vehicle("two_section"), duration=0.1)
    result = run("--data", "flight.csv", "--vehicle", "two_section", f"--{option}", given)
    assert_refused(result, option, fact)
