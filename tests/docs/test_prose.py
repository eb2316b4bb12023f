"""What Sphinx learns for these pages: docstrings of prose, and formulas as MathML."""

import re
from pathlib import Path

import pytest

pytest.importorskip("sphinx")
pytest.importorskip("latex2mathml")

from docs.extensions.mathml import mathml  # noqa: E402
from docs.extensions.prose import restructured  # noqa: E402


def test_parameters_become_a_list_and_what_is_returned_or_raised_follows_it() -> None:
    told = "Do it.\n\nrate: how often [Hz]; gain, cap: of\nthe loop. Returns a number. Raises it."
    assert restructured(told, "continuair.f", ("rate", "gain", "cap")).split("\n\n") == [
        "Do it.",
        "* **rate**: how often [Hz]",
        "* **gain**, **cap**: of the loop",
        "Returns a number.",
        "Raises it.",
    ]


def test_nothing_but_backticks_is_markup_in_a_docstring() -> None:
    assert restructured("|κ| * 2, x_", "continuair.f", ()) == r"\|κ\| \* 2, x\_"


def test_a_public_name_between_backticks_is_a_link() -> None:
    assert "<continuair.simulate>" in restructured("As `simulate`.", "continuair.f", ())
    of_equations = restructured("As `forward_dynamics`.", "continuair.equations.f", ())
    assert "<continuair.equations.forward_dynamics>" in of_equations


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
