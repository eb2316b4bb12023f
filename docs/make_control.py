"""Write the tables of docs/explanation/servoing_limits.md from the results of two studies:

continuair region --model coupled --rate 1000 --rate 10000 --out results/region
continuair robustness --out results/robustness
python docs/make_control.py results/region/region.json results/robustness/robustness.json
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

from amiri2026.region.report import reach
from amiri2026.region.starts import DIRECTIONS
from amiri2026.robustness.report import reaches
from continuair.studies.tables import percent

START, END = "<!-- written by make_control.py: {} -->\n", "<!-- to here -->\n"
DOCS = Path(__file__).parent
PLANT = "coupled"


def main(region: Path, robustness: Path) -> None:
    cases = json.loads(region.read_text(encoding="utf-8"))["cases"]
    own = [case for case in cases if case["model"] == PLANT]
    _put("region", [*_directions(own), "", *_random(cases)])
    _put("robustness", reaches(json.loads(robustness.read_text(encoding="utf-8"))))
    images = DOCS / "images"
    shutil.copy(region.parent / "random_coupled_1000_hz.png", images / "region.png")
    shutil.copy(robustness.parent / "errors_coupled.png", images / "robustness.png")


def _put(name: str, lines: list[str]) -> None:
    """Replace the lines between the marks of this name."""
    page, start = DOCS / "explanation" / "servoing_limits.md", START.format(name)
    before, rest = page.read_text(encoding="utf-8").split(start)
    table = "\n".join(lines) + "\n"
    page.write_text(before + start + table + END + rest.split(END, 1)[1], encoding="utf-8")


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
        "| gains | plant | control | random starts that converge |",
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
    main(Path(sys.argv[1]), Path(sys.argv[2]))
