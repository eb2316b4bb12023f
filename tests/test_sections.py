"""The page on sections: its constants, its sags and the tables that it prints."""

from __future__ import annotations

from pathlib import Path

import pytest

import continuair as ca
from continuair.studies.sections import (
    BEAM_CONSTANT,
    beam_constants,
    constant,
    cut,
    elastica_sag,
    sag,
)

PAGE = Path(__file__).parents[1] / "docs" / "explanation" / "sections.md"
SLOW = pytest.mark.soak  # kernels of their own, which take long to compile
COUNTS = (1, 2, pytest.param(3, marks=SLOW), pytest.param(4, marks=SLOW))


def printed(count: int, table: int = 0) -> list[float]:
    """The numbers of a row of a table of the page, without what stands in brackets."""
    rows = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith(f"| {count} ")]
    cells = rows[table].strip("| ").split(" | ")
    return [float(cell.split()[0]) for cell in cells[1:] if cell != "–"]


@pytest.mark.parametrize("count", COUNTS)
def test_frequencies_of_the_page_are_those_of_the_vehicle(count: int) -> None:
    vehicle = cut(count)
    clamped, free, stiffest, *_ = printed(count)
    found = ca.modes(vehicle, gravity=0.0).frequencies
    first = ca.modes(vehicle, base="clamped", gravity=0.0).frequencies[0]
    assert constant(first) == pytest.approx(clamped, abs=6e-5)
    assert constant(found[0]) == pytest.approx(free, abs=6e-5)
    assert constant(found[-1]) == pytest.approx(stiffest, rel=6e-4)


def test_the_true_beam_has_the_frequencies_of_the_page() -> None:
    true = beam_constants()
    assert true["clamped"] == pytest.approx(BEAM_CONSTANT, abs=1e-6)
    line = next(x for x in PAGE.read_text("utf-8").splitlines() if x.startswith("| true beam"))
    assert [float(cell) for cell in line.split(" | ")[1:3]] == pytest.approx(
        [true["clamped"], true["free"]], abs=6e-5
    )


@pytest.mark.parametrize("count", COUNTS)
def test_a_light_arm_of_n_sections_sags_short_by_a_third_of_one_over_n_squared(count: int) -> None:
    """μ g l⁴/8 E I of the beam: a section's mean curvature is right, and nothing between."""
    load = 1e-3
    assert sag(count, load) / (load / 8.0) == pytest.approx(1.0 - 1.0 / (3.0 * count**2), abs=1e-5)


def test_more_sections_come_near_the_elastica_under_large_loads() -> None:
    """Half the length of sag: with two sections a quarter of what one is off, or so."""
    off = [1.0 - sag(count, 5.0) / elastica_sag(5.0) for count in (1, 2)]
    assert 0.2 < off[0] < 1.0 / 3.0 and 3.5 < off[0] / off[1] < 4.5


def test_a_light_elastica_sags_as_a_beam() -> None:
    assert elastica_sag(1e-3) == pytest.approx(1e-3 / 8.0, rel=1e-5)


@pytest.mark.parametrize("count", COUNTS)
def test_sags_of_the_page_are_those_of_the_code(count: int) -> None:
    *_, light, _, _, heavy = printed(count)
    assert sag(count, 0.01) == pytest.approx(light, rel=6e-4)
    assert sag(count, 5.0) == pytest.approx(heavy, rel=6e-4)
