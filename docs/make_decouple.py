"""Write the answer for a controlled vehicle into docs/decouple.md, and draw the page's figures.

All of it comes from the atlases that the package ships.
"""

from __future__ import annotations

from pathlib import Path

from continuair.analysis.groups import place
from continuair.figures import atlas as figures
from continuair.figures import controlled, style
from continuair.studies.atlas.collapse import curves
from continuair.studies.atlas.page import block
from continuair.studies.atlas.summary import CONTROLLED_SUMMARY, load
from continuair.vehicle.vehicle import load_vehicle

DOCS = Path(__file__).parent
IMAGES = DOCS / "images"
START, END = "<!-- controlled -->\n", "<!-- to here -->\n"


def main() -> None:
    summary, loops = load(), load(shipped=CONTROLLED_SUMMARY)
    page = DOCS / "decouple.md"
    before, rest = page.read_text(encoding="utf-8").split(START)
    lines = "\n".join(block(loops))
    page.write_text(f"{before}{START}{lines}\n{END}{rest.split(END, 1)[1]}", encoding="utf-8")
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


if __name__ == "__main__":
    main()
