"""Storing the region of operation: JSON, CSV, a table, and all flights."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from amiri2026.ladder import in_words
from amiri2026.region.flights import DURATION
from amiri2026.region.starts import BEND, DIRECTIONS, HEIGHT, SIDEWAYS, TILT, YAW
from amiri2026.region.study import Region
from amiri2026.standard_laws import LAWS
from continuair.analysis import percent
from continuair.studies import ResultFolder, as_markdown
from continuair.vehicle import COORDINATES

BOX = (
    f"within {SIDEWAYS:g} m sideways, from {-HEIGHT[0]:g} m too low to {HEIGHT[1]:g} m too high, "
    f"within {TILT:.3g} rad of tilt and {YAW:.3g} rad of yaw to either side, bends to {BEND:g} 1/m"
)
"""Where random starts are drawn from, of which those with all points in view fly."""

_COARSE = "error_estimate above 1e-3"
"""The heading of how many flights are not resolved."""

_LISTED = 20
"""Failures that the table lists, of each case; the CSV has all."""


def write(study: Region, folder: ResultFolder) -> None:
    """Write region.json, region.csv, table.md and region_flights.nc to the folder."""
    folder.store(
        study.results, as_table(study.results), _failures(study.results), {"flights": study.flights}
    )


def _failures(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row for every random start that did not end well."""
    for case in results["cases"]:
        named = {key: case[key] for key in ("law", "model", "rate_hz")}
        for failure in case["random"]["failures"]:
            yield {**named, **failure}


def name_of(case: dict[str, Any]) -> str:
    """Return a case in words."""
    return f"{case['law']}, {case['model']}, {case['rate_hz']:g} Hz"


def reach(entry: dict[str, Any]) -> str:
    """Return how far a law converges in a direction, and the reason of the limit.

    Beyond may be nothing tried, a failure, or starts with points out of view.
    """
    return in_words(entry, "", "not {}" if entry["in_view"] else "all in view")


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown, with their basis and the starts that fail."""
    failed = [line for case in results["cases"] for line in _listed(case)]
    return "\n".join([*summary(results), *failed]) + "\n"


def summary(results: dict[str, Any]) -> list[str]:
    """Return lines on how far each law converges."""
    return [
        f"# Region of operation, vehicle {results['vehicle']['name']}",
        "",
        f"Flights of {DURATION:g} s from rest before a target at rest. One has ended well that "
        f"stays below {results['well_px']:g} px",
        "in each coordinate of each point throughout its last second.",
        "",
        *(f"* {name}: {meaning}." for name, meaning in LAWS.items() if name in results["laws"]),
        *(f"* {note}" for note in results["notes"]),
        "",
        "## Off in one direction",
        "",
        "The largest value up to which all flights end well, and what is beyond: nothing that was",
        "tried, a failure, or starts with points out of view. The last column counts the flights",
        "that this rests on and that are not resolved. Of y, roll and yaw the positive side",
        "is flown, which the other mirrors where the vehicle is symmetric about the plane of x and",
        "z.",
        "",
        *_reaches(results),
        "",
        "## Random starts",
        "",
        f"All points in view, {BOX}; seed {results['seed']}.",
        "",
        *_shares(results),
        *_saturated(results),
    ]


def _reaches(results: dict[str, Any]) -> list[str]:
    cells = []
    for case in results["cases"]:
        for bend in dict.fromkeys(each["bend_1_m"] for each in case["directions"]):
            own = [each for each in case["directions"] if each["bend_1_m"] == bend]
            coarse = sum(each["unresolved"] for each in own)
            cells.append([name_of(case), f"{bend:g}", *map(reach, own), str(coarse)])
    headings = ["law, plant, control rate", "start bend [1/m]", *DIRECTIONS, _COARSE]
    return as_markdown(headings, cells, ("law, plant, control rate", *DIRECTIONS, _COARSE))


def _shares(results: dict[str, Any]) -> list[str]:
    cells = [
        [name_of(case), str(case["random"]["well"]), str(case["random"]["runs"]),
         percent(case["random"]["share"]), str(case["random"]["unresolved"])]
        for case in results["cases"]
    ]  # fmt: skip
    headings = ["law, plant, control rate", "ended well", "of", "share", _COARSE]
    return as_markdown(headings, cells, headings[:1])


def _saturated(results: dict[str, Any]) -> list[str]:
    """Return a sentence about the cases in which rotors saturate."""
    cases = [
        f"{each['saturated']} flights of {name_of(each)}"
        for each in results["cases"]
        if each.get("saturated")
    ]
    return ["", f"Rotors saturate in {'; '.join(cases)}."] if cases else []


def _listed(case: dict[str, Any]) -> list[str]:
    """Return the first failures of a case, with their reasons."""
    failures = case["random"]["failures"]
    lines = [f"* {each}." for each in _first_failures(case["directions"])]
    for each in failures[:_LISTED]:
        start = ", ".join(f"{each[name]:.3g}" for name in COORDINATES)
        lines.append(f"* [{start}]: {each['reason']}.")
    if len(failures) > _LISTED:
        lines.append(f"* and {len(failures) - _LISTED} more, in region.csv.")
    return ["", f"## Failed: {name_of(case)}", "", *lines] if lines else []


def _first_failures(directions: list[dict[str, Any]]) -> Iterator[str]:
    """Yield where a case first fails in each direction, and why."""
    for each in directions:
        if each["failed_at"] is not None and each["in_view"]:
            off = f"{each['direction']} off by {each['failed_at']:g}{each['unit']}"
            yield f"{off}, bent by {each['bend_1_m']:g} 1/m: {each['reason']}"
