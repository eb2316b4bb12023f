"""Storing the robustness study: JSON, CSV and a table."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from amiri2026.ladder import in_words
from amiri2026.robustness.flights import DRAWS
from amiri2026.robustness.mistakes import LINEAR_DRAG
from amiri2026.robustness.study import Robustness, reason
from amiri2026.standard_laws import LAWS
from continuair.flight import RESOLVED, is_beyond_limits
from continuair.studies import ResultFolder, as_markdown, number


def write(study: Robustness, folder: ResultFolder) -> None:
    """Write robustness.json, robustness.csv and table.md to the folder."""
    folder.store(study.results, as_table(study.results), _flights(study.results), {})


def _flights(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row for every flight."""
    for case in results["cases"]:
        named = {"law": case["law"], "model": case["model"]}
        yield {**named, "mistake": "", "value": 0.0, "unit": "", "way": "", **case["without"]}
        for name, mistake in case["mistakes"].items():
            for each in mistake["values"]:
                yield {**named, "mistake": name, "unit": mistake["unit"].strip(), **each}


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown, with their basis."""
    return "\n".join(summary(results)) + "\n"


def summary(results: dict[str, Any]) -> list[str]:
    """Return lines on the tolerated mismatch of each law."""
    return [
        f"# Robustness, vehicle {results['vehicle']['name']}",
        "",
        f"The letter {results['letter']} in {results['duration_s']:g} s, by laws that were "
        "designed for this vehicle",
        "and believe in it, on others that differ by one mistake at a time. It is borne if it adds",
        f"at most {results['borne_px']:g} px to the RMS of the feature error after "
        f"{results['settled_s']:g} s. What has a direction is tried in four (along x and y, to",
        "either side; wind with another draw of turbulence in each), a turn in two, noise of a",
        f"camera in {DRAWS} draws, and counts as the worst of them.",
        "",
        *(f"* {name}: {meaning}." for name, meaning in LAWS.items() if name in results["laws"]),
        *(f"* {note}" for note in results["notes"]),
        "",
        "The largest mistake up to which all are borne, and the first that is not:",
        "",
        *reaches(results),
        "",
        *_lost(results),
        _resolved(results),
        *_saturated(results),
        *_wind(results),
    ]


def reaches(results: dict[str, Any]) -> list[str]:
    """Return the lines of a table, a row for each mistake."""
    cases = results["cases"]
    names = [f"{case['law']}, {case['model']}" for case in cases]
    rows = [["none", *(_without(case["without"]) for case in cases)]]
    for name, mistake in cases[0]["mistakes"].items():
        cells = [reach(case["mistakes"][name]) for case in cases]
        rows.append([mistake["meaning"], *cells])
    return as_markdown(["mistake", *names], rows, ["mistake", *names])


def _without(flight: dict[str, Any]) -> str:
    lost = math.isnan(flight["rms_px"])
    return f"lost: {reason(flight)}" if lost else f"{number(flight['rms_px'], 2)} px RMS"


def reach(entry: dict[str, Any]) -> str:
    """Return how large a mismatch may be, and the first size that is not tolerated."""
    return "undecided" if entry["reached"] is None else in_words(entry, " (all tried)", "not {}")


def _lost(results: dict[str, Any]) -> list[str]:
    lost = dict.fromkeys(
        case["law"] for case in results["cases"] if math.isnan(case["without"]["rms_px"])
    )
    if not lost:
        return []
    return [
        f"Without any mistake the letter is lost by {' and '.join(lost)}, of which nothing follows "
        "for mistakes: find gains for this vehicle with `continuair tune`, and give them with "
        "--gains.",
    ]


def _resolved(results: dict[str, Any]) -> str:
    """Return how many of the decisive flights are not resolved."""
    flights = _deciding(results)
    coarse = sum(each["error_estimate"] > RESOLVED for each in flights)
    return (
        f"Of the {len(flights)} flights that decide {coarse} have an error_estimate above "
        f"{RESOLVED:g}."
    )


def _saturated(results: dict[str, Any]) -> list[str]:
    """Return how far rotors saturate in these flights."""
    asked = [each.get("largest_saturation", 0.0) for each in _deciding(results)]
    beyond = [most for most in asked if is_beyond_limits(most)]
    if not beyond:
        return []
    told = f"asked for up to {max(beyond):.1%} of their range beyond it"
    return [f"In {len(beyond)} of them rotors saturate, {told}."]


def _deciding(results: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the flights without a mistake, and of every value of one the worst of its ways."""
    return [
        each
        for case in results["cases"]
        for flights in ([case["without"]], *(m["values"] for m in case["mistakes"].values()))
        for each in flights
    ]


def _wind(results: dict[str, Any]) -> list[str]:
    blows = any("wind" in case["mistakes"] for case in results["cases"])
    if results["vehicle"]["uav"].get("drag") is not None or not blows:
        return []
    return [f"The UAV has no [uav.drag]; in wind it flies with one of {LINEAR_DRAG:g} N s/m."]
