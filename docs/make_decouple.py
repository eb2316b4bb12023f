"""Draw the figures of docs/decouple.md from the atlas that the package ships."""

from __future__ import annotations

from pathlib import Path

from continuair.analysis.groups import place
from continuair.figures import atlas as figures
from continuair.figures import style
from continuair.studies.atlas.collapse import curves
from continuair.studies.atlas.summary import load
from continuair.vehicle.vehicle import load_vehicle

IMAGES = Path(__file__).parent / "images"


def main() -> None:
    summary = load()
    vehicles = {name: place(load_vehicle(name)) for name in ("paper", "slender")}
    drawn = {
        "map": figures.validity_map(summary, vehicles),
        "map_safe": figures.validity_map(summary, vehicles, quantile=0.9),
        "importance": figures.importance(summary),
        "collapse": figures.collapse(curves()),
    }
    for name, figure in drawn.items():
        style.save_as(figure, IMAGES / f"decouple_{name}.png")


if __name__ == "__main__":
    main()
