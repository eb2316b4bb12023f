"""Write the tables of the region of operation in docs/control.md, from what `region` has written:

continuair region --model coupled --rate 1000 --rate 10000 --out results/region
python docs/make_control.py results/region/region.json
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

from continuair.studies.region.report import reach
from continuair.studies.region.starts import DIRECTIONS
from continuair.studies.tables import percent

START, END = "<!-- written by make_control.py -->\n", "<!-- to here -->\n"
DOCS = Path(__file__).parent
PLANT = "coupled"
FIGURE = "random_coupled_1000_hz.png"


def main(results: Path) -> None:
    cases = json.loads(results.read_text(encoding="utf-8"))["cases"]
    own = [case for case in cases if case["model"] == PLANT]
    page = DOCS / "control.md"
    before, rest = page.read_text(encoding="utf-8").split(START)
    table = "\n".join([*_directions(own), "", *_random(cases)]) + "\n"
    page.write_text(before + START + table + END + rest.split(END, 1)[1], encoding="utf-8")
    shutil.copy(results.parent / FIGURE, DOCS / "images" / "region.png")


def _directions(cases: list[dict[str, Any]]) -> list[str]:
    lines = [f"| gains | control | start bend | {' | '.join(DIRECTIONS)} |"]
    lines.append("| --- | ---: | ---: |" + " --- |" * len(DIRECTIONS))
    for case in cases:
        for bend in dict.fromkeys(each["bend_1_m"] for each in case["directions"]):
            cells = [reach(each) for each in case["directions"] if each["bend_1_m"] == bend]
            lines.append(
                f"| {case['law']} | {case['rate_hz']:g} Hz | {bend:g} 1/m | {' | '.join(cells)} |"
            )
    return lines


def _random(cases: list[dict[str, Any]]) -> list[str]:
    lines = [
        "| gains | plant | control | random starts that end well |",
        "| --- | --- | ---: | ---: |",
    ]
    for case in cases:
        found = case["random"]
        lines.append(
            f"| {case['law']} | {case['model']} | {case['rate_hz']:g} Hz | {found['well']} of "
            f"{found['runs']} ({percent(found['share'])}) |"
        )
    return lines


if __name__ == "__main__":
    main(Path(sys.argv[1]))
