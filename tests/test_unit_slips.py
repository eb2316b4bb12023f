"""A value in another unit is named first, and not what follows from it."""

from __future__ import annotations

from typing import Any

import pytest

import continuair as ca
from continuair.analysis.plausible import doubts
from continuair.vehicle.slips import slips
from tests.refusals import numbers_of, refused

ROTORS = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 12.0],
          "torque_per_thrust": 0.016}  # fmt: skip
TWO = "arm.arm.section."


def quad() -> ca.Vehicle:
    return ca.load_vehicle("slender").replace({"uav.rotors": ROTORS})


@pytest.mark.parametrize(
    ("field", "value", "meant"),
    [
        ("uav.mass", 2200.0, "2.2"),
        ("uav.mass", 250.0, "0.25"),
        ("arm.length", 1210.0, "1.21"),
        ("arm.length", 95.0, "0.95"),
    ],
)
def test_the_slip_is_named_with_what_was_meant_where_rotors_would_be_blamed(
    field: str, value: float, meant: str
) -> None:
    with refused(field) as error:
        quad().replace({field: value})
    assert float(meant) in numbers_of(str(error.value))
    with refused(field, place="run 1"):
        quad().replace({field: [dict(quad().uav)["mass"] if "mass" in field else 1.0, value]})


def test_a_radius_in_millimetres_is_named_where_it_is_thicker_than_long() -> None:
    with refused("arm.radius"):
        ca.load_vehicle("paper").replace({"arm.radius": 5.0})


def test_rotors_are_blamed_where_nothing_is_in_another_unit() -> None:
    with refused("uav.rotors.thrust_limits"):
        quad().replace({"uav.mass": 6.0})


@pytest.mark.parametrize(
    ("changes", "field", "meant"),
    [
        ({"uav.mass": 2200.0}, "uav.mass", "2.2"),
        ({"arm.length": 210.0}, "arm.length", "0.21"),
        ({"arm.length": 1000.0, "arm.radius": 5.0}, "arm.length", "1"),
        ({"arm.length": 1.0, "arm.radius": 0.2}, "arm.radius", ""),
        ({"arm.density": 7.85}, "arm.density", "7850"),
        ({"arm.youngs_modulus": 207.0}, "arm.youngs_modulus", "2.07e+11"),
    ],
)
def test_a_vehicle_that_is_checked_is_told_of_its_slip_before_all_else(
    changes: dict[str, Any], field: str, meant: str
) -> None:
    first = doubts(ca.load_vehicle("paper").replace(changes))[0]
    assert first.startswith(f"{field} is") and meant in first


def test_sections_of_lists_are_named_by_their_paths() -> None:
    vehicle = ca.load_vehicle("two_section")
    arm = vehicle.arms[0]
    path = f"arm.{arm.name}.section.{arm.section[1].name}"
    assert doubts(vehicle.replace({f"{path}.length": 300.0}))[0].startswith(f"{path}.length is")


@pytest.mark.parametrize("name", [name for name in ca.preset_names()])
def test_presets_have_no_slips(name: str) -> None:
    assert slips(ca.load_vehicle(name)) == []
