"""Formulas of the pages become MathML."""

import re
from pathlib import Path

import pytest

pytest.importorskip("sphinx")
pytest.importorskip("latex2mathml")

from docs.extensions.mathml import mathml  # noqa: E402


def test_lines_of_a_formula_are_rows_and_signs_stand_at_their_numbers() -> None:
    lines = mathml(r"\begin{aligned} a &= b \\ c &= -d \end{aligned}", display="block")
    assert lines.count("<mtr>") == 2
    assert "&amp;" not in lines
    assert '<mo form="prefix" lspace="0" rspace="0">−</mo>' in lines


def test_no_formula_of_the_pages_holds_a_command_that_was_not_understood() -> None:
    for page in sorted((Path(__file__).parents[2] / "docs").rglob("*.md")):
        text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text("utf-8"), flags=re.DOTALL)
        for block, inline in re.findall(r"\$\$(.+?)\$\$|\$([^$\n]+)\$", text, re.DOTALL):
            assert "\\" not in mathml(block or inline), f"{page.name}: {block or inline}"
