"""Write the tables of docs/explanation/sections.md and draw its figure, within minutes.

python docs/make_sections.py [sections] [strain]
"""

from __future__ import annotations

import sys
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np

import continuair as ca
from continuair.figures import style
from continuair.figures.sections import sections as figure
from continuair.studies import sections as study
from continuair.studies.tables import number
from continuair.sweeps.hardware import machine

DOCS = Path(__file__).parent
STARTS = {
    "sections": "<!-- written by make_sections.py -->\n",
    "strain": "<!-- written by make_sections.py: strain -->\n",
}
END = "<!-- to here -->\n"

STRAINS: dict[str, tuple[int, int | None]] = {
    "one arc": (1, None),
    "two arcs": (2, None),
    "four arcs": (4, None),
    "linear strain": (1, 1),
    "quadratic strain": (1, 2),
    "cubic strain": (1, 3),
}
"""Name -> equal sections, and order of their bending (None: arcs)."""

BEAM = (study.BEAM_CONSTANT, 22.034492)
"""ω l² √(μ/E I) of the first two modes of a clamped uniform beam."""

LOAD, TURNS = 5.0, 3
LEAST_RUNS, STEPS = 64, 500_000
"""Least number of flights that are timed at once, and about how many steps they take together."""


def main(parts: list[str]) -> None:
    if "sections" in parts:
        results = study.sections()
        style.save_as(figure(results), DOCS / "images" / "sections.png")
        _put("sections", _tables(results))
    if "strain" in parts:
        _put("strain", _strains())


def _put(part: str, lines: list[str]) -> None:
    """Replace the lines between the marks of this part."""
    page = DOCS / "explanation" / "sections.md"
    before, rest = page.read_text(encoding="utf-8").split(STARTS[part])
    after = rest.split(END, 1)[1]
    text = before + STARTS[part] + "\n".join(lines) + "\n" + END + after
    page.write_text(text, encoding="utf-8")


def _strains() -> list[str]:
    """Return the table of arcs and strains of the same arm."""
    lines = ["| arm | coordinates | first frequency | second | sag at 5 | decoupled tip |"]
    lines[-1] += " steps | time over one arc's |"
    lines.append("| --- |" + " ---: |" * 7)
    steps = {name: _steps(*kind) for name, kind in STRAINS.items()}
    times: dict[str, list[float]] = {name: [] for name in STRAINS}
    for _ in range(TURNS):
        for name, kind in STRAINS.items():
            times[name].append(_timed(*kind, max(LEAST_RUNS, STEPS // steps[name])))
    spent = {name: median(each) for name, each in times.items()}
    for name, (count, order) in STRAINS.items():
        vehicle, level = _rod(count, order), _rod(count, order, level=True)
        clamped = ca.modes(vehicle, base="clamped", gravity=0.0).frequencies[::2]
        over = [study.constant(each) / beam for each, beam in zip(clamped, BEAM, strict=False)]
        cells = [f"{each - 1.0:+.2%}" for each in over] + ["–"] * (len(BEAM) - len(over))
        sag = _sag(level) / study.elastica_sag(LOAD) - 1.0
        pair = ca.run_pairs(vehicle, study.swayed(vehicle), ["decoupled"], sample=0.01, rtol=1e-6)
        tip = float(pair["rmse_t_m"].sel(model="decoupled")[0]) / study.LENGTH
        lines.append(
            f"| {name} | {vehicle.layout.bends} | {' | '.join(cells)} | {100.0 * sag:+.2g}% | "
            f"{tip:.2e} | {steps[name]:,} | {style.short(spent[name] / spent['one arc'])} |"
        )
    return [
        *lines,
        "",
        f"Times are the median of {TURNS} turns, of the processor, of {LEAST_RUNS} and more equal "
        f"coupled flights in packs on one core of {machine()}, float64, Tsit5 with the default "
        "tolerance.",
    ]


def _rod(count: int, order: int | None, *, level: bool = False) -> ca.Vehicle:
    """Return the study's vehicle with an arm of arcs, or of a strain of that order."""
    fields: dict[str, Any] = study.cut(count, level=level).describe()
    if order is not None:
        for part in fields["arm"][0]["section"]:
            part["strain"] = {"bending": order}
    return ca.Vehicle(**fields)


def _sag(level: ca.Vehicle) -> float:
    """Return the sag of the level arm's tip over its length, at LOAD."""
    gravity = LOAD * study.STIFFNESS / (study.MASS_PER_LENGTH * study.LENGTH**3)
    still = ca.Scenario("level", ca.trim(level, gravity=gravity).q, duration=1e-5, gravity=0.0)
    flight = ca.simulate(level, still, sample=1e-5, variables=["tip_position"])
    return float(-flight["tip_position"].to_numpy()[0].ravel()[2] / study.LENGTH)


def _steps(count: int, order: int | None) -> int:
    """Return the steps of one flight, with everything compiled."""
    return int(_fly(count, order, LEAST_RUNS)["steps"][0])


def _timed(count: int, order: int | None, runs: int) -> float:
    """Return the processor's time of one flight of many [s]."""
    start = process_time()
    _fly(count, order, runs)
    return (process_time() - start) / runs


def _fly(count: int, order: int | None, runs: int) -> Any:
    """Return equal flights of the coupled model, on one thread."""
    vehicle = _rod(count, order)
    one = study.swayed(vehicle)
    many = one.replace(q=np.tile(np.asarray(one.q), (runs, 1)))
    return ca.simulate(vehicle, many, sample=0.01, variables=["tip_position"], threads=1)


def _tables(results: dict[str, Any]) -> list[str]:
    rows, beam, loads = results["rows"], results["beam"], results["loads"]
    heads = [f"sag at {load:g}" for load in loads]
    lines = [f"| sections | first, clamped | first, free | stiffest, free | {' | '.join(heads)} |"]
    lines.append("| --- |" + " ---: |" * (3 + len(loads)))
    for row in rows:
        sags = " | ".join(
            f"{sag:.4g} ({sag / true - 1.0:+.1%})"
            for sag, true in zip(row["sag"], beam["sag"], strict=True)
        )
        lines.append(
            f"| {row['count']} | {_off(row['clamped'][0], beam['clamped'])} | "
            f"{_off(row['free'][0], beam['free'])} | {row['free'][-1]:.4g} | {sags} |"
        )
    sags = " | ".join(f"{sag:.4g}" for sag in beam["sag"])
    lines.append(f"| true beam | {beam['clamped']:.4f} | {beam['free']:.4f} | ∞ | {sags} |")
    lines += ["", "| sections | tip, decoupled | tip, from four sections | step, RK4 [ms] |"]
    lines[-1] += " step, implicit [ms] | per step, RK4 [µs] | per step, implicit [µs] |"
    lines[-1] += " per second, RK4 [ms] | per second, implicit [ms] | tip, implicit |"
    lines.append("| --- |" + " ---: |" * 9)
    for row in rows:
        steps = " | ".join(number(1e3 * row["step"][name], 2) for name in row["step"])
        each = " | ".join(number(1e6 * row["step_s"][name], 2) for name in row["step"])
        whole = " | ".join(number(1e3 * row["flight_s"][name], 3) for name in row["step"])
        finest = "–" if row is rows[-1] else f"{row['from_finest']:.1e}"
        lines.append(
            f"| {row['count']} | {row['decoupled']:.1e} | {finest} | {steps} | {each} | {whole} | "
            f"{row['implicit_error']:.0e} |"
        )
    return [
        *lines,
        "",
        "Times are the shortest of 15 turns, of the processor, on one core of "
        f"{results['machine']}, float64.",
    ]


def _off(value: float, true: float) -> str:
    return f"{value:.4f} ({value / true - 1.0:+.1%})"


if __name__ == "__main__":
    main(sys.argv[1:] or list(STARTS))
