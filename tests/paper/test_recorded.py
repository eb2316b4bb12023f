"""What a run must find again, and that the pages show it."""

import json
import sys
from pathlib import Path

import pytest

from amiri2026.paper import recorded
from amiri2026.sentences import PARTS

DOCS = Path(__file__).parents[2] / "docs"


def entry(**changes: object) -> dict[str, object]:
    first = recorded.recorded()["sentences"][0]
    return {**json.loads(json.dumps(first)), **changes}


def test_a_run_that_finds_what_is_recorded_differs_in_nothing() -> None:
    assert recorded.differences(recorded.recorded()) == []


def test_another_number_of_the_table_is_told() -> None:
    found = json.loads(json.dumps(recorded.recorded()))
    found["table1"]["ours"][1][3] *= 1.1
    (line,) = recorded.differences(found)
    assert line.startswith("Table I, row R")


def test_another_verdict_is_told() -> None:
    (line,) = recorded.differences({"sentences": [entry(verdict="reproduced?")]})
    assert "reproduced?, recorded: " in line


@pytest.mark.parametrize(
    ("name", "found", "wanted", "same"),
    [
        ("error [m]", 1.01, 1.0, True),
        ("error [m]", 1.03, 1.0, False),
        ("error [m]", 3e-7, 1e-9, True),
        ("rank correlation of the error", 0.05, 0.035, True),
        ("rank correlation of the error", 0.05, 0.02, False),
        ("error [m]", None, 1.0, False),
        ("error [m]", float("nan"), 1.0, False),
    ],
)
def test_numbers_are_found_again_within_their_tolerance(
    name: str, found: float | None, wanted: float, same: bool
) -> None:
    assert recorded.is_found_again(name, found, wanted) is same


def test_every_part_of_the_paper_has_one_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    import make_paper  # type: ignore[import-not-found]

    shown = [part for parts in make_paper.PAGES.values() for part in parts]
    assert sorted(shown) == sorted(PARTS)


def test_the_pages_show_the_record(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    monkeypatch.delitem(sys.modules, "make_paper", raising=False)
    import make_paper

    known = recorded.recorded()
    entries = known["sentences"]
    for name in make_paper.PAGES:
        page = (make_paper.EXPLANATION / name).read_text(encoding="utf-8")
        assert make_paper.written(page, known) == page, f"{name}: run docs/make_paper.py"
        shown = [one["id"] for one in entries if f"\n| {one['id']} |" in page]
        assert shown == [one["id"] for one in entries if one["id"].partition(".")[0]
                         in make_paper.PAGES[name]]  # fmt: skip
