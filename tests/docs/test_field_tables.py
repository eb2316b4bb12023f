"""Tables of docs/reference/ hold every field of a vehicle file and of a scenario."""

import ast
import dataclasses
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpydoc.docscrape import NumpyDocString

import continuair as ca
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.camera import Camera
from continuair.vehicle.disk import Disk
from continuair.vehicle.fields import Part, kinds
from continuair.vehicle.rotors import Drag, Rotor, Rotors
from continuair.vehicle.section import Section
from continuair.vehicle.strain import Strain
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.uav import Uav

REFERENCE = Path(__file__).parents[2] / "docs" / "reference"
PAGES = [REFERENCE / "vehicle_file.md", REFERENCE / "scenario.md"]
HEAD = "| field | unit | default | meaning |\n"
TIP = next(kind for kind in kinds(ArmChain, "tip") if kind)
VEHICLE: list[dict[type[Part], str]] = [
    {ca.Vehicle: "{}", Uav: "uav.{}", Camera: "camera.{}"},
    {Section: "{}", Disk: "{} of a disk", Strain: "{} of a strain"},
    {ArmChain: "arm.{}", TIP: "arm.tip.{}"},
    {Tendon: "{}"},
    {Rotors: "uav.rotors.{}", Rotor: "{} of a rotor", Drag: "uav.drag.{}"},
]
"""The tables in turn: the parts whose fields they hold, and how those are written."""

REQUIRED = object()
Field = tuple[str, Any, str]


def tables() -> list[dict[str, tuple[str, str]]]:
    """Every table of fields of the pages: name -> unit and default."""
    found = []
    text_of_pages = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    for text in text_of_pages.split(HEAD)[1:]:
        rows: dict[str, tuple[str, str]] = {}
        for line in text.split("\n\n")[0].splitlines()[1:]:
            first, unit, default, _ = (cell.strip() for cell in line.strip("|").split("|", 3))
            of = re.sub(r"`[^`]+`[, ]*", "", first)
            for name in re.findall(r"`([^`]+)`", first):
                rows[f"{name} {of}".strip()] = unit, default
        found.append(rows)
    return found


def fields_of(part: type[Part], written: str) -> Iterator[Field]:
    """Name as the page writes it, default and docstring of the fields of a part."""
    for name, field in part.model_fields.items():
        default = REQUIRED if field.is_required() else field.default
        if part is ca.Vehicle and name in ("uav", "camera"):
            continue  # their fields are in the same table
        yield written.format(field.alias or name), default, field.description or ""


def fields_of_scenario() -> Iterator[Field]:
    parameters = NumpyDocString(inspect.getdoc(ca.Scenario) or "")["Parameters"]
    told = {each.name: " ".join(each.desc) for each in parameters}
    for field in dataclasses.fields(ca.Scenario):
        missing = field.default is dataclasses.MISSING
        yield field.name, REQUIRED if missing else field.default, told[field.name]


TABLES: list[list[Field]] = [
    [each for part, written in parts.items() for each in fields_of(part, written)]
    for parts in VEHICLE
] + [list(fields_of_scenario())]


@pytest.mark.parametrize("number", range(len(TABLES)))
def test_a_table_names_every_field_with_its_unit_and_its_default(number: int) -> None:
    told, fields = tables()[number], TABLES[number]
    assert told.keys() == {name for name, *_ in fields}
    for name, default, docstring in fields:
        unit, shown = told[name]
        assert unit == unit_of(docstring), name
        assert says(shown, default), f"{name}: {shown} on the page, {default} in the code"


def test_every_part_of_a_vehicle_has_its_fields_in_a_table() -> None:
    assert set(parts_of(ca.Vehicle)) == {part for parts in VEHICLE for part in parts}


def parts_of(part: type[Part]) -> Iterator[type[Part]]:
    """A part, and those that its fields hold."""
    yield part
    for name, field in part.model_fields.items():
        for kind in kinds(part, field.alias or name):
            if kind:
                yield from parts_of(kind)


def unit_of(docstring: str) -> str:
    """What stands in brackets alone, as the page writes it."""
    unit = re.search(r"(?<![\[(])\[([^\[\]]+)\]", docstring)
    return unit[1].replace("-", "–") if unit else ""


def says(shown: str, default: Any) -> bool:
    """Whether a cell of the page tells a default; what follows from others is told in words."""
    if default is REQUIRED:
        return shown == "required"
    try:
        value = ast.literal_eval(shown.strip("`"))
    except (SyntaxError, ValueError):
        return (default is None or len(default) == 0) and shown != "required"
    if isinstance(value, str):
        return bool(value == default)
    return default not in (None, "", ()) and bool(np.all(np.asarray(default) == value))
