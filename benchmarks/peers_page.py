"""Turn the figures of benchmarks/compare.py into docs/explanation/peers.md and its plot."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

OURS = "ours"
NAMES = {
    OURS: "continuair",
    "mujoco_chain": "MuJoCo",
    "soromox_hub": "SoRoMoX",
    "pinocchio_tree": "Pinocchio",
    "crazyflow_rigid": "crazyflow",
    "rotorpy_rigid": "RotorPy",
    "machinevision_servo": "machinevision-toolbox",
}
# What a peer's unit is compared to: a case of ours, and how many of the peer's units make one.
AGAINST = {
    "mujoco_chain": ("coupled", 1),
    "soromox_hub": ("coupled", 1),
    "pinocchio_tree": ("coupled, batch", 4),
    "crazyflow_rigid": ("coupled, batch, float32", 1),
    "rotorpy_rigid": ("coupled, batch", 1),
    "machinevision_servo": ("servo loop", 1),
}
TARGETS = (
    ("mujoco_chain", "8-DoF chain", 10.0),
    ("soromox_hub", "floating hub", 300.0),
    ("soromox_hub", "floating hub, 12 points", 300.0),
    ("soromox_hub", "floating hub, two sections, batch", 500.0),
    ("soromox_hub", "floating hub, linear strain, batch", 50.0),
    ("machinevision_servo", "servo loop", 50.0),
)


@dataclass(frozen=True)
class Row:
    """One case: medians per unit [s] of the processor and of the clock, and over ours."""

    adapter: str
    name: str
    case: dict[str, Any]
    version: str
    cpu: float
    wall: float
    ratio: float
    against: str

    @property
    def label(self) -> str:
        return f"{NAMES[self.adapter]}: {self.name}"


def rows_of(result: dict[str, Any], threads: str, clock: str) -> list[Row]:
    """All cases at so many threads; ratios of the times on `clock`, round by round."""
    measured = result["measured"][threads]
    rows = []
    for adapter, peer in measured.items():
        version = next(iter(peer["versions"].values()))
        for name, case in peer["cases"].items():
            against, units = AGAINST.get(adapter, ("", 1))
            if adapter == OURS:
                against = _own_reference(name)
            if adapter != OURS and against == "coupled":
                against = _same_shape(name)
            times = {kind: _per_unit(case, kind) for kind in ("cpu", "wall")}
            reference = _per_unit(measured[OURS]["cases"][against], clock)
            ratio = float(np.median(units * times[clock] / reference))
            medians = {kind: float(np.median(values)) for kind, values in times.items()}
            rows.append(Row(adapter, name, case, version, **medians, ratio=ratio, against=against))
    return rows


def _same_shape(name: str) -> str:
    """Our case of the same arm, alone or in a batch."""
    shapes = (each for each in ("two sections", "linear strain") if each in name)
    shape = next(shapes, "coupled")
    return f"{shape}, batch" if "batch" in name else shape


def _own_reference(name: str) -> str:
    return name if name == "servo loop" else _same_shape(name)


def _per_unit(case: dict[str, Any], clock: str) -> np.ndarray:
    return np.array([taken[clock] for taken in case["rounds"]]) / case["work"]


def write(result: dict[str, Any], docs: Path) -> None:
    """Write the page and the plot."""
    one = rows_of(result, "1", "cpu")
    several = [threads for threads in result["measured"] if threads != "1"]
    parts = [_opening(result, one), _targets(one), _table(one, "cpu", "One thread")]
    parts += [_table(rows_of(result, n, "wall"), "wall", f"{n} threads") for n in several]
    parts += [_start_up(result), READING, _not_measured(result)]
    (docs / "explanation" / "peers.md").write_text("\n".join(part for part in parts if part))
    _plot(one, docs / "images" / "peers.png")


def _opening(result: dict[str, Any], rows: list[Row]) -> str:
    return f"""# How fast is it beside other engines?

{_faster(rows)} The engines do different work, so read [how the ratios are
meant](#how-to-read-it). `python benchmarks/compare.py`, a part of `make bench`, writes this page;
every figure of all rounds is in `benchmarks/peers.json`.

Measured on {result["when"]} on {result["machine"]}. Medians of {result["rounds"]} rounds. In a
round every case runs once, one after the other. Ratios are taken within rounds, so other work on
the machine affects all alike.

![Time per unit of work on one thread, continuair and its peers](../images/peers.png)
"""


def _targets(rows: list[Row]) -> str:
    lines = ["| aim | reached | |", "| --- | --- | --- |"]
    for adapter, name, aim in TARGETS:
        for row in rows:
            if (row.adapter, row.name) == (adapter, name):
                verdict = "pass" if row.ratio >= aim else "**miss**"
                what = f"{row.label} over ours, {row.against}: at least {aim:g}"
                lines.append(f"| {what} | {row.ratio:.3g} | {verdict} |")
    return "\n".join(lines) + "\n"


def _table(rows: list[Row], clock: str, title: str) -> str:
    meaning = {
        "cpu": "Processor time, so that a peer's waiting does not count.",
        "wall": "Time on the clock, with all cores at work; only what can use them.",
    }
    lines = [
        f"## {title}",
        "",
        f"{meaning[clock]} Over ours: the peer's time over that of continuair's case in the next "
        "column; above 1 continuair is faster.",
        "",
        "| engine | case | dtype | integrator, step [s] | µs per unit | units per second "
        "| over ours | our case |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        case, seconds = row.case, getattr(row, clock)
        step = f"{case['integrator']}, {case['step']:.2g}" if case["step"] else case["integrator"]
        ratio = f"{row.ratio:.3g}" + (" **(faster than ours)**" if _beats(row) else "")
        lines.append(
            f"| {NAMES[row.adapter]} {row.version} | {case['what']} | {case['dtype']} | {step} | "
            f"{1e6 * seconds:.3g} per {case['unit']} | {_short(1 / seconds)} | {ratio} | "
            f"{row.against} |"
        )
    return "\n".join(lines) + "\n"


def _beats(row: Row) -> bool:
    return row.adapter != OURS and row.ratio < 1.0


def _short(number: float) -> str:
    for size, letter in ((1e6, " M"), (1e3, " k")):
        if number >= size:
            return f"{number / size:.3g}{letter}"
    return f"{number:.3g}"


def _start_up(result: dict[str, Any]) -> str:
    lines = [
        "## Start-up and memory",
        "",
        "From starting Python until the first case of an engine has run once. Cold: without a "
        "cache of compiled code; warm: the second process. Import, building the model and "
        "compilation are included; memory is the process's maximum.",
        "",
        "| engine | first case | cold [s] | warm [s] | import [s] | build [s] | compile, cold [s] "
        "| compile, warm [s] | memory [MiB] |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for adapter, found in result["start_up"].items():
        cold, warm = found["cold"], found["warm"]
        stages = [warm.get("import"), warm.get("build"), cold.get("compile"), warm.get("compile")]
        shown = " | ".join("–" if s is None else f"{s:.2g}" for s in stages)
        lines.append(
            f"| {NAMES[adapter]} | {found['case']} | {cold['seconds']:.3g} | "
            f"{warm['seconds']:.3g} | {shown} | {found['memory_mib']:.0f} |"
        )
    return "\n".join(lines) + "\n"


def _faster(rows: list[Row]) -> str:
    faster = [f"{row.label} ({1 / row.ratio:.2g} times)" for row in rows if _beats(row)]
    if not faster:
        return "No peer took less time per unit of work than the case of ours beside it."
    return f"Faster than ours per unit of work: {'; '.join(faster)}."


READING = """## How to read it

* All engines but crazyflow and RotorPy move the preset `paper`, or a tree of as many degrees of
  freedom with its masses. A unit is one step of RK4, four evaluations of the equations of motion.
  Pinocchio's is one evaluation without an integrator, and its ratio counts four. Every engine
  takes many units in one call from Python, whose cost is included: some 10 ms for continuair,
  0.05 µs per step of a single run's 200,000.
* **MuJoCo** has no constant-curvature arm; a chain of N links on springs stands for it. Under a
  force at its tip one joint sinks by ¾ of a beam's deflection, as a constant-curvature arm does,
  so the chain of 8 degrees of freedom is equally accurate there. More joints come nearer to the
  beam; 32 of them also need a shorter step. Contacts and constraints are off.
* **SoRoMoX** integrates the same equations; a rigid segment is the hub. Measured against its own
  40 Gauss points, its default of five is off by 2e-7 while the arm bends less than half a circle
  and by 4e-5 near a full one; twelve are off by 1e-7 throughout, the rounding of its nodes.
  continuair's error is 3e-13 up to a full circle. RK4 is a `lax.scan` over `forward_dynamics`,
  compiled by XLA.
* **crazyflow** and **RotorPy** fly a rigid quadrotor without an arm, 6 degrees of freedom and
  rotors: less mechanics per step, and more of the rotors. crazyflow computes in float32 and is
  put beside our float32.
* **machinevision-toolbox** moves a free camera by the velocity that the law gives, without
  dynamics; ours is the whole closed loop.
* Batches of ours include the moments of every vehicle on the host.
"""


def _not_measured(result: dict[str, Any]) -> str:
    if not result["not_measured"]:
        return ""
    lines = ["## Not measured", ""]
    lines += [f"* {NAMES[name]}: {why}" for name, why in result["not_measured"].items()]
    return "\n".join(lines) + "\n"


def _plot(rows: list[Row], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = sorted(rows, key=lambda row: row.cpu, reverse=True)
    colours = ["#0b6e99" if row.adapter == OURS else "#9aa5ad" for row in rows]
    figure, axes = pyplot.subplots(figsize=(8.0, 0.32 * len(rows) + 0.9), layout="constrained")
    bars = axes.barh([row.label for row in rows], [1e6 * row.cpu for row in rows], color=colours)
    axes.bar_label(bars, [f"{1e6 * row.cpu:.3g}" for row in rows], padding=3, fontsize=8)
    axes.set_xscale("log")
    axes.margins(x=0.12)
    axes.set_xlabel("processor time per unit (RK4 step, evaluation, servo iteration) [µs]")
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(axis="y", labelsize=8)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


if __name__ == "__main__":
    root = Path(__file__).parents[1]
    source = Path(sys.argv[1]) if len(sys.argv) > 1 else root / "benchmarks" / "peers.json"
    write(json.loads(source.read_text()), root / "docs")
