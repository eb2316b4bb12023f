"""The tables of docs/howto/custom_law.md name every field that a control law reads and writes."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

import continuair as ca
from continuair.device.numbers import Numbers
from continuair.device.types import Tree
from continuair.engine.pack import tree_of
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.camera import camera_code
from continuair.kernels.sensing.guidance import guidance_code
from continuair.kernels.sensing.sense import LawCode, law_code

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "custom_law.md"
CELLS = "\n".join(line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("|"))
SHOWN = set(re.findall(r"`\"?(\w+)(?:\([^`]*\))?\"?`", CELLS))


def read_and_written() -> dict[str, set[str]]:
    """What each object holds that a law or its controller is written with."""
    numbers = Numbers("float64")
    tree: Tree = tree_of(ca.load_vehicle("paper"))
    camera, ground = camera_code(numbers, tree, 4), guidance_code(numbers, tree)
    structs = {
        "Sense": law_code(numbers, tree, 4).Sense,
        "Sight": camera.Sight,
        "Camera": camera.Camera,
        "View": camera.View,
        "SetPoint": ground.SetPoint,
        "Flight": flight_code(numbers, tree).Flight,
    }
    classes = {"code": LawCode, "Controller": ca.Controller}
    return {name: set(struct.vars) for name, struct in structs.items()} | {
        name: {each.name for each in fields(found)} for name, found in classes.items()
    }


@pytest.mark.parametrize(("name", "held"), read_and_written().items(), ids=read_and_written())
def test_a_table_names_every_field(name: str, held: set[str]) -> None:
    assert held - SHOWN == set(), f"name it in {PAGE.name}, among the fields of {name}"
