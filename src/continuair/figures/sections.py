"""Effects of dividing one arm into more sections: modes, sag, decoupling, step and cost."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from continuair.figures import style

_BLACK, _ORANGE, _BLUE = (style.MODELS[name]["color"] for name in style.MODELS)
_ERRORS = {
    "clamped": ("o-", _BLACK, "first frequency, clamped"),
    "free": ("^:", _BLUE, "first frequency, free"),
    "sag": ("s--", _ORANGE, "sag, held level"),
}
_TIPS = {
    "decoupled": ("s--", _ORANGE, "decoupled from coupled"),
    "from_finest": ("o-", _BLACK, "coupled from that of most sections"),
}
_INTEGRATORS = {"RK4": ("o-", _BLACK, "RK4"), "implicit": ("s--", _BLUE, "implicit")}


def sections(results: dict[str, Any]) -> Figure:
    """Draw errors against the true beam and in a flight, step and cost over the sections."""
    rows = results["rows"]
    off = _off(results)
    tips = {name: np.array([100.0 * row[name] or np.nan for row in rows]) for name in _TIPS}
    steps, costs = (
        {name: np.array([1e3 * row[of][name] for row in rows]) for name in _INTEGRATORS}
        for of in ("step", "flight_s")
    )
    with style.applied():
        figure = style.new_figure(style.PAGE_WIDTH, 4.2)
        panels = figure.subplots(2, 2).ravel()
        counts = [row["count"] for row in rows]
        _lines(panels[0], counts, off, _ERRORS, "off the true beam [%]")
        _lines(panels[1], counts, tips, _TIPS, "tip in a flight, RMS [%]")
        _lines(panels[2], counts, steps, _INTEGRATORS, "step [ms]")
        _lines(panels[3], counts, costs, _INTEGRATORS, "time per second [ms]")
        gained = min(values[0] / values[1] for values in off.values())
        style.head(
            figure,
            f"Two sections are {gained:.0f} times nearer to the true beam than one; "
            f"{counts[-1]} sections cut RK4's step {steps['RK4'][0] / steps['RK4'][-1]:.0f}-fold",
            "One uniform arm of 0.6 m, damped by 3 % in its first mode, cut into equal sections. "
            "Tips in arm lengths; times of one core.",
        )
    return figure


def _off(results: dict[str, Any]) -> dict[str, Any]:
    """Return errors of frequencies and the sag under the smallest load [%], by their sizes."""
    rows, beam, small = results["rows"], results["beam"], int(np.argmin(results["loads"]))
    shares = {
        "clamped": [row["clamped"][0] / beam["clamped"] for row in rows],
        "free": [row["free"][0] / beam["free"] for row in rows],
        "sag": [row["sag"][small] / beam["sag"][small] for row in rows],
    }
    return {name: 100.0 * np.abs(np.array(share) - 1.0) for name, share in shares.items()}


def _lines(
    axes: Any, counts: list[int], values: dict[str, Any], looks: dict[str, Any], label: str
) -> None:
    for name, (marks, colour, words) in looks.items():
        axes.semilogy(counts, values[name], marks, ms=4, color=colour, label=words)
    axes.set_xticks(counts)
    axes.set_xlabel("sections")
    axes.set_ylabel(label)
    axes.yaxis.set_major_formatter("{x:g}")
    low, high = axes.get_ylim()
    # Room for the legend above what falls and rises.
    axes.set_ylim(low, high * (high / low) ** 0.35)
    axes.legend(loc="upper right" if values[next(iter(looks))][0] > 1.0 else "upper left")
