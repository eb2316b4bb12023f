"""Write docs/explanation/trust_claims.md and the figure of trust.md.

python docs/make_trust.py verify.json [docs]
"""

from __future__ import annotations

import json
import math
import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from itertools import groupby
from pathlib import Path
from typing import Any

from continuair.figures import style

ROOT = Path(__file__).parent.parent
FIGURE = "images/trust.png"
ENGINES = ("continuair", "warp-lang", "numpy", "scipy", "sympy", "mujoco", "soromox", "jax")
ENGINES += ("pyelastica", "machinevision-toolbox-python")
ORDER = (
    "soromox",
    "soromox_strain",
    "soromox_tendons",
    "mujoco_statics",
    "mujoco_flight",
    "pyelastica",
    "scipy",
    "sympy",
)
ORDER += ("visp", "machinevision")

HEAD = """# Which claims were compared with other engines?

{counts} `make verify` installs the engines, runs every comparison, and writes this page and
`verify.json`; every figure comes from that run. [Trust](trust.md) says what follows.

* *Pass*: the figure reached differs from what the source says by no more than the tolerance.
* *Miss*: it differs by more. A miss stays on the page.
* *Measured*: a distance between models, not an error of this package; it has no tolerance.

Figures without a unit are relative, or pure numbers. To follow one, name its test:
`.venv/bin/pytest tests/oracles/test_soromox.py -k mass_matrix` prints what it reaches. The tables
of convergence behind some claims are in `verify.json`.

Versions: {versions}. Machine: {machine}.
"""


def main(path: Path, docs: Path = ROOT / "docs") -> None:
    entries = sorted(json.loads(path.read_text(encoding="utf-8")), key=place)
    draw(entries, docs / FIGURE)
    text = [head(entries)]
    for file, group in groupby(entries, key=lambda e: e["test"].split("::")[0]):
        text.append(section(file, list(group)))
    page = docs / "explanation" / "trust_claims.md"
    page.write_text("\n".join(text), encoding="utf-8")


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
    )


def section(file: str, entries: list[dict[str, Any]]) -> str:
    lines = [
        f"## {entries[0]['about']}",
        "",
        f"`.venv/bin/pytest {file}` ({sources(entries)})",
        "",
        "| claim | test | tolerance | reached | verdict |",
        "| --- | --- | --- | --- | --- |",
    ]
    # Of many claims that have one remark it is written once.
    remarks: list[str] = []
    for entry in entries:
        mark = ""
        for remark in filter(None, (entry["known_miss"], entry["note"])):
            if remark not in remarks:
                remarks.append(remark)
            mark += f" [{remarks.index(remark) + 1}]"
        cells = [entry["claim"] + mark, f"`{test(entry)}`"]
        cells += [tolerance(entry), reached(entry), verdict(entry)]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    if remarks:
        lines += ["", *(f"{i}. {remark.rstrip('.')}." for i, remark in enumerate(remarks, 1))]
    return "\n".join([*lines, ""])


def sources(entries: list[dict[str, Any]]) -> str:
    return "; ".join(dict.fromkeys(e["source"] for e in entries))


def test(entry: dict[str, Any]) -> str:
    """The test's name, as -k takes it."""
    return str(entry["test"].split("::")[-1].split("[")[0].removeprefix("test_"))


def verdict(entry: dict[str, Any]) -> str:
    if entry["pass"] is None:
        return "not run" if entry["reached"] is None else "measured"
    return "pass" if entry["pass"] else "**miss**"


def tolerance(entry: dict[str, Any]) -> str:
    if entry["tolerance"] is None:
        return "–"
    allowed = f"{entry['tolerance']:g}{unit(entry)}"
    return f"{resolved(entry, entry['expected'])} ± {allowed}" if entry["expected"] else allowed


def reached(entry: dict[str, Any]) -> str:
    value = entry["reached"]
    if value is None or isinstance(value, str):
        return value or "–"
    shown = resolved(entry, value) if entry["expected"] else f"{value:.3g}"
    return shown + unit(entry)


def resolved(entry: dict[str, Any], value: float) -> str:
    """A figure to one digit more than its tolerance."""
    return f"{value:.{math.ceil(-math.log10(entry['tolerance'])) + 1}f}"


def unit(entry: dict[str, Any]) -> str:
    return f" {entry['unit']}" if entry["unit"] else ""


def draw(entries: list[dict[str, Any]], path: Path) -> None:
    """The convergence to links held in a circular arc, and the distance from a true beam."""
    tables = {e["test"].split("::test_")[-1]: e["table"][1] for e in entries if e["table"]}

    def curve(axes: Any, name: str, column: int, label: str, dash: str) -> None:
        rows = [(r[0], r[column]) for r in tables.get(name, []) if isinstance(r[0], (int, float))]
        x, y = zip(*rows, strict=True) if rows else ((), ())
        axes.loglog(x, y, "k" + dash, marker="o", markersize=3, label=label)

    with style.applied():
        figure = style.new_figure(height=2.6)
        links, beam = figure.subplots(1, 2)
        held = "of_links_held_in_a_circular_arc"
        curve(links, f"accelerations_{held}", 1, "accelerations, relative", "-")
        curve(links, f"flight_{held}[tumbling]", 1, "tip within 1 s, tumbling [m]", "--")
        curve(links, f"flight_{held}[A]", 1, "tip within 1 s, Test A [m]", ":")
        curve(beam, "slow_and_fast_bend", 2, "clamped: tip (PyElastica)", "-")
        curve(beam, "base_motion_under_a_pure_couple", 1, "free: UAV (MuJoCo)", "--")
        links.set(xlabel="links N", ylabel="difference from continuair", ylim=(None, 10))
        beam.set(xlabel="duration of the bend [first periods]", ylabel="distance / excursion")
        for axes, ticks in ((links, [8, 16, 32, 64]), (beam, [0.5, 1, 2, 5, 10, 20])):
            axes.set_xticks(ticks, labels=[f"{tick:g}" for tick in ticks])
            axes.minorticks_off()
            axes.legend()
        style.save_as(figure, path)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
