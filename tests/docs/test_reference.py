"""The reference names what is public, and docstrings come out of it as prose."""

import re
from pathlib import Path

import pytest

import continuair as ca

pytest.importorskip("sphinx")
DOCS = Path(__file__).parents[2] / "docs"


def documented() -> set[str]:
    """Full names of all objects that the pages of the reference document."""
    names, module = set(), ""
    for page in sorted((DOCS / "reference").glob("*.md")):
        for kind, name in re.findall(r"\.\. ([\w:]+):: ([\w.]+)", page.read_text("utf-8")):
            if kind == "currentmodule":
                module = name
            elif kind == "py:module" or name.startswith("continuair."):
                names.add(name)
            else:
                names.add(f"{module}.{name}")
    return names


def test_every_public_name_is_in_the_reference() -> None:
    spaces = {"continuair": ca.__all__, "continuair.equations": ca.equations.__all__}
    public = {f"{space}.{name}" for space, names in spaces.items() for name in names}
    assert public <= documented(), "name it in a page of docs/reference/"


def test_every_path_is_in_the_reference() -> None:
    paths = {
        f"continuair.paths.{name}"
        for name, value in vars(ca.paths).items()
        if getattr(value, "__module__", "") == "continuair.scenario.paths" and name[0] != "_"
    }
    assert paths <= documented(), "name it in docs/reference/flights.md"
