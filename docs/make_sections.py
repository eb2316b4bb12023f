"""Write the tables of docs/explanation/sections.md and draw its figure, within minutes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from continuair.figures import style
from continuair.figures.sections import sections as figure
from continuair.studies.sections import sections
from continuair.studies.tables import number

DOCS = Path(__file__).parent
START, END = "<!-- written by make_sections.py -->\n", "<!-- to here -->\n"


def main() -> None:
    results = sections()
    style.save_as(figure(results), DOCS / "images" / "sections.png")
    page = DOCS / "explanation" / "sections.md"
    before, rest = page.read_text(encoding="utf-8").split(START)
    after = rest.split(END, 1)[1]
    page.write_text(before + START + "\n".join(_tables(results)) + "\n" + END + after, "utf-8")


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
    main()
