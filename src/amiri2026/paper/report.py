"""Storing the verdicts on the paper: JSON, CSV, and Markdown in the order of the paper."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from amiri2026.paper.overview import FLOWN_IN, by_part, overview
from amiri2026.sentences import PARTS
from amiri2026.verdicts import CLASSES
from continuair.studies import ResultFolder, as_markdown

HEADINGS = ("sentence", "the paper", "verdict", "what comes out")


def write(results: dict[str, Any], folder: ResultFolder) -> None:
    """Write paper.json, paper.csv and table.md to the folder."""
    folder.store(results, as_table(results), records(results))


def records(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row per sentence and number of it, and one for a sentence without any."""
    for entry in results["sentences"]:
        row = {key: entry[key] for key in ("id", "verdict", "claims", "criterion", "evidence")}
        numbers = {**entry["numbers"], **entry["times"]}
        yield from ({**row, "number": name, "value": numbers[name]} for name in numbers)
        if not numbers:
            yield row


def as_table(results: dict[str, Any]) -> str:
    """Return the first screen and the verdicts in Markdown, part by part."""
    lines = [f"# The paper, sentence by sentence, vehicle {results['vehicle']['name']}", ""]
    lines += [*overview(results), "", *by_part(results)]
    for part, title in PARTS.items():
        if rows := table(results, part):
            lines += ["", f"## {part}: {title}" if title != part else f"## {part}", "", *rows]
    return "\n".join(lines) + "\n"


def table(results: dict[str, Any], part: str) -> list[str]:
    """Return the lines of the table of a part of the paper; none without a sentence of it."""
    rows = [
        (entry["id"], entry["quote"], f"**{meaning(entry['verdict'])}**", finding(entry))
        for entry in results["sentences"]
        if entry["id"].partition(".")[0] == part
    ]
    note = [FLOWN_IN[part], ""] if part in FLOWN_IN else []
    return [*note, *as_markdown(HEADINGS, rows, HEADINGS)] if rows else []


def meaning(verdict: str) -> str:
    """Return the meaning of a verdict, such as "wrong as printed"."""
    return CLASSES.get(verdict, verdict)


def finding(entry: dict[str, Any]) -> str:
    """Return the evidence of a sentence with its correction, if there is one."""
    correction = entry.get("correction")
    return f"{entry['evidence']}. Right: {correction}" if correction else str(entry["evidence"])
