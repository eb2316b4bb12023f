"""Vehicles of several arms and sections: their files, their names, and their changes."""

import json
import math
import pickle
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from continuair.errors import ContinuairWarning
from continuair.vehicle.arms import ArmChain, TipBody
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle, load_vehicle
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import refused

TOML = Path(__file__).with_name("three_sections.toml")
VEHICLE = load_vehicle(TOML)
PAPER = load_vehicle("paper")
SECTION = {"length": 1.0, "bending_stiffness": 1.0, "mass_per_length": 0.1}
# Derived quantities are a few products of floats; 5e-14 is some hundred roundings.
EXACT = 5e-14


def test_arms_and_sections_have_names_of_their_own_or_their_indices() -> None:
    assert VEHICLE.has_arm_list
    assert [arm.name for arm in VEHICLE.arms] == ["left", "1"]
    assert [[s.name for s in arm.section] for arm in VEHICLE.arms] == [["base", "tip"], ["0"]]
    assert VEHICLE.shape == (2, 1)
    assert VEHICLE.sections == 3
    assert VEHICLE.arms[0].attitude == (0.6, 0, 0, 0.8)
    assert VEHICLE.arms[1].tip is None


def test_the_single_arm_of_a_table_is_a_chain_of_one_section_at_the_mount() -> None:
    vehicle = PAPER.replace({"uav.mount": [0.1, 0.0, -0.2]})
    (arm,) = vehicle.arms
    assert (arm.name, arm.mount, arm.attitude) == ("arm", (0.1, 0, -0.2), (0, 0, 0, 1))
    assert (arm.tip, vehicle.shape, vehicle.sections) == (None, (1,), 1)
    assert arm.section[0].name == "0"
    assert {**dict(arm.section[0]), "name": ""} == dict(vehicle.arm)
    assert not vehicle.has_arm_list


def test_mass_is_that_of_uav_sections_disks_and_tips() -> None:
    rod = 6000.0 * math.pi * 0.001**2 * 0.3
    left = rod + 3 * 0.002 + 0.03 * 0.25 + 0.08
    right = 0.05 * 0.4 + 0.01
    assert VEHICLE.arms[0].mass == pytest.approx(left, rel=EXACT, abs=0)
    assert VEHICLE.arms[1].mass == pytest.approx(right, rel=EXACT, abs=0)
    assert VEHICLE.mass == pytest.approx(1.8 + left + right, rel=EXACT, abs=0)


def derived(section: Section) -> dict[str, float]:
    names = [name for name, value in vars(Section).items() if isinstance(value, property)]
    found = {name: getattr(section, name) for name in names if not name.startswith("model_")}
    return {name: each for name, each in found.items() if isinstance(each, (int, float))}


def test_stiffness_and_mass_per_length_stand_for_youngs_modulus_and_density() -> None:
    rod = PAPER.replace({"arm.damping_ratio": 0.1, "arm.disks": {"count": 2, "mass": 0.1}}).arm
    whole = {"bending_stiffness": rod.bending_stiffness, "mass_per_length": rod.mass_per_length}
    for name, other in (("youngs_modulus", "bending_stiffness"), ("density", "mass_per_length")):
        mixed = Section(**{**dict(rod), name: None, other: whole[other]})
        assert derived(mixed) == pytest.approx(derived(rod), rel=EXACT, abs=0)
    both = Section(**{**dict(rod), "youngs_modulus": None, "density": None, **whole})
    assert derived(both) == pytest.approx(derived(rod), rel=EXACT, abs=0)


def test_cross_sections_have_inertia_only_where_there_is_a_radius() -> None:
    thin = Section(length=0.5, bending_stiffness=0.02, mass_per_length=0.03)
    assert thin.transverse_inertia_per_length == thin.axial_inertia_per_length == 0
    textbook = math.sqrt(20 * 0.02 / (0.03 * 0.5**4))
    assert thin.clamped_frequency == pytest.approx(textbook, rel=EXACT, abs=0)
    thick = Section(length=0.5, radius=0.01, bending_stiffness=0.02, mass_per_length=0.03)
    # A solid cylinder: m r²/2 about its axis, half of it about a diameter.
    assert thick.axial_inertia_per_length == pytest.approx(0.03 * 0.01**2 / 2, rel=EXACT, abs=0)
    assert thick.transverse_inertia_per_length == thick.axial_inertia_per_length / 2


def test_a_radius_that_is_not_there_is_asked_for_where_it_is_needed() -> None:
    thin = Section(length=0.5, bending_stiffness=0.02, mass_per_length=0.03)
    for name in ("radius", "area", "density", "youngs_modulus"):
        with refused("radius"):
            getattr(thin, name)


def test_damping_ratio_of_a_section_is_that_of_its_own_clamped_mode() -> None:
    ratio = 0.07
    tip = VEHICLE.replace({"arm.left.section.tip.damping_ratio": ratio}).arms[0].section[1]
    # M k'' + d l k' + E I l k = 0 with a rod of no rotary inertia: M = m' l⁵/20.
    length, stiffness, mass = 0.25, 0.02, 0.03 * 0.25**5 / 20
    root = np.roots([mass, tip.structural_damping * length, stiffness * length])[0]
    assert -root.real / abs(root) == pytest.approx(ratio, rel=EXACT, abs=0)


def test_a_count_of_disks_puts_them_at_even_distances_up_to_the_end() -> None:
    disks = VEHICLE.arms[0].section[0].disks
    np.testing.assert_allclose([disk.position for disk in disks], [0.1, 0.2, 0.3], rtol=1e-15)
    assert disks[-1].position == 0.3
    assert {(disk.mass, disk.inertia) for disk in disks} == {(0.002, (1e-7, 2e-7))}
    single = PAPER.replace({"arm.disks": {"count": 2, "mass": 0.1}})
    assert [disk.position for disk in single.arm.disks] == [0.5, 1.0]


def test_disks_keep_their_share_of_a_section_that_is_renamed_and_lengthened_at_once() -> None:
    changed = VEHICLE.replace({"arm.left.name": "port", "arm.left.section.base.length": 0.6})
    assert changed.arms[0].name == "port"
    disks = changed.arms[0].section[0].disks
    np.testing.assert_allclose([disk.position for disk in disks], [0.2, 0.4, 0.6], rtol=1e-15)
    with refused("arm.port"):
        VEHICLE.replace({"arm.left.name": "port", "arm.port.section.base.length": 0.6})


def test_counted_disks_of_a_batch_are_at_even_distances_in_every_run() -> None:
    changes = {"arm.length": [1.0, 0.5], "arm.disks": {"count": 2, "mass": np.array([0.1, 0.1])}}
    batch = PAPER.replace(changes)
    np.testing.assert_array_equal(batch.arm.disks[0].position, [0.5, 0.25])
    np.testing.assert_array_equal(batch.arm.disks[1].mass, [0.1, 0.1])
    with refused("arm.disks"):
        PAPER.replace({"arm.disks": {"count": np.array([2, 3]), "mass": 0.1}})


def test_written_described_and_pickled_vehicles_are_what_they_were() -> None:
    for vehicle in (VEHICLE, VEHICLE.replace({"camera.arm": "", "arm.left.tip": {"mass": 0.1}})):
        assert Vehicle(**tomllib.loads(as_toml(vehicle, ["a comment"]))) == vehicle
        assert Vehicle(**json.loads(json.dumps(vehicle.describe()))) == vehicle
        again = pickle.loads(pickle.dumps(vehicle))
        assert again == vehicle
        assert hash(again) == hash(vehicle)
    stiff = PAPER.replace({"arm.bending_stiffness": 90.0})
    assert Vehicle(**tomllib.loads(as_toml(stiff))) == stiff


def test_parts_built_in_python_are_those_of_a_file() -> None:
    arms = [
        ArmChain(
            name="left",
            mount=np.array([0.0, 0.1, -0.05]),
            attitude=(0.6, 0, 0, 0.8),
            section=[Section(**dict(section)) for section in VEHICLE.arms[0].section],
            tip=TipBody(mass=0.08, centre=(0, 0, 0.02), inertia=np.diag([2e-5, 2e-5, 1e-5])),
        ),
        ArmChain(section=[Section(**{**dict(VEHICLE.arms[1].section[0]), "name": ""})]),
    ]
    built = Vehicle(name="three sections", uav=VEHICLE.uav, arm=arms, camera=VEHICLE.camera)
    assert built == VEHICLE


def test_fields_are_replaced_by_names_and_by_indices() -> None:
    by_name = VEHICLE.replace(
        {
            "arm.left.section.base.radius": 0.0015,
            "arm.left.tip.mass": 0.1,
            "arm.left.section.base.disks.2.mass": 0.5,
            "arm.1.mount": [0.0, -0.1, 0.0],
        }
    )
    by_index = VEHICLE.replace(
        {
            "arm.0.section.0.radius": 0.0015,
            "arm.0.tip.mass": 0.1,
            "arm.0.section.0.disks.2.mass": 0.5,
            "arm.1.mount.1": -0.1,
        }
    )
    assert by_name == by_index
    assert by_name.arms[0].section[0].radius == 0.0015
    assert by_name.arms[1].mount == (0, -0.1, 0)
    renamed = VEHICLE.replace({"arm.1.name": "right", "arm.1.section": [{**SECTION, "name": "b"}]})
    assert renamed.replace({"arm.right.section.b.length": 2.0}).arms[1].section[0].length == 2.0


def test_run_of_a_batch_equals_the_vehicle_with_that_runs_values() -> None:
    changes: dict[str, Any] = {
        "arm.left.section.base.length": np.array([0.2, 0.3, 0.4]),
        "arm.1.section.0.bending_stiffness": [0.1, 0.2, 0.3],
        "arm.left.tip.inertia": np.array([0.0, 1e-5, 2e-5])[:, None, None] * np.eye(3),
        "arm.left.tip.mass": [0.1, 0.0, 0.2],
        "arm.1.attitude": [[0, 0, 0, 1], [0.6, 0, 0, 0.8], [0, 0.6, 0, 0.8]],
        "arm.left.section.base.disks.1.mass": [0.1, 0.2, 0.3],
    }
    batch = VEHICLE.replace(changes)
    assert batch.runs == 3
    for run in range(3):
        single = VEHICLE.replace({path: values[run] for path, values in changes.items()})
        assert batch.select(run) == single
        np.testing.assert_allclose(batch.mass[run], single.mass, rtol=EXACT)  # type: ignore[index]
    assert Vehicle(**json.loads(json.dumps(batch.select(1).describe()))) == batch.select(1)


def test_disks_keep_their_share_of_a_section_whose_length_changes() -> None:
    shorter = VEHICLE.replace({"arm.left.section.base.length": 0.15})
    disks = shorter.arms[0].section[0].disks
    np.testing.assert_allclose([d.position for d in disks], [0.05, 0.1, 0.15], rtol=1e-15)
    assert disks[-1].position == 0.15
    lengths = np.array([0.2, 0.9])
    batch = VEHICLE.replace({"arm.0.section.0.length": lengths, "arm.1.section.0.length": 0.8})
    np.testing.assert_array_equal(batch.arms[0].section[0].disks[2].position, lengths)
    assert batch.arms[1].section[0].disks[0].position == 0.8
    given = {"arm.left.section.base.length": 0.6, "arm.left.section.base.disks.0.position": 0.01}
    assert VEHICLE.replace(given).arms[0].section[0].disks[0].position == 0.01
    new = {"arm.left.section.base.length": 0.6, "arm.left.section.base.disks": []}
    assert VEHICLE.replace(new).arms[0].section[0].disks == ()


def test_one_of_a_pair_takes_the_others_place() -> None:
    soft = PAPER.replace({"arm.bending_stiffness": [1.0, 2.0], "arm.mass_per_length": 0.5})
    np.testing.assert_array_equal(soft.arm.bending_stiffness, [1.0, 2.0])
    assert soft.arm.given_youngs_modulus is None
    assert soft.arm.mass == 0.5
    again = soft.replace({"arm.youngs_modulus": 207e9, "arm.density": 7850.0})
    assert again == PAPER


def test_an_arm_and_a_list_of_arms_can_be_replaced_by_each_other() -> None:
    listed = PAPER.replace({"arm": [{"section": [dict(PAPER.arm)]}]})
    assert listed.arms[0].section[0].mass == PAPER.arm.mass
    assert listed.replace({"arm": dict(PAPER.arm)}) == PAPER


def test_the_camera_is_on_the_arm_that_it_names() -> None:
    for name, index in (("", 0), ("left", 0), ("0", 0), ("1", 1)):
        assert VEHICLE.replace({"camera.arm": name}).camera_arm == index
    for name in ("", "arm", "0"):
        assert PAPER.replace({"camera.arm": name}).camera_arm == 0


def test_a_tip_may_be_a_point_and_warns_of_moments_that_are_slightly_off() -> None:
    assert TipBody(mass=0.1).inertia == ((0, 0, 0),) * 3
    with pytest.warns(ContinuairWarning, match="inertia of a tip"):
        TipBody(mass=0.1, inertia=(1e-5, 1e-5, 2.09e-5))


def test_batched_arms_are_refused_by_the_constructor() -> None:
    batch = VEHICLE.replace({"arm.left.tip.mass": [1.0, 2.0]})
    with refused("arm"):
        Vehicle(name="x", uav=batch.uav, arm=list(batch.arms))


def test_presets_of_several_sections_and_arms_are_mirrored_and_slender_as_they_say() -> None:
    two, dual = load_vehicle("two_section"), load_vehicle("dual_arm")
    assert (two.shape, dual.shape) == ((2,), (1, 1))
    assert [section.name for section in two.arms[0].section] == ["base", "tip"]
    assert dual.arms[dual.camera_arm].name == "right"
    # The straight arms, -z of their axes, lean outwards, by 20 degrees.
    for arm, side in zip(dual.arms, (1, -1), strict=True):
        along = Rotation.from_quat(arm.attitude).apply([0, 0, -1])
        np.testing.assert_allclose(
            along, [0, side * math.sin(math.pi / 9), -math.cos(math.pi / 9)], atol=1e-5
        )
