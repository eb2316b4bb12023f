"""A result folder as one HTML page that needs nothing else."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Iterator
from hashlib import sha256
from html import unescape
from importlib import resources
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

from amiri2026.report.html import Html, html, joined
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

_PLACES = {"overview": 0, "table": 1, "advise": 2, "frames": 98, "bend_variables": 99}
"""Places of figures: what compares first, what defines last, and all others between."""

_BETWEEN = 50

_TITLE = re.compile(r"<title>([^<]*)</title>")

# Results of others are text: no link or picture of theirs is made of it.
_MARKDOWN = (
    MarkdownIt("commonmark", {"html": False})
    .enable("table")
    .disable(["link", "image", "autolink", "reference"])
)


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
<style>{style}</style></head><body>
<header><h1>{title}</h1>{made}</header>
<nav>{links}</nav>
<main>
{sections}
{vehicle}
</main>
<script>{script}</script></body></html>

"""


def page(contents: Contents) -> str:
    """Return the HTML of a study's results: verdicts, figures, tables, vehicle and command.

    Raises InputError if the results are not as a study writes them.
    """
    try:
        return _page(contents)
    except DAMAGE as error:
        raise damaged(contents.path, error) from None


def _page(contents: Contents) -> Html:
    title = TITLES.get(contents.study, contents.study)
    if name := contents.results.get("vehicle", {}).get("name"):
        title += f", vehicle {name}"
    style, script = _asset("page.css"), _asset("page.js")
    return html(
        _PAGE,
        policy=_policy(style, script),
        title=title,
        style=style,
        made=_made(contents),
        links=joined(_links(contents)),
        sections=joined(_sections(contents), "\n"),
        vehicle=_vehicle(contents.results),
        script=script,
    )


def _sections(contents: Contents) -> Iterator[Html]:
    if contents.study != "paper":
        yield _study(contents, made=False)
        for part in contents.parts:
            yield _study(part)
        return
    yield first_screen(contents.results, _rendered)
    parts = {part.study: part for part in contents.parts}

    def figures(study: str, names: tuple[str, ...] | None) -> Html:
        return _figures(parts[study], names) if study in parts else Html()

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


def _study(contents: Contents, figures: list[str] | None = None, made: bool = True) -> Html:
    """Return the section of a study: its summary, its figures, or those named, and its tables.

    made: whether to say what made it, as the head of a page of its own does already.
    """
    names = list(contents.figures) if figures is None else figures
    shown = sorted(names, key=lambda name: _PLACES.get(name, _BETWEEN))
    return html(
        '<section id="{study}"><h2>{title}</h2>{summary}{made}\n{figures}\n<details open>'
        "<summary>Tables</summary>\n{tables}\n</details></section>",
        study=contents.study,
        title=TITLES.get(contents.study, contents.study),
        summary=_summary(contents, shown),
        made=_made(contents) if made else "",
        figures=_figures(contents, shown),
        tables=_rendered(_without_title(contents.table)),
    )


def _summary(contents: Contents, names: list[str]) -> Html:
    """Return the verdict of a study, and the titles of its figures as links to them."""
    verdict = contents.results.get("verdict")
    found = html("<p><b>{}</b></p>", verdict) if isinstance(verdict, str) else Html()
    # Of figures with the same title, the first.
    titles = {_title(name, contents.figures[name]): name for name in reversed(names)}
    items = joined(
        html('<li><a href="#{}">{}</a></li>', _anchor(contents, name), title)
        for title, name in reversed(titles.items())
    )
    if not found and not items:
        return Html()
    return html('<div class="summary">{}<ul>{}</ul></div>', found, items)


def _title(name: str, path: Path) -> str:
    """Return the title of a figure, which its SVG holds, or its name without one."""
    drawn, found = path.with_suffix(".svg"), None
    if drawn.is_file() and not drawn.is_symlink():
        found = _TITLE.search(drawn.read_text("utf-8", "replace"))
    return unescape(found[1]) if found else name.replace("_", " ")


def _anchor(contents: Contents, name: str) -> str:
    return f"{contents.study}-{name}"


def _figures(contents: Contents, names: Iterable[str] | None) -> Html:
    """Return the figures of a study, or those named."""
    wanted = contents.figures if names is None else names
    return joined((_figure(contents, name) for name in wanted if name in contents.figures), "\n")


def _figure(contents: Contents, name: str) -> Html:
    path = contents.figures[name]
    return html(
        '<figure id="{anchor}"><img alt="{label}" src="data:{kind};base64,{data}"></figure>',
        anchor=_anchor(contents, name),
        label=_title(name, path),
        kind={".svg": "image/svg+xml", ".png": "image/png"}[path.suffix],
        data=base64.b64encode(path.read_bytes()).decode("ascii"),
    )


def _made(contents: Contents) -> Html:
    again = html("; again with <code>{}</code>", contents.command) if contents.command else ""
    return html("<p>Made by continuair {}{}.</p>", contents.version, again)


def _links(contents: Contents) -> Iterator[Html]:
    for one in (contents, *contents.parts):
        yield html('<a href="#{}">{}</a> ', one.study, TITLES.get(one.study, one.study))
    yield Html('<a href="#vehicle">Vehicle</a>')


def _vehicle(results: dict[str, Any]) -> Html:
    rows = joined(
        html("<tr><td>{}</td><td>{}</td></tr>", *each)
        for each in _fields("", results.get("vehicle", {}))
    )
    return html(
        '<section id="vehicle"><h2>Vehicle</h2><table><thead><tr><th>field</th><th>value</th></tr>'
        "</thead><tbody>{}</tbody></table></section>",
        rows,
    )


def _fields(prefix: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        for name, child in value.items():
            yield from _fields(f"{prefix}.{name}" if prefix else name, child)
    else:
        yield prefix, str(value)


def _rendered(markdown: str) -> Html:
    """Return Markdown as HTML; classes align columns, as the policy allows no inline styles."""
    found: str = _MARKDOWN.render(markdown)
    for side in ("left", "center", "right"):
        found = found.replace(f' style="text-align:{side}"', f' class="{side}"')
    return Html(found)


def _without_title(markdown: str) -> str:
    first, _, rest = markdown.partition("\n")
    return rest if first.startswith("# ") else markdown


def _policy(style: str, script: str) -> Html:
    """Return the content security policy: no external resources, and only these inline texts."""
    style, script = (
        "'sha256-" + base64.b64encode(sha256(text.encode()).digest()).decode() + "'"
        for text in (style, script)
    )
    return Html(f"default-src 'none'; img-src data:; style-src {style}; script-src {script}")


def _asset(name: str) -> Html:
    return Html(resources.files("amiri2026.report").joinpath(name).read_text("utf-8"))
