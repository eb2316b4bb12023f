"""Write the table of docs/explanation/curvature.md."""

from __future__ import annotations

from pathlib import Path

from continuair.analysis.beam import curvature_error
from continuair.vehicle.vehicle import load_vehicle

START, END = "<!-- written by make_curvature.py -->\n", "<!-- to here -->\n"
_ROWS = {
    "first frequency, UAV free": "constant curvature",
    "first frequency, UAV free, decoupled": "decoupling",
}


def main() -> None:
    lines = ["| vehicle | error of | reference [rad/s] | model [rad/s] | error |"]
    lines.append("|---|---|---:|---:|---:|")
    for vehicle in ("paper", "slender"):
        found = curvature_error(load_vehicle(vehicle))
        for name, source in _ROWS.items():
            entry = found[name]
            numbers = f"{entry['reference']:.1f} | {entry['model']:.1f} | {entry['error']:+.1%}"
            lines.append(f"| `{vehicle}` | {source} | {numbers} |")
    page = Path(__file__).parent / "explanation" / "curvature.md"
    before, rest = page.read_text(encoding="utf-8").split(START)
    table = "\n".join(lines) + "\n"
    page.write_text(before + START + table + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
