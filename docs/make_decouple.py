"""Write the limits of controlled vehicles into the pages on decoupling, and draw their figures.

All of it comes from the atlases that the package ships.
"""

from __future__ import annotations

from pathlib import Path

from continuair.analysis.groups import place
from continuair.figures import atlas as figures
from continuair.figures import controlled, style
from continuair.studies.atlas.collapse import curves
from continuair.studies.atlas.page import block, limits_by_kind
from continuair.studies.atlas.summary import CONTROLLED_SUMMARY, load
from continuair.vehicle.vehicle import load_vehicle

DOCS = Path(__file__).parent
IMAGES = DOCS / "images"
END = "<!-- to here -->\n"


def main() -> None:
    summary, loops = load(), load(shipped=CONTROLLED_SUMMARY)
    write("decouple.md", "kinds", limits_by_kind(loops))
    write("decouple_controlled.md", "controlled", block(loops))
    vehicles = {name: place(load_vehicle(name)) for name in ("paper", "slender")}
    drawn = {
        "limits": controlled.limits_map(loops),
        "numbers": controlled.numbers(loops),
        "judged": controlled.judged(loops),
        "map": figures.validity_map(summary, vehicles),
        "map_safe": figures.validity_map(summary, vehicles, quantile=0.9),
        "importance": figures.importance(summary),
        "collapse": figures.collapse(curves()),
    }
    for name, figure in drawn.items():
        style.save_as(figure, IMAGES / f"decouple_{name}.png")


def write(name: str, mark: str, lines: list[str]) -> None:
    """Write the lines behind a mark of a page."""
    page, start = DOCS / "explanation" / name, f"<!-- {mark} -->\n"
    before, rest = page.read_text(encoding="utf-8").split(start)
    text = "\n".join(lines)
    page.write_text(f"{before}{start}{text}\n{END}{rest.split(END, 1)[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
