"""Draw docs/images/hero.png: the coupled and the decoupled model of one vehicle during Test D."""

from __future__ import annotations

from pathlib import Path

from amiri2026.open_loop.study import open_loop
from continuair.figures import pictogram, style
from continuair.vehicle.vehicle import load_vehicle


def main() -> None:
    vehicle = load_vehicle("slender")
    dataset = open_loop(vehicle, "D", ["decoupled"]).datasets["D"]
    figure = pictogram.snapshots(dataset, vehicle, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    path = Path(__file__).parent / "images" / "hero.png"
    path.parent.mkdir(exist_ok=True)
    style.save_as(figure, path)


if __name__ == "__main__":
    main()
