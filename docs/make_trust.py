"""Write docs/trust.md and its figure from the claims of `make verify`: make_trust.py verify.json."""

from __future__ import annotations

import ast
import json
import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from itertools import groupby
from pathlib import Path
from typing import Any

from continuair.figures import style

DOCS = Path(__file__).parent
FIGURE = "images/trust.svg"
ENGINES = ("continuair", "warp-lang", "numpy", "scipy", "sympy", "mujoco", "soromox", "jax")
ENGINES += ("pyelastica", "machinevision-toolbox-python")
ORDER = ("soromox", "mujoco_statics", "mujoco_flight", "pyelastica", "scipy", "sympy")
ORDER += ("visp", "machinevision")

HEAD = """# Trust

What independent engines say about this package. `make verify` installs them, runs every comparison, and writes this
page and `verify.json`; nothing on it is typed by hand. {counts}

A claim *passes* if the figure reached differs from what the source says by no more than the tolerance. A *miss*
stays on the page. *Measured* is a distance between models, not an error: it has no tolerance. Quotients and
differences without a unit are relative.

Versions: {versions}. Machine: {machine}.

## What the comparisons show

* The equations are right: engines written by others give the same mass matrix, accelerations and flights
  (SoRoMoX, and MuJoCo's links held in a circular arc as their number grows).
* Constant curvature is a model, and no beam: its clamped first frequency is 27 % too high and its sag under a tip
  force a quarter too small, whatever computes it. It is good where the curvature is even, as under a couple
  that is slow beside the first mode, and bad where a wave runs along the arm.

![Left: differences from links held in a circular arc fall with the square of their number. Right: the
distance of constant curvature from a true beam by the duration of a bend]({figure})
"""


def main(path: Path) -> None:
    entries = sorted(json.loads(path.read_text(encoding="utf-8")), key=place)
    draw(entries)
    text = [head(entries)]
    for file, group in groupby(entries, key=lambda e: e["test"].split("::")[0]):
        text.append(section(Path(file), list(group)))
    (DOCS / "trust.md").write_text("\n".join(text), encoding="utf-8")


def place(entry: dict[str, Any]) -> int:
    """Where a claim's file stands; the order of claims within one is that of the tests."""
    name = Path(entry["test"].split("::")[0]).stem.removeprefix("test_")
    return ORDER.index(name) if name in ORDER else len(ORDER)


def head(entries: list[dict[str, Any]]) -> str:
    verdicts = [verdict(e).strip("*") for e in entries]
    found = [f"{verdicts.count(v)} {v}" for v in dict.fromkeys(verdicts)]
    versions = []
    for name in ENGINES:
        try:
            versions.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            versions.append(f"{name} not installed")
    return HEAD.format(
        counts=f"Claims: {', '.join(found)}.",
        versions=", ".join(versions),
        machine=f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}",
        figure=FIGURE,
    )


def section(file: Path, entries: list[dict[str, Any]]) -> str:
    docstring = ast.get_docstring(ast.parse((DOCS.parent / file).read_text(encoding="utf-8"))) or ""
    lines = [
        f"## {docstring.splitlines()[0].rstrip('.')}",
        "",
        f"`.venv/bin/pytest {file}` ({sources(entries)})",
        "",
        "| claim | tolerance | reached | verdict |",
        "| --- | --- | --- | --- |",
    ]
    remarks = []
    for entry in entries:
        mark = ""
        for remark in (entry["known_miss"], entry["note"]):
            if remark:
                remarks.append(remark)
                mark += f" [{len(remarks)}]"
        cells = [entry["claim"] + mark, tolerance(entry), reached(entry), verdict(entry)]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    if remarks:
        lines += ["", *(f"{i}. {remark}." for i, remark in enumerate(remarks, 1))]
    for entry in entries:
        if entry["table"]:
            lines += ["", *as_table(entry)]
    return "\n".join([*lines, ""])


def sources(entries: list[dict[str, Any]]) -> str:
    return "; ".join(dict.fromkeys(e["source"] for e in entries))


def verdict(entry: dict[str, Any]) -> str:
    if entry["pass"] is None:
        return "not run" if entry["reached"] is None else "measured"
    return "pass" if entry["pass"] else "**miss**"


def tolerance(entry: dict[str, Any]) -> str:
    if entry["tolerance"] is None:
        return "–"
    allowed = f"{entry['tolerance']:g}{unit(entry)}"
    return f"{entry['expected']:.6g} ± {allowed}" if entry["expected"] else allowed


def reached(entry: dict[str, Any]) -> str:
    value = entry["reached"]
    if value is None or isinstance(value, str):
        return value or "–"
    return number(value, 6 if entry["expected"] else 2) + unit(entry)


def unit(entry: dict[str, Any]) -> str:
    return f" {entry['unit']}" if entry["unit"] else ""


def number(value: Any, digits: int) -> str:
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def as_table(entry: dict[str, Any]) -> list[str]:
    columns, rows = entry["table"]
    test = entry["test"].split("::")[-1]
    return [
        f"*{entry['claim']}* (`{test}`)",
        "",
        "| " + " | ".join(columns) + " |",
        "| " + " | ".join("---" for _ in columns) + " |",
        *("| " + " | ".join(number(cell, 4) for cell in row) + " |" for row in rows),
    ]


def draw(entries: list[dict[str, Any]]) -> None:
    """The convergence to links held in a circular arc, and the distance from a true beam."""
    tables = {e["test"].split("::")[-1]: e["table"][1] for e in entries if e["table"]}
    with style.applied():
        figure = style.new_figure(height=2.6)
        links, beam = figure.subplots(1, 2)
        for name, label, dash in (
            ("test_accelerations_of_links_held_in_a_circular_arc", "accelerations, relative", "-"),
            ("test_flight_of_links_held_in_a_circular_arc", "tip after 0.5 s [m]", "--"),
        ):
            rows = [row for row in tables.get(name, []) if row[0] != "∞"]
            links.loglog(
                *zip(*rows, strict=True), "k" + dash, marker="o", markersize=3, label=label
            )
        for name, label, dash, column in (
            ("test_slow_and_fast_bend", "clamped, tip (PyElastica) [periods]", "-", 2),
            ("test_base_motion_under_a_pure_couple", "free, base (MuJoCo) [10 ms]", "--", 1),
        ):
            rows = tables.get(name, [])
            scale = 1.0 if column == 2 else 100.0
            beam.loglog(
                [scale * row[0] for row in rows],
                [row[column] for row in rows],
                "k" + dash,
                marker="o",
                markersize=3,
                label=label,
            )
        links.set(xlabel="links N", ylabel="difference from continuair")
        beam.set(xlabel="duration of the bend", ylabel="distance, relative to excursion")
        for axes in (links, beam):
            axes.legend()
        style.save(figure, [DOCS / FIGURE])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
