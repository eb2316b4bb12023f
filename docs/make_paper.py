"""Write the verdicts on the paper into the pages: make_paper.py [results/paper.json].

With the results of `continuair paper` it records their verdicts anew first; without, it writes the
recorded ones, which `make paper` checks.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from continuair.studies.paper import recorded
from continuair.studies.paper.report import table
from continuair.studies.sentences import PARTS, sentences
from continuair.studies.verdicts import VERDICTS

DOCS = Path(__file__).parent
RECORD = Path(recorded.__file__).with_name("verdicts.json")
END = "<!-- to here -->\n"

PAGES = {
    "paper.md": list(PARTS),
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
    entries = list(recorded.recorded().values())
    for name in PAGES:
        page = DOCS / name
        page.write_text(written(page.read_text(encoding="utf-8"), entries), encoding="utf-8")


def written(page: str, entries: list[dict[str, Any]]) -> str:
    """The page with every block between its marks written anew."""
    for mark, lines in blocks(entries).items():
        start = f"<!-- {mark} -->\n"
        if start in page:
            before, rest = page.split(start)
            page = before + start + "\n".join(lines) + "\n" + END + rest.split(END, 1)[1]
    return page


def blocks(entries: list[dict[str, Any]]) -> dict[str, list[str]]:
    """What is written behind each mark."""
    found = {f"verdicts {part}": table({"sentences": entries}, part) for part in PARTS}
    return found | {"verdicts counted": counted(entries)}


def counted(entries: list[dict[str, Any]]) -> list[str]:
    """A table of how many sentences of each part got which verdict."""
    verdicts = VERDICTS
    rule = "|---|" + "---:|" * (1 + len(verdicts))
    lines = [f"| part | sentences | {' | '.join(verdicts)} |", rule]
    for part, title in PARTS.items():
        here = [entry["verdict"] for entry in entries if entry["id"].partition(".")[0] == part]
        cells = [str(Counter(here)[verdict] or "") for verdict in verdicts]
        name = part if part == title else f"{part}: {title}"
        lines.append(f"| {name} | {len(here)} | {' | '.join(cells)} |")
    total = Counter(entry["verdict"] for entry in entries)
    cells = [str(total[verdict]) for verdict in verdicts]
    return [*lines, f"| all | {len(entries)} | {' | '.join(cells)} |"]


if __name__ == "__main__":
    main(*sys.argv[1:])
