"""Write the verdicts on the paper into the pages: make_paper.py [results/paper.json].

With the results of `continuair paper` it records their verdicts anew first; without, it writes the
recorded ones, which `make paper` checks.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from amiri2026.paper import recorded
from amiri2026.paper.overview import FLOWN_IN, advice, by_part, summary
from amiri2026.paper.report import meaning
from amiri2026.sentences import MERGED, PARTS, sentences
from amiri2026.table import report as table_report
from amiri2026.verdicts import MISPRINT
from continuair.studies.tables import as_markdown

EXPLANATION = Path(__file__).parent / "explanation"
RECORD = Path(recorded.__file__).with_name("verdicts.json")
END = "<!-- to here -->\n"

PAGES = {
    "paper.md": [],
    "paper_equations.md": ["III-A", "III-B", "III-C", "App-A", "App-B"],
    "paper_open_loop.md": ["IV", "IV-A"],
    "paper_sweeps.md": ["IV-B"],
    "paper_closed_loop.md": ["III-D", "IV-C"],
    "paper_conclusions.md": ["Abstract", "V"],
    "table.md": [],
}
"""Page -> parts of the paper whose verdicts it shows."""

PAGE_OF = {part: page for page, parts in PAGES.items() for part in parts}

HEADINGS = ("sentence", "what it claims", "verdict", "what comes out")


def main(results: str | None = None) -> None:
    if results is not None:
        found = json.loads(Path(results).read_text(encoding="utf-8"))
        ids = [entry["id"] for entry in found["sentences"]]
        if found["quick"] or found["vehicle"]["name"] != "paper" or ids != list(sentences()):
            sys.exit(f"{results} is no whole run of the vehicle paper, which alone is recorded.")
        text = json.dumps(recorded.as_recorded(found), indent=1, ensure_ascii=False) + "\n"
        RECORD.write_text(text, encoding="utf-8")
    known = recorded.recorded()
    for name in PAGES:
        page = EXPLANATION / name
        page.write_text(written(page.read_text(encoding="utf-8"), known), encoding="utf-8")


def written(page: str, known: dict[str, Any]) -> str:
    """Return the page with every block between its marks written anew."""
    for mark, lines in blocks(known).items():
        start = f"<!-- {mark} -->\n"
        if start in page:
            before, rest = page.split(start)
            page = before + start + "\n".join(lines) + "\n" + END + rest.split(END, 1)[1]
    return page


def blocks(known: dict[str, Any]) -> dict[str, list[str]]:
    """Return the lines that are written behind each mark."""
    table1 = known["table1"]
    found = {f"verdicts {part}": verdicts(known, part) for part in PARTS}
    found["counted"] = [summary(known)]
    found["by part"] = linked(by_part(known))
    found["misprints"] = misprints(known)
    found["advice"] = advice(known)
    found["merged"] = as_markdown(("old", "now"), list(MERGED.items()), ("old", "now"))
    found["beside"] = [*table_report.beside(table1), "", table_report.reading(table1)]
    found["message"] = [table_report.message(table1)]
    found["ablations"] = table_report.ablations(table1)
    found["sampling"] = table_report.sampling(table1)
    found["caution"] = [table_report.CAUTION]
    return found


def linked(lines: list[str]) -> list[str]:
    """Return the lines of the table of parts, in which each part leads to its verdicts."""
    text = "\n".join(lines)
    for part, page in PAGE_OF.items():
        name = title(part)
        anchor = re.sub(r"[^\w -]", "", name).lower().replace(" ", "-")
        text = text.replace(f"| {name} |", f"| [{name}]({page}#{anchor}) |")
    return text.splitlines()


def title(part: str) -> str:
    """Return the heading of a part of the paper on its page."""
    return part if part == PARTS[part] else f"{part}: {PARTS[part]}"


def misprints(known: dict[str, Any]) -> list[str]:
    """Return the lines of a table: each sentence that is wrong as printed, and the right form."""
    rows = [
        (f"[{entry['id']}]({PAGE_OF[entry['id'].partition('.')[0]]})", entry["claims"],
         re.split(r"\. (?=[A-Z])", entry["correction"])[0])
        for entry in known["sentences"] if entry["verdict"] == MISPRINT
    ]  # fmt: skip
    heads = ("sentence", "what it claims", "right")
    return as_markdown(heads, rows, heads)


def verdicts(known: dict[str, Any], part: str) -> list[str]:
    """Return the lines of the table of the verdicts on a part of the paper."""
    rows = [
        (entry["id"], entry["claims"], f"**{meaning(entry['verdict'])}**", finding(entry))
        for entry in known["sentences"]
        if entry["id"].partition(".")[0] == part
    ]
    note = [FLOWN_IN[part], ""] if part in FLOWN_IN else []
    return [*note, *as_markdown(HEADINGS, rows, HEADINGS)]


def finding(entry: dict[str, Any]) -> str:
    """Return what comes out of a sentence, its correction last.

    Of the cases with the same verdict the first has its numbers; the others are named.
    """
    lines = [one_case(entry["cases"], verdict) for verdict in cases_by_verdict(entry)]
    if not lines:
        lines = [f"{entry['evidence']}."]
    elif entry["note"]:
        lines.append(f"{entry['note']}.")
    if entry["correction"]:
        lines.append(f"**Right:** {entry['correction']}.")
    return "<br>".join(lines)


def cases_by_verdict(entry: dict[str, Any]) -> list[str]:
    """Return the verdicts of the cases of a sentence, each once."""
    return list(dict.fromkeys(case["verdict"] for case in entry["cases"]))


def one_case(cases: list[dict[str, str]], verdict: str) -> str:
    """Return the numbers of the first case with a verdict, and the names of the others."""
    first, *others = [case for case in cases if case["verdict"] == verdict]
    told = f"**{verdict.capitalize()}** for {named(first)}: {first['evidence']}."
    return told + (f" Also for {'; '.join(map(named, others))}." if others else "")


def named(case: dict[str, str]) -> str:
    """Return the vehicle and the reading of a case."""
    vehicle = case["vehicle"]
    vehicle = f"`{vehicle}`" if vehicle in ("paper", "table1") else vehicle
    return f"{vehicle}, {case['reading']}" if case["reading"] else vehicle


if __name__ == "__main__":
    main(*sys.argv[1:])
