"""Write the table of the region of operation in docs/control.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import continuair as ca
from continuair.controllers.gain_files import load_gains
from continuair.equations.camera import over
from continuair.scenario.tracking_task import SETTINGS, equipped

START, END = "<!-- written by make_control.py -->\n", "<!-- to here -->\n"

BENDS = (0.0, 0.1)
PERIODS = (1e-3, 1e-4)
DURATION = 10.0
WELL = 0.1
"""Largest feature error in the last second of a flight that has ended well [px]."""

DEGREE = np.pi / 180.0
# Name -> coordinate, what one unit of the values is, the unit's name, and the values tried.
OFFSETS = {
    "yaw off by": (5, DEGREE, "°", (5, 10, 15, 20, 30, 45, 60)),
    "x off by": (0, 1.0, " m", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)),
    "roll off by": (3, DEGREE, "°", (2, 5, 8, 10, 12)),
    "too high by": (2, 1.0, " m", (0.5, 1, 2, 3)),
}


def main() -> None:
    lines = [f"| control period | start bend | {' | '.join(OFFSETS)} |"]
    lines.append("| --- | ---: |" + " --- |" * len(OFFSETS))
    for period in PERIODS:
        for bend in BENDS:
            cells = [_reach(name, bend, period) for name in OFFSETS]
            lines.append(f"| {1e3 * period:g} ms | {bend:g} 1/m | {' | '.join(cells)} |")
    page = Path(__file__).parent / "control.md"
    before, rest = page.read_text(encoding="utf-8").split(START)
    table = "\n".join(lines) + "\n"
    page.write_text(before + START + table + END + rest.split(END)[1], encoding="utf-8")


def _reach(name: str, bend: float, period: float) -> str:
    """The largest value up to which all flights end well, and the next one tried, if any."""
    coordinate, size, unit, values = OFFSETS[name]
    vehicle = equipped(ca.load_vehicle("paper"), SETTINGS["nominal"])
    target = ca.Target(ca.paths.hold())
    q = np.zeros((len(values), 8))
    q[:, :3] = over(vehicle, np.zeros(3), target.distance)
    q[:, 6] = bend
    q[:, coordinate] += size * np.array(values)
    scenario = ca.Scenario(
        name,
        q,
        controller=load_gains("paper").controller(vehicle),
        target=target,
        control_period=period,
        duration=DURATION,
    )
    flights = ca.simulate(vehicle, scenario, sample=0.01, variables=["feature_error"])
    late = flights["feature_error"].sel(time=slice(DURATION - 1.0, None))
    well = (flights["status"] == 0) & (np.abs(late).max(("time", "pixel")) < WELL)
    count = int(np.cumprod(well).sum())
    reached = f"{values[count - 1]:g}{unit}" if count else "none"
    return reached if count == len(values) else f"{reached} (not {values[count]:g}{unit})"


if __name__ == "__main__":
    main()
