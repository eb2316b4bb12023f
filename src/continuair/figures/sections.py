"""What cutting one arm into more sections changes: modes, sag, decoupling, step and cost."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from continuair.figures import style

_INTEGRATORS = {"rk4": ("o", "-", "RK4"), "implicit": ("s", "--", "implicit")}
_ERRORS = {
    "clamped": ("o", "-", "first frequency, clamped"),
    "free": ("^", "-", "first frequency, free"),
    "sag": ("s", "-", "sag"),
}
_BLACK, _ORANGE, _BLUE = (style.MODELS[name]["color"] for name in style.MODELS)
_COLOURS = dict(zip(_ERRORS, (_BLACK, _BLUE, _ORANGE), strict=True))


def sections(results: dict[str, Any]) -> Figure:
    """Draw errors against the true beam, the step and the cost over the number of sections."""
    rows, beam = results["rows"], results["beam"]
    counts = [row["count"] for row in rows]
    with style.applied():
        figure = style.new_figure(style.PAGE_WIDTH, 2.3)
        errors, steps, costs = figure.subplots(1, 3)
        small = int(np.argmin(results["loads"]))
        off = {
            "clamped": [row["clamped"][0] / beam["clamped"] - 1.0 for row in rows],
            "free": [row["free"][0] / beam["free"] - 1.0 for row in rows],
            "sag": [1.0 - row["sag"][small] / beam["sag"][small] for row in rows],
        }
        for name, (marker, line, label) in _ERRORS.items():
            shown = {"marker": marker, "ls": line, "ms": 4, "color": _COLOURS[name]}
            errors.semilogy(counts, 100.0 * np.array(off[name]), label=label, **shown)
        decoupled = [100.0 * row["decoupled"] for row in rows]
        errors.semilogy(
            counts, decoupled, "x:", ms=4, color=style.PAPER_COLOUR, label="decoupling, tip"
        )
        errors.set_ylabel("error [%]")
        for name, (marker, line, label) in _INTEGRATORS.items():
            shown = {"marker": marker, "ls": line, "ms": 4, "color": _BLACK, "label": label}
            shown["color"] = _BLACK if name == "rk4" else _BLUE
            steps.semilogy(counts, [1e3 * row["step"][name] for row in rows], **shown)
            costs.semilogy(counts, [1e3 * row["flight_s"][name] for row in rows], **shown)
        steps.set_ylabel("automatic step [ms]")
        costs.set_ylabel("time per second of flight [ms]")
        for axes in (errors, steps, costs):
            axes.set_xticks(counts)
            axes.set_xlabel("sections")
            axes.legend()
        style.head(
            figure,
            f"From one section to two, errors against the true beam fall {_fall(off):.0f}-fold; "
            f"RK4's step falls {rows[0]['step']['rk4'] / rows[-1]['step']['rk4']:.0f}-fold to four",
            "One uniform clamped arm of 0.6 m in equal sections. Decoupling: RMS of the tip's "
            "distance in a swayed hover, in arm lengths.",
        )
    return figure


def _fall(off: dict[str, list[float]]) -> float:
    """By how much errors fall from the first count to the second, at the least."""
    return min(values[0] / values[1] for values in off.values())
