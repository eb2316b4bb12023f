"""The table of verdicts on the paper as HTML, with what filters it."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any

from continuair.studies.paper.report import summary
from continuair.studies.sentences import PARTS
from continuair.studies.tables import number


def verdict_section(results: dict[str, Any]) -> str:
    """Return the section with the verdict on every sentence, its numbers and its command."""
    entries = results["sentences"]
    return "\n".join(
        [
            '<section id="paper"><h2>Verdicts</h2>',
            f"<p>{escape(summary(results))} It prints neither its vehicle nor its gains: a "
            "verdict holds for the vehicle below. Criteria and limits are ours. Where a sentence "
            "has parts, the verdict on each stands in brackets behind it.</p>",
            _filters(results),
            '<table id="verdicts"><thead><tr><th>sentence</th><th>the paper</th><th>verdict</th>'
            "<th>what comes out</th></tr></thead><tbody>",
            *_rows(entries),
            "</tbody></table></section>",
        ]
    )


def _filters(results: dict[str, Any]) -> str:
    buttons = "".join(
        f'<label><input type="checkbox" data-verdict="{escape(name)}" checked> {escape(name)} '
        f"({count})</label> "
        for name, count in results["counts"].items()
    )
    parts = "".join(
        f'<option value="{part}">{escape(part)}: {escape(title)}</option>'
        for part, title in PARTS.items()
    )
    return (
        f'<form class="filters">{buttons}<label>part <select><option value="">all</option>{parts}'
        '</select></label> <label>text <input type="search"></label> '
        '<output aria-live="polite"></output></form>'
    )


def _rows(entries: list[dict[str, Any]]) -> Iterator[str]:
    part = ""
    for entry in entries:
        here = entry["id"].partition(".")[0]
        if here != part:
            part = here
            title = PARTS[part]
            shown = part if title == part else f"{part}: {title}"
            yield (f'<tr class="part" data-part="{part}"><th colspan="4">{escape(shown)}</th></tr>')
        yield _row(entry, part)


def _row(entry: dict[str, Any], part: str) -> str:
    verdict = escape(entry["verdict"])
    kind = verdict.replace(" ", "-")
    return (
        f'<tr data-part="{part}" data-verdict="{verdict}" id="{escape(entry["id"])}">'
        f"<td>{escape(entry['id'])}</td><td>“{escape(entry['quote'])}”</td>"
        f'<td class="{kind}">{verdict}</td>'
        f"<td>{escape(entry['evidence'])}.{_more(entry)}</td></tr>"
    )


def _more(entry: dict[str, Any]) -> str:
    """What the sentence claims, how it is judged, the numbers and the command, folded away."""
    numbers = "".join(
        f"<li>{escape(name)}: {number(value)}</li>"
        for name, value in {**entry["numbers"], **entry["times"]}.items()
    )
    return (
        "<details><summary>criterion, numbers, command</summary><dl>"
        f"<dt>claims</dt><dd>{escape(entry['claims'])}</dd>"
        f"<dt>measured</dt><dd>{escape(entry['measure'])}</dd>"
        f"<dt>reproduced if</dt><dd>{escape(entry['criterion'])}</dd>"
        f'<dt class="numbers">numbers</dt><dd class="numbers"><ul>{numbers}</ul></dd>'
        f"<dt>again with</dt><dd><code>{escape(entry['redo'])}</code></dd></dl></details>"
    )
