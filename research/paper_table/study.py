"""What the search for Table I comes to: results, Markdown, and the vehicles as files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.table.study import PRINTED, READING, TOLERANCE, factor, fly_tests
from continuair.progress import Progress, Steps
from continuair.studies.results import ResultFolder
from continuair.studies.tables import as_markdown, number
from continuair.vehicle.vehicle_file import as_toml
from research.paper_table.readings import READINGS
from research.paper_table.search import Candidate, Search, ranked
from research.paper_table.space import PARAMETERS

_CONFIRMED = 8
"""How many candidates are flown accurately, under any reading and under that of Table I."""

_TOLERANCES = (1e-7, 1e-9)
_FACTORS = (1.25, 1.5, 2.0, 3.0)
_ROWS = ("translation", "rotation")

CAUTION = (
    f"{len(PARAMETERS)} parameters, three materials and {READINGS:,} readings face eight numbers. "
    "A close match shows that the table can be attained, and not that this is the authors' vehicle "
    "or reading."
)


def summarise(found: Search, progress: Progress | None = None) -> dict[str, Any]:
    """Return the results of a search, JSON-able: the best vehicle under any reading, the best under
    that of Table I (None if there is none), both flown accurately, and what the rest came to."""
    steps = Steps(progress, 2 * _CONFIRMED)
    best, literal = (_confirmed(candidates, steps) for candidates in (found.pairs, found.literal))
    return {
        "study": "paper_table",
        "seed": found.seed,
        "effort": asdict(found.effort),
        "interrupted": found.interrupted,
        "vehicles": found.vehicles,
        "readings": READINGS,
        "printed": PRINTED.tolist(),
        "best": best,
        "table1_reading": literal,
        "drawn": _drawn(found),
        "readings_within": _within(each.factor for each in found.by_reading.values()),
        "by_choice": _by_choice(found),
        "caution": CAUTION,
    }


def write(results: dict[str, Any], folder: ResultFolder) -> None:
    """Write paper_table.json, table.md, vehicle.toml and vehicle_table1_reading.toml."""
    folder.store(results, as_table(results))
    for name, key in (("vehicle", "best"), ("vehicle_table1_reading", "table1_reading")):
        if results[key] is not None:
            folder.write_text(f"{name}.toml", results[key]["toml"])


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown."""
    lines = ["# Vehicles that give Table I of the paper", ""]
    if results["interrupted"]:
        lines += ["The search was interrupted. These are the best vehicles found until then.", ""]
    lines += [
        f"{results['vehicles']:,} vehicles were flown, {results['drawn']['vehicles']} of them "
        f"drawn at random (seed {results['seed']}), under up to {results['readings']:,} readings. "
        "The factor is the largest ratio to the printed numbers, either way.",
    ]
    for title, key in (("any reading", "best"), ("the reading of Table I", "table1_reading")):
        lines += ["", f"## Best under {title}", "", *_entry_lines(results[key], results["printed"])]
    lines += ["", "## Random vehicles", "", *_drawn_lines(results["drawn"])]
    lines += ["", "## Readings", "", *_choice_lines(results), "", results["caution"]]
    return "\n".join(lines) + "\n"


def _confirmed(candidates: Iterable[Candidate], steps: Steps) -> dict[str, Any] | None:
    """The entry of the candidate that is nearest to the table in accurate flights, if any is.

    The largest of its factors at several tolerances counts, as some flights do not converge.
    """
    flown = []
    for candidate in ranked(candidates)[:_CONFIRMED]:
        steps.begin("flying the best vehicles accurately")
        factors = {f"{each:g}": _factor(candidate, each) for each in (TOLERANCE, *_TOLERANCES)}
        worst = round(float(np.max(list(factors.values()))), 9)
        if np.isfinite(worst):
            flown.append((worst, factors, candidate))
    if not flown:
        return None
    _, factors, best = min(flown, key=lambda entry: entry[0])
    return _entry(best, factors)


def _factor(candidate: Candidate, tolerance: float) -> float:
    flown = fly_tests(candidate.design.vehicle, candidate.reading, tolerance=tolerance)
    return factor(flown.table(candidate.reading))


def _entry(candidate: Candidate, factors: dict[str, float]) -> dict[str, Any]:
    """A candidate flown accurately: its numbers, vehicle and reading; its factors by tolerance."""
    vehicle, reading = candidate.design.vehicle, candidate.reading
    flown = fly_tests(vehicle, reading)
    ours = flown.table(reading)
    comment = [
        "Found by research/paper_table: gives Table I of Amiri et al. (arXiv 2602.18684) within a",
        f"factor of {factor(ours):.3f}; not known to be the authors' vehicle. Reading:",
        f"{describe(reading.describe())}.",
    ]
    return {
        "factor": factor(ours),
        "factor_by_tolerance": factors,
        "ours": ours.tolist(),
        "ratios": (ours / PRINTED).tolist(),
        "in_metres_and_radians": flown.plain(),
        "reading": reading.describe(),
        "parameters": candidate.design.describe(),
        "held": candidate.design.held(),
        "toml": as_toml(vehicle, comment),
    }


def describe(reading: dict[str, Any]) -> str:
    """Return a reading in words: "decoupled element, remark1 True, …"."""
    return ", ".join(f"{name} {value}" for name, value in reading.items())


def _drawn(found: Search) -> dict[str, Any]:
    """How many drawn vehicles are within factors, under any reading and under that of Table I."""
    anyhow, literal = zip(*found.drawn, strict=True)
    return {
        "vehicles": len(found.drawn),
        "any_reading_within": _within(anyhow),
        "table1_reading_within": _within(literal),
    }


def _within(factors: Iterable[float]) -> dict[str, int]:
    values = np.array(list(factors))
    return {f"{limit:g}": int(np.sum(values <= limit)) for limit in _FACTORS}


def _by_choice(found: Search) -> list[dict[str, Any]]:
    """The best candidate of the readings that make a choice, by choice, as flown in the search."""
    least: dict[tuple[str, Any], Candidate] = {}
    for candidate in ranked(found.by_reading.values()):
        for key in candidate.reading.describe().items():
            known = least.setdefault(key, candidate)
            if candidate.factor < known.factor:
                least[key] = candidate
    printed = READING.describe()
    names = list(printed)
    return [
        {
            "choice": name,
            "value": value,
            "table1": printed[name] == value,
            "factor": candidate.factor,
            "reading": candidate.reading.describe(),
            "parameters": candidate.design.describe(),
        }
        for (name, value), candidate in sorted(
            least.items(), key=lambda item: (names.index(item[0][0]), str(item[0][1]))
        )
    ]


def _entry_lines(entry: dict[str, Any] | None, printed: list[list[float]]) -> list[str]:
    if entry is None:
        return ["No vehicle was flown to the end of all tests."]
    rows = []
    for name, theirs, ours, ratios in zip(
        _ROWS, printed, entry["ours"], entry["ratios"], strict=True
    ):
        for label, values, digits in (
            ("paper", theirs, 4),
            ("ours", ours, 4),
            ("ratio", ratios, 3),
        ):
            rows.append([f"{name}, {label}", *(number(value, digits) for value in values)])
    factors = ", ".join(f"{value:.3f} at {t}" for t, value in entry["factor_by_tolerance"].items())
    units = {p.name: f"[{p.lower:g}, {p.upper:g}] {p.units}" for p in PARAMETERS}
    units |= {"material": "", "youngs_modulus": "Pa, of the material"}
    parameters = [
        [name, value if isinstance(value, str) else f"{value:.6g}", units[name],
         entry["held"].get(name, "")]
        for name, value in entry["parameters"].items()
    ]  # fmt: skip
    headings = ("parameter", "value", "bounds", "at a bound")
    return [
        f"Factor by tolerance: {factors}. Reading: {describe(entry['reading'])}.",
        "",
        *as_markdown(("error", *OPEN_LOOP_TESTS), rows, ("error",)),
        "",
        *as_markdown(headings, parameters, ("parameter", "bounds", "at a bound")),
    ]


def _drawn_lines(drawn: dict[str, Any]) -> list[str]:
    heading = f"of {drawn['vehicles']} vehicles, within a factor of"
    rows = [
        [name, *(str(count) for count in drawn[key].values())]
        for name, key in (
            ("any reading", "any_reading_within"),
            ("the reading of Table I", "table1_reading_within"),
        )
    ]
    lines = as_markdown((heading, *drawn["any_reading_within"]), rows, (heading,))
    return [*lines, "", "About half of the vehicles were flown under the choices of Table I."]


def _choice_lines(results: dict[str, Any]) -> list[str]:
    within = results["readings_within"]
    counts = ", ".join(f"{count:,} within {limit}" for limit, count in within.items())
    rows = [
        [f"{row['choice']}: {row['value']}", f"{row['factor']:.3f}", "yes" if row["table1"] else ""]
        for row in results["by_choice"]
    ]
    headings = ("choice", "least factor", "choice of Table I")
    return [
        f"Of {results['readings']:,} readings, for the best vehicle flown under each: {counts}. "
        "Only a few readings were refined, and flights of the search are coarse.",
        "",
        *as_markdown(headings, rows, ("choice", "choice of Table I")),
    ]
