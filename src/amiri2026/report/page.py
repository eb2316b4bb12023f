"""A result folder as one HTML page that needs nothing else."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator
from hashlib import sha256
from html import escape
from importlib import resources
from typing import Any

from markdown_it import MarkdownIt

from amiri2026.report.verdicts import STUDIES, chapters, first_screen
from continuair.files import DAMAGE
from continuair.studies import Contents, damaged

TITLES = {
    "paper": "The paper, sentence by sentence",
    "open_loop": "Open-loop tests",
    "sensitivity": "Parameter sensitivity, sin(f t)",
    "sensitivity_hertz": "Parameter sensitivity, sin(2π f t)",
    "tracking": "Visual tracking",
    "cost": "Cost of a sample",
    "table": "Table I",
    "advise": "May I decouple?",
    "atlas": "Atlas of decoupling",
}

# Results of others are text: no link or picture of theirs is made of it.
_MARKDOWN = (
    MarkdownIt("commonmark", {"html": False})
    .enable("table")
    .disable(["link", "image", "autolink", "reference"])
)


def page(contents: Contents) -> str:
    """Return the HTML of a study's results: verdicts, figures, tables, vehicle and command.

    Raises InputError if the results are not as a study writes them.
    """
    try:
        return _page(contents)
    except DAMAGE as error:
        raise damaged(contents.path, error) from None


def _page(contents: Contents) -> str:
    title = TITLES.get(contents.study, contents.study)
    if name := contents.results.get("vehicle", {}).get("name"):
        title += f", vehicle {name}"
    style, script = _asset("page.css"), _asset("page.js")
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta http-equiv="Content-Security-Policy" content="{_policy(style, script)}">',
            f"<title>{escape(title)}</title>",
            f"<style>{style}</style></head><body>",
            f"<header><h1>{escape(title)}</h1>{_made(contents)}</header>",
            f"<nav>{''.join(_links(contents))}</nav>",
            "<main>",
            *_sections(contents),
            _vehicle(contents.results),
            "</main>",
            f"<script>{script}</script></body></html>\n",
        ]
    )


def _sections(contents: Contents) -> Iterator[str]:
    if contents.study != "paper":
        yield _study(contents)
        for part in contents.parts:
            yield _study(part)
        return
    yield first_screen(contents.results, _rendered)
    parts = {part.study: part for part in contents.parts}

    def figures(study: str, names: tuple[str, ...] | None) -> str:
        return _figures(parts[study], names) if study in parts else ""

    yield from chapters(contents.results, figures)
    judged = {entry["id"].partition(".")[0] for entry in contents.results["sentences"]}
    for name, part in parts.items():
        left = [figure for figure in part.figures if not _in_a_chapter(judged, name, figure)]
        yield _study(part, left)


def _in_a_chapter(judged: set[str], study: str, figure: str) -> bool:
    """Return whether a figure stands in the chapter of a part of the paper that was judged."""
    chapters = [STUDIES[part] for part in STUDIES if part in judged]
    listed = [chapter[study] for chapter in chapters if study in chapter]
    return any(names is None or figure in names for names in listed)


def _study(contents: Contents, figures: list[str] | None = None) -> str:
    """Return the section of a study: its figures, or those named, and its tables."""
    title = TITLES.get(contents.study, contents.study)
    return "\n".join(
        [
            f'<section id="{escape(contents.study)}"><h2>{escape(title)}</h2>{_made(contents)}',
            _figures(contents, figures),
            "<details open><summary>Tables</summary>",
            _rendered(_without_title(contents.table)),
            "</details></section>",
        ]
    )


def _figures(contents: Contents, names: Iterable[str] | None) -> str:
    """Return the figures of a study, or those named."""
    wanted = contents.figures if names is None else names
    return "\n".join(
        _figure(name, contents.figures[name].suffix, contents.figures[name].read_bytes())
        for name in wanted
        if name in contents.figures
    )


def _figure(name: str, suffix: str, content: bytes) -> str:
    kind = {".svg": "image/svg+xml", ".png": "image/png"}[suffix]
    data = base64.b64encode(content).decode("ascii")
    label = escape(name.replace("_", " "))
    return f'<figure><img alt="{label}" src="data:{kind};base64,{data}"></figure>'


def _made(contents: Contents) -> str:
    by = f"<p>Made by continuair {escape(contents.version)}"
    again = f"; again with <code>{escape(contents.command)}</code>" if contents.command else ""
    return f"{by}{again}.</p>"


def _links(contents: Contents) -> Iterator[str]:
    shown = [contents, *contents.parts]
    for one in shown:
        title = TITLES.get(one.study, one.study)
        yield f'<a href="#{escape(one.study)}">{escape(title)}</a> '
    yield '<a href="#vehicle">Vehicle</a>'


def _vehicle(results: dict[str, Any]) -> str:
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>"
        for name, value in _fields("", results.get("vehicle", {}))
    )
    return (
        f'<section id="vehicle"><h2>Vehicle</h2><table><thead><tr><th>field</th><th>value</th></tr>'
        f"</thead><tbody>{rows}</tbody></table></section>"
    )


def _fields(prefix: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        for name, child in value.items():
            yield from _fields(f"{prefix}.{name}" if prefix else name, child)
    else:
        yield prefix, str(value)


def _rendered(markdown: str) -> str:
    """Return Markdown as HTML; classes align columns, as the policy allows no inline styles."""
    html: str = _MARKDOWN.render(markdown)
    for side in ("left", "center", "right"):
        html = html.replace(f' style="text-align:{side}"', f' class="{side}"')
    return html


def _without_title(markdown: str) -> str:
    first, _, rest = markdown.partition("\n")
    return rest if first.startswith("# ") else markdown


def _policy(style: str, script: str) -> str:
    """Return the content security policy: no external resources, and only these inline texts."""
    style, script = (
        "'sha256-" + base64.b64encode(sha256(text.encode()).digest()).decode() + "'"
        for text in (style, script)
    )
    return f"default-src 'none'; img-src data:; style-src {style}; script-src {script}"


def _asset(name: str) -> str:
    return resources.files("amiri2026.report").joinpath(name).read_text("utf-8")
