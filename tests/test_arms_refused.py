"""What a user reads when a vehicle of several arms and sections cannot be used."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from continuair.errors import InputError
from continuair.vehicle.vehicle import Vehicle, load_vehicle
from tests.refusals import refused

TOML = Path(__file__).with_name("three_sections.toml")
TEXT = TOML.read_text(encoding="utf-8")
VEHICLE = load_vehicle(TOML)
PAPER = load_vehicle("paper")
SECTION = {"length": 1.0, "bending_stiffness": 1.0, "mass_per_length": 0.1}


def test_the_single_arm_is_refused_where_there_is_a_list() -> None:
    with refused("vehicle"):
        _ = VEHICLE.arm


UNUSABLE: list[tuple[dict[str, Any], str]] = [
    ({"arm.left.section.tip.length": -1}, "arm.left.section.tip.length"),
    ({"arm.0.section.1.length": [1, -1]}, "arm.left.section.tip.length"),
    ({"arm.lefd.mount": 0}, "arm.lefd"),
    ({"arm.2.mount": 0}, "arm.2"),
    ({"arm.1.section.1.length": 1}, "arm.1.section.1"),
    ({"arm.left.section.tp.length": 1}, "arm.left.section.tp"),
    ({"arm.left.section.tip.lenght": 1}, "arm.left.section.tip.lenght"),
    ({"arm.1.tip.mass": 1}, "arm.1.tip.mass"),
    ({"arm.left.tip.mass": -1}, "arm.left.tip.mass"),
    ({"arm.left.tip.inertia": [1, 1, -1]}, "arm.left.tip.inertia"),
    ({"arm.left.tip.inertia": [1, 1, 3]}, "arm.left.tip.inertia"),
    ({"arm.left.attitude": [0, 0, 0, 2]}, "arm.left.attitude"),
    ({"arm.left.section": []}, "arm.left.section"),
    ({"arm.left.section": [SECTION] * 9}, "arm.left.section"),
    ({"arm.left.section": 3}, "arm.left.section"),
    ({"arm.left.section": [3]}, "arm.left.section.0"),
    ({"arm": [{"section": [SECTION]}] * 9}, "arm"),
    ({"arm": [{}]}, "arm.0.section"),
    ({"arm": [3]}, "arm.0"),
    ({"arm.1.name": "left"}, "arm.1.name"),
    ({"arm.left.section.1.name": "base"}, "arm.left.section.1.name"),
    ({"arm.1.name": "0"}, "arm.1.name"),
    ({"arm.1.name": "7"}, "arm.1.name"),
    ({"arm.1.name": "a.b"}, "arm.1.name"),
    ({"arm.1.name": "a b"}, "arm.1.name"),
    ({"arm.1.name": 3}, "arm.1.name"),
    ({"camera.arm": "right"}, "camera.arm"),
    ({"camera.arm": 1}, "camera.arm"),
    ({"uav.mount": [0, 0, 1]}, "uav.mount"),
    ({"uav.mount.2": [0.0, 1.0]}, "uav.mount"),
    ({"arm.1.section.0.radius": None, "arm.1.section.0.density": 1.0}, "arm.1.section.0.radius"),
    ({"arm.left.section.0.disks": {"count": 0, "mass": 1}}, "arm.left.section.base.disks.count"),
    ({"arm.left.section.0.disks": {"count": 2000, "mass": 1}}, "arm.left.section.base.disks.count"),
    ({"arm.left.section.0.disks": {"count": 2, "mas": 1}}, "arm.left.section.base.disks.mas"),
    ({"arm.left.section.base.disks.0.position": 0.5}, "arm.left.section.base.disks.0.position"),
    ({"arm.left.section.tip.bending_stiffness": 1e308, "arm.left.section.tip.mass_per_length":
      1e-300}, "arm.left.section.tip.length"),
    ({"arm.left.section.tip.length": 0.3, "arm.0.section.1.length": 0.2},
     "arm.0.section.1.length"),
    ({"arm.left.tip.mass": 0.1, "arm.left.tip": {"mass": 0.2}},
     "arm.left.tip"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field"), UNUSABLE, ids=lambda value: str(value)[:50])
def test_unusable_value_is_refused_in_one_sentence_with_field_value_and_remedy(
    changes: dict[str, Any], field: str
) -> None:
    with refused(field):
        VEHICLE.replace(changes)


PAIRS = [
    ({"bending_stiffness": 2.0, "youngs_modulus": 3.0}, "arm.bending_stiffness"),
    ({"mass_per_length": 2.0, "density": 3.0}, "arm.mass_per_length"),
    ({"youngs_modulus": None}, "arm.youngs_modulus"),
    ({"density": None}, "arm.density"),
    ({"radius": None}, "arm.radius"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field"), PAIRS)
def test_a_section_has_one_of_each_pair(changes: dict[str, Any], field: str) -> None:
    with refused(field):
        PAPER.replace({f"arm.{name}": value for name, value in changes.items()})


FILES: list[tuple[Callable[[str], str], str]] = [
    (lambda text: text.replace("[[arm]]", "[uav.rotors]\nlevr = 0.2\n[[arm]]", 1),
     "uav.rotors.levr"),
    (lambda text: text.replace("[[arm]]", "[uav.drag]\nlinear = [1, 1]\n[[arm]]", 1),
     "uav.drag.linear"),
    (lambda text: text.replace("[arm.tip]", "[[arm.tendons]]\nradius = 1\n[arm.tip]"),
     "arm.left.tendons"),
    (lambda text: text.replace("radius = 0.001", "radius = 0.001\npoisson_ratio = 0.3"),
     "arm.left.section.base.poisson_ratio"),
    (lambda text: text.replace("radius = 0.001", "radus = 0.001"),
     "arm.left.section.base.radus"),
    (lambda text: text.replace('name = "left"', "length = 1.0"),
     "arm.0.length"),
    (lambda text: text.replace("[[arm]]", "[arm]\nradius = 1\n[[arm]]", 1),
     "file"),
    (lambda text: text + "[arm]\nradius = 1\n", "file"),
    (lambda text: text[: text.index("[[arm.section]]")], "arm.left.section"),
    (lambda text: text[: text.index("[[arm]]")] + "[arm]\n[[arm.section]]\nlength = 1.0\n",
     "arm.section"),
    (lambda text: text[: text.index("[[arm]]")] + "[arm]\nname = 'left'\nlength = 1.0\n"
     "bending_stiffness = 1.0\nmass_per_length = 1.0\n",
     "arm.name"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "field"), FILES)
def test_a_file_that_cannot_be_used_is_refused_by_its_name_and_field(
    tmp_path: Path, change: Callable[[str], str], field: str
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(change(TEXT), encoding="utf-8")
    with refused(field, place=path):
        load_vehicle(path)


def test_problems_of_several_sections_are_told_one_per_line() -> None:
    text = TEXT.replace("length = 0.3", "length = -0.3").replace("length = 0.4", "length = 0")
    with pytest.raises(InputError) as caught:
        Vehicle(**tomllib.loads(text))
    fields = [each.field for each in caught.value.errors]
    assert fields == ["arm.left.section.base.length", "arm.1.section.0.length"]
