"""The report on the paper as HTML: a first screen, then chapters in the paper's order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from html import escape
from typing import Any

from amiri2026.paper.overview import FLOWN_IN, by_part, overview
from amiri2026.paper.report import meaning
from amiri2026.sentences import PARTS
from continuair.studies import number

STUDIES: dict[str, dict[str, tuple[str, ...] | None]] = {
    "III-A": {"open_loop": ("bend_variables", "frames")},
    "IV-A": {"table": ("table",), "open_loop": ("overview", "table")},
    "IV-B": {"sensitivity": None, "sensitivity_hertz": None},
    "IV-C": {"tracking": None, "cost": None},
}
"""Part of the paper -> studies of it, with the figures shown before its sentences; None: all."""


def first_screen(results: dict[str, Any], markdown: Callable[[str], str]) -> str:
    """Return the section with the paper's findings, which hold, and what they mean."""
    rendered = markdown("\n".join(overview(results)))
    parts = markdown("\n".join(by_part(results)))
    return (
        f'<section id="paper">{rendered}<details><summary>Verdicts by part of the paper</summary>'
        f"{parts}</details>{_filters(results)}</section>"
    )


def chapters(
    results: dict[str, Any], figures: Callable[[str, tuple[str, ...] | None], str]
) -> Iterator[str]:
    """Yield a section per part of the paper: its figures, then its sentences.

    figures: gives the HTML of a study's figures, of those named or of all.
    """
    for part, title in PARTS.items():
        entries = [e for e in results["sentences"] if e["id"].partition(".")[0] == part]
        if not entries:
            continue
        heading = part if title == part else f"{part}: {title}"
        note = f"<p>{escape(FLOWN_IN[part])}</p>" if part in FLOWN_IN else ""
        shown = "".join(figures(study, names) for study, names in STUDIES.get(part, {}).items())
        yield (
            f'<section class="chapter" id="part-{part}"><h2>{escape(heading)}</h2>{note}{shown}'
            f"{''.join(_sentence(entry, part) for entry in entries)}</section>"
        )


def _filters(results: dict[str, Any]) -> str:
    buttons = "".join(
        f'<label><input type="checkbox" data-verdict="{escape(str(name))}" checked> '
        f"{escape(meaning(name))} ({int(count)})</label> "
        for name, count in results["counts"].items()
    )
    return (
        f'<form class="filters">{buttons}<label>text <input type="search"></label> '
        '<output aria-live="polite"></output></form>'
    )


def _sentence(entry: dict[str, Any], part: str) -> str:
    verdict = escape(entry["verdict"])
    kind = verdict.replace(" ", "-")
    return (
        f'<article class="sentence" data-part="{part}" data-verdict="{verdict}" '
        f'id="{escape(entry["id"])}"><h3>{escape(entry["id"])} '
        f'<span class="verdict {kind}">{escape(meaning(entry["verdict"]))}</span></h3>'
        f"<blockquote>{escape(entry['quote'])}</blockquote>{_finding(entry)}{_more(entry)}"
        "</article>"
    )


def _finding(entry: dict[str, Any]) -> str:
    """Return evidence, view by view where there are several, and the correction of a misprint."""
    if entry["cases"]:
        rows = "".join(
            f"<li><b>{escape(case['verdict'])}</b> for {escape(case['vehicle'])}, "
            f"{escape(case['reading'])}: {escape(case['evidence'])}.</li>"
            for case in entry["cases"]
        )
        note = f"<p>{escape(entry['note'])}.</p>" if entry["note"] else ""
        return f"<ul>{rows}</ul>{note}"
    right = f"<p><b>Right:</b> {escape(entry['correction'])}.</p>" if entry["correction"] else ""
    return f"<p>{escape(entry['evidence'])}.</p>{right}"


def _more(entry: dict[str, Any]) -> str:
    """Return the sentence's claim, criterion, numbers and command, folded away."""
    numbers = "".join(
        f"<li>{escape(name)}: {number(value)}</li>"
        for name, value in {**entry["numbers"], **entry["times"]}.items()
    )
    return (
        "<details><summary>criterion, numbers, command</summary><dl>"
        f"<dt>claims</dt><dd>{escape(entry['claims'])}</dd>"
        f"<dt>measured</dt><dd>{escape(entry['measure'])}</dd>"
        f"<dt>criterion</dt><dd>{escape(entry['criterion'])}</dd>"
        f'<dt class="numbers">numbers</dt><dd class="numbers"><ul>{numbers}</ul></dd>'
        f"<dt>again with</dt><dd><code>{escape(entry['redo'])}</code></dd></dl></details>"
    )
