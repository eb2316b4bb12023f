"""The table of docs/explanation/model.md leads from every equation to what cites it."""

import inspect
import pkgutil
import re
from pathlib import Path

import pytest

import continuair
import continuair.errors

ROOT = Path(__file__).parents[2]
PACKAGE = Path(continuair.errors.__file__).parent
ROWS = [
    (row[1], name)
    for row in re.finditer(
        r"^\| (Eq\. \(\d+\)|Appendix [AB]) \|.*\| (.+) \|$",
        (ROOT / "docs" / "explanation" / "model.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    for name in re.findall(r"`([^`]+)`", row[2])
]


@pytest.mark.parametrize(("equation", "name"), ROWS)
def test_what_an_equation_leads_to_cites_it(equation: str, name: str) -> None:
    assert equation in cited(text_of(name))


def test_the_table_holds_every_equation_and_both_appendices() -> None:
    numbered = {f"Eq. ({number})" for number in range(1, 20)}
    assert {equation for equation, _ in ROWS} == numbered | {"Appendix A", "Appendix B"}


def text_of(name: str) -> str:
    """The text of a file, or a function's docstring."""
    if name.endswith(".py"):
        home = PACKAGE.parent if name.startswith("amiri2026/") else PACKAGE
        return (home / name).read_text(encoding="utf-8")
    return inspect.getdoc(pkgutil.resolve_name(f"continuair:{name}")) or ""


def cited(text: str) -> set[str]:
    """The equations that a text cites, ranges such as "Eqs. (2) to (5)" in full."""
    found = set(re.findall(r"Appendix [AB]", text))
    for listed in re.findall(r"Eqs?\.\s+(\(\d+\)(?:(?:,| and|-| to)?\s*\(\d+\))*)", text):
        for first, last in re.findall(r"\((\d+)\)(?:(?:-|\s+to\s+)\((\d+)\))?", listed):
            found |= {f"Eq. ({n})" for n in range(int(first), int(last or first) + 1)}
    return found
