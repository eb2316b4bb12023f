"""Draw the figures of the page on sensitivity, and write how its errors scatter, from the study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from amiri2026.figures import sensitivity as figures
from amiri2026.sensitivity.report import closer_share, neighbour_ratio
from amiri2026.sensitivity.study import sensitivity
from continuair.figures import style
from continuair.vehicle.vehicle import load_vehicle

DOCS = Path(__file__).parent
START, END = "<!-- written by make_sensitivity.py -->\n", "<!-- to here -->\n"


def main() -> None:
    vehicle = load_vehicle("paper")
    study, hertz = (sensitivity(vehicle, hertz=hertz) for hertz in (False, True))
    drawn = {
        "sensitivity_paths": figures.paths(study.results, study.datasets),
        "sensitivity_errors": figures.errors(study.results),
    }
    for name, figure in drawn.items():
        with style.applied():
            figure.savefig(DOCS / "images" / f"{name}.png", dpi=110)
    page = DOCS / "explanation" / "sensitivity.md"
    before, rest = page.read_text(encoding="utf-8").split(START)
    after = rest.split(END, 1)[1]
    table = "\n".join(_table(study.results, hertz.results)) + "\n"
    page.write_text(before + START + table + END + after, encoding="utf-8")


def _table(results: dict[str, Any], hertz: dict[str, Any]) -> list[str]:
    """How far the error scatters, and how often `independent` is closer, by both readings of f."""
    lines: list[str] = []
    for title, value in (
        ("Largest factor between the errors at neighbouring values of a sweep", neighbour_ratio),
        ("Share of the values at which `independent` is closer than `decoupled`", closer_share),
    ):
        lines += [f"{title}:", "", f"| reading | {' | '.join(results['sweeps'])} |"]
        lines.append("|---|" + "---:|" * len(results["sweeps"]))
        for reading, found in (("$\\sin ft$", results), ("$\\sin 2\\pi ft$", hertz)):
            cells = " | ".join(f"{value(sweep):.2g}" for sweep in found["sweeps"].values())
            lines.append(f"| {reading} | {cells} |")
        lines.append("")
    return lines[:-1]


if __name__ == "__main__":
    main()
