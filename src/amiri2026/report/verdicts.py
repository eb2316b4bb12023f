"""The report on the paper as HTML: a first screen, then chapters in the paper's order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from amiri2026.paper.overview import FLOWN_IN, by_part, overview
from amiri2026.paper.report import meaning
from amiri2026.report.html import Html, html, joined
from amiri2026.sentences import PARTS
from continuair.studies import number

STUDIES: dict[str, dict[str, tuple[str, ...] | None]] = {
    "III-A": {"open_loop": ("bend_variables", "frames")},
    "IV-A": {"table": ("table",), "open_loop": ("overview", "table")},
    "IV-B": {"sensitivity": None, "sensitivity_hertz": None},
    "IV-C": {"tracking": None, "cost": None},
}
"""Part of the paper -> studies of it, with the figures shown before its sentences; None: all."""


def first_screen(results: dict[str, Any], markdown: Callable[[str], Html]) -> Html:
    """Return the section that says what holds, what the paper found, and what it means."""
    return html(
        '<section id="paper">{found}<details><summary>Verdicts by part of the paper</summary>'
        "{parts}</details>{filters}</section>",
        found=markdown("\n".join(overview(results))),
        parts=markdown("\n".join(by_part(results))),
        filters=_filters(results),
    )


def chapters(
    results: dict[str, Any], figures: Callable[[str, tuple[str, ...] | None], Html]
) -> Iterator[Html]:
    """Yield a section per part of the paper: its figures, then its sentences.

    figures: gives the HTML of a study's figures, of those named or of all.
    """
    for part, title in PARTS.items():
        entries = [e for e in results["sentences"] if e["id"].partition(".")[0] == part]
        if not entries:
            continue
        yield html(
            '<section class="chapter" id="part-{part}"><h2>{heading}</h2>{note}{shown}{sentences}'
            "</section>",
            part=part,
            heading=part if title == part else f"{part}: {title}",
            note=html("<p>{}</p>", FLOWN_IN[part]) if part in FLOWN_IN else "",
            shown=joined(figures(study, names) for study, names in STUDIES.get(part, {}).items()),
            sentences=joined(_sentence(entry, part) for entry in entries),
        )


def _filters(results: dict[str, Any]) -> Html:
    buttons = joined(
        html(
            '<label><input type="checkbox" data-verdict="{}" checked> {} ({})</label> ',
            name,
            meaning(name),
            count,
        )
        for name, count in results["counts"].items()
    )
    return html(
        '<form class="filters">{}<label>text <input type="search"></label> '
        '<output aria-live="polite"></output></form>',
        buttons,
    )


def _sentence(entry: dict[str, Any], part: str) -> Html:
    return html(
        '<article class="sentence" data-part="{part}" data-verdict="{verdict}" id="{id}"><h3>{id} '
        '<span class="verdict {kind}">{meaning}</span></h3><blockquote>{quote}</blockquote>'
        "{finding}{more}</article>",
        part=part,
        verdict=entry["verdict"],
        id=entry["id"],
        kind=entry["verdict"].replace(" ", "-"),
        meaning=meaning(entry["verdict"]),
        quote=entry["quote"],
        finding=_finding(entry),
        more=_more(entry),
    )


def _finding(entry: dict[str, Any]) -> Html:
    """Return evidence, view by view where there are several, and the correction of a misprint."""
    if entry["cases"]:
        rows = joined(
            html("<li><b>{verdict}</b> for {vehicle}, {reading}: {evidence}.</li>", **case)
            for case in entry["cases"]
        )
        note = html("<p>{}.</p>", entry["note"]) if entry["note"] else ""
        return html("<ul>{}</ul>{}", rows, note)
    correction = entry["correction"]
    right = html("<p><b>Right:</b> {}.</p>", correction) if correction else ""
    return html("<p>{}.</p>{}", entry["evidence"], right)


def _more(entry: dict[str, Any]) -> Html:
    """Return the sentence's claim, criterion, numbers and command, folded away."""
    numbers = joined(
        html("<li>{}: {}</li>", name, number(value))
        for name, value in {**entry["numbers"], **entry["times"]}.items()
    )
    return html(
        "<details><summary>criterion, numbers, command</summary><dl>"
        "<dt>claims</dt><dd>{claims}</dd>"
        "<dt>measured</dt><dd>{measure}</dd>"
        "<dt>criterion</dt><dd>{criterion}</dd>"
        '<dt class="numbers">numbers</dt><dd class="numbers"><ul>{listed}</ul></dd>'
        "<dt>again with</dt><dd><code>{redo}</code></dd></dl></details>",
        listed=numbers,
        **{name: entry[name] for name in ("claims", "measure", "criterion", "redo")},
    )
