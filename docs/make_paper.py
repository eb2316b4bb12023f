"""Write the verdicts on the paper into the pages: make_paper.py [results/paper.json].

With the results of `continuair paper` it records their verdicts anew first; without, it writes the
recorded ones, which `make paper` checks.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from amiri2026.paper import recorded
from amiri2026.paper.overview import by_part, overview
from amiri2026.paper.report import table
from amiri2026.sentences import MERGED, PARTS, sentences
from amiri2026.table import report as table_report
from continuair.studies.tables import as_markdown

DOCS = Path(__file__).parent
RECORD = Path(recorded.__file__).with_name("verdicts.json")
END = "<!-- to here -->\n"

PAGES = {
    "paper.md": list(PARTS),
    "table.md": ["table"],
    "sensitivity.md": ["IV-B"],
    "control.md": ["III-D", "IV-C"],
}
"""Page -> parts of the paper whose verdicts it shows."""


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
        page = DOCS / name
        page.write_text(written(page.read_text(encoding="utf-8"), known), encoding="utf-8")


def written(page: str, known: dict[str, Any]) -> str:
    """The page with every block between its marks written anew."""
    for mark, lines in blocks(known).items():
        start = f"<!-- {mark} -->\n"
        if start in page:
            before, rest = page.split(start)
            page = before + start + "\n".join(lines) + "\n" + END + rest.split(END, 1)[1]
    return page


def blocks(known: dict[str, Any]) -> dict[str, list[str]]:
    """What is written behind each mark."""
    found = {f"verdicts {part}": table(known, part) for part in PARTS}
    found["overview"] = overview(known)
    found["merged"] = as_markdown(("old", "now"), list(MERGED.items()), ("old", "now"))
    found["verdicts counted"] = by_part(known)
    found["table"] = table_report.as_table(known["table1"]).splitlines()[2:]
    return found


if __name__ == "__main__":
    main(*sys.argv[1:])
