"""Nothing that a result folder holds becomes HTML of its report."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from amiri2026.report.html import Html, html, joined
from amiri2026.report.page import page
from continuair.errors import InputError
from continuair.studies.contents import read
from continuair.studies.results import MARKER
from tests.paper.made_results import made_results, write_results
from tests.refusals import refused

EVIL = """<script>alert(1)</script><img src=x onerror="alert(1)">" onload='alert(1)' {0}</title>"""


class Tags(HTMLParser):
    """Elements and attributes of a page, and the texts of its scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.names: set[tuple[str, frozenset[str]]] = set()
        self.scripts = 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.add((tag, frozenset(name for name, _ in attrs)))
        self.scripts += tag == "script"


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where texts are, of lists all entries at once; the names of fields that are texts, too."""
    if isinstance(value, dict):
        for name, child in value.items():
            yield (*at, name, "its name")
            yield from places(child, (*at, name))
    elif isinstance(value, list):
        for child in value:
            yield from places(child, (*at, None))
    else:
        yield at


def changed(value: Any, at: tuple[Any, ...], change: Callable[[Any], Any]) -> Any:
    """A copy in which what is at a place is another."""
    if not at:
        return change(value)
    first, *rest = at
    if isinstance(value, list):
        return [changed(child, tuple(rest), change) for child in value]
    if not isinstance(value, dict) or first not in value:
        return value
    if rest == ["its name"]:
        return {change(name) if name == first else name: child for name, child in value.items()}
    return value | {first: changed(value[first], tuple(rest), change)}


def evil(value: Any) -> Any:
    return f"{'' if value is None else value}{EVIL}"


RESULTS = made_results()
PLACES = sorted(set(places(RESULTS)), key=repr)


@pytest.mark.long
def test_the_texts_of_results_stay_texts(tmp_path: Path) -> None:
    """Field by field: a field that makes results useless is refused, and none becomes HTML."""
    plain = Tags(page(read(write_results(tmp_path / "plain"))))
    assert plain.scripts == 1
    made = 0
    # Numbers of sentences have hundreds of names: one of each kind will do.
    some = {(*place[:3], len(place), place[-1] == "its name"): place for place in PLACES}
    folder = write_results(tmp_path / "evil")
    for place in some.values():
        results = changed(RESULTS, place, evil)
        assert results != RESULTS
        (folder / "paper.json").write_text(json.dumps(results))
        try:
            text = page(read(folder))
        except InputError:
            continue
        made += 1
        found = Tags(text)
        assert found.scripts == 1, place
        assert found.names <= plain.names, place
        assert "onerror=" not in text.replace("onerror=&quot;", ""), place
    assert made > len(some) / 2


@pytest.mark.parametrize("name", ["study", "version", "command"])
def test_what_a_marker_says_stays_text(tmp_path: Path, name: str) -> None:
    folder = write_results(tmp_path / "results")
    plain = Tags(page(read(folder)))
    marker = json.loads((folder / MARKER).read_text())
    (folder / MARKER).write_text(json.dumps(marker | {name: marker[name] + EVIL.replace("/", "")}))
    (folder / f"paper{EVIL.replace('/', '')}.json").write_text("{}")
    found = Tags(page(read(folder)))
    assert found.scripts == 1 and not any(tag == "img" for tag, _ in found.names)
    assert {each for _, names in found.names - plain.names for each in names} <= {"id", "open"}


def test_a_table_stays_text(tmp_path: Path) -> None:
    marker = {"study": "open_loop", "version": "0.1.0", "files": []}
    folder = write_results(tmp_path / "results")
    (folder / MARKER).write_text(json.dumps(marker))
    (folder / "table.md").write_text(f"# T\n\n{EVIL}\n\n| a | b |\n|---|--:|\n| {EVIL} | 1 |\n")
    text = page(read(folder))
    assert Tags(text).scripts == 1 and not any("onerror" in names for _, names in Tags(text).names)


def test_the_folder_above_and_links_are_no_parts(tmp_path: Path) -> None:
    outer = write_results(tmp_path / "outer")
    inner = write_results(tmp_path / "outer" / "inner")
    other = write_results(tmp_path / "other")
    (inner / "linked").symlink_to(other)
    marker = json.loads((inner / MARKER).read_text())
    (inner / MARKER).write_text(json.dumps(marker | {"parts": ["..", "."]}))
    assert read(inner).parts == []
    (inner / MARKER).write_text(json.dumps(marker | {"parts": ["linked"]}))
    with refused("folder"):
        read(inner)
    assert read(outer).parts == []


def test_only_html_stands_as_it_is() -> None:
    assert html("<b>{}</b>", "<i>") == "<b>&lt;i&gt;</b>"
    assert html('<b title="{t}">{}</b>', html("<i>{}</i>", 1.5), t='"') == (
        '<b title="&quot;"><i>1.5</i></b>'
    )
    assert joined(["<", Html("<hr>")]) == "&lt;<hr>"
