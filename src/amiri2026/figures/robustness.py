"""Figures of robustness: the error of a letter over how wrong the law is about its vehicle."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from amiri2026.figures.laws import LAWS
from continuair.figures import style
from continuair.kernels import OK

_COLUMNS = 4
_ABOVE, _HIGHEST = 1.4, 1.8
"""Where crosses stand, above all errors, and axes end, over the largest error."""
_CROSS: dict[str, Any] = {"marker": "x", "ls": "", "mew": 1.2}


def errors(results: dict[str, Any], model: str) -> Figure:
    """Return, per mistake, the RMS of the feature error over its value, a line for each law.

    A cross at the top is a flight that ended early.
    """
    cases = {case["law"]: case for case in results["cases"] if case["model"] == model}
    laws = [name for name in LAWS if name in cases]
    names = list(cases[laws[0]]["mistakes"])
    rows = -(-len(names) // _COLUMNS)
    with style.applied():
        figure = style.new_figure(height=0.35 + 1.15 * rows)
        panels = figure.subplots(rows, _COLUMNS, sharey=True, squeeze=False).ravel()
        top = _top(cases)
        for axes, name in zip(panels, names, strict=False):
            for place, law in enumerate(laws):
                beside = 0.02 * (place - 0.5 * (len(laws) - 1))
                _line(axes, law, cases[law], name, top, beside)
            unit = cases[laws[0]]["mistakes"][name]["unit"].strip()
            axes.set_title(f"{name} [{unit}]", loc="left")
            axes.set_yscale("log")
            axes.set_ylim(top=_HIGHEST * top)
        for axes in panels[len(names) :]:
            axes.remove()
        for axes in panels[::_COLUMNS]:
            if axes.figure is not None:
                axes.set_ylabel("RMS [px]")
        style.head(
            figure,
            _finding(cases, laws),
            f"Vehicle {style.plain(results['vehicle']['name'])}, {model} plant, letter "
            f"{results['letter']}. Borne: at most {results['borne_px']:g} px more than without.",
            handles=_key(laws),
        )
    return figure


def write(results: dict[str, Any], file: Callable[[str], Path]) -> None:
    """Write the figure of every plant as PNG, SVG and PDF."""
    for model in dict.fromkeys(case["model"] for case in results["cases"]):
        style.save(errors(results, model), f"errors_{model}", file)


def _line(axes: Any, law: str, case: dict[str, Any], name: str, top: float, beside: float) -> None:
    """The line of a law, and its crosses, moved by a share of the values beside those of others."""
    values = case["mistakes"][name]["values"]
    at = np.array([0.0, *(each["value"] for each in values)])
    rms = np.array([case["without"]["rms_px"], *(each["rms_px"] for each in values)])
    ended = np.array([case["without"]["status"], *(each["status"] for each in values)]) != OK
    look = LAWS[law]
    axes.plot(at, rms, marker=look["marker"], ms=2.5, lw=0.9, color=look["color"])
    tops = np.full(ended.sum(), _ABOVE * top)
    axes.plot(at[ended] + beside * at[-1], tops, ms=4, gid="failed", color=look["color"], **_CROSS)


def _top(cases: dict[str, Any]) -> float:
    """Return the largest error of all [px]."""
    found = [
        each["rms_px"]
        for case in cases.values()
        for mistake in case["mistakes"].values()
        for each in mistake["values"]
    ]
    return float(np.nanmax([1.0, *found]))


def _finding(cases: dict[str, Any], laws: list[str]) -> str:
    """Return a sentence on how many kinds of mismatch each law tolerates in all sizes tried."""
    words = []
    for law in laws:
        mistakes = cases[law]["mistakes"].values()
        if np.isnan(cases[law]["without"]["rms_px"]):
            words.append(f"{law} is lost without any")
            continue
        borne = sum(each["failed_at"] is None for each in mistakes)
        words.append(f"{borne} of {len(mistakes)} {law}")
    return f"Kinds of mistakes that are borne in every size tried: {', '.join(words)}"


def _key(laws: list[str]) -> list[Any]:
    lines = [
        Line2D([], [], marker=LAWS[law]["marker"], ms=3, color=LAWS[law]["color"], label=law)
        for law in laws
    ]
    return [*lines, Line2D([], [], ms=4, color="#333333", label="ended early, no RMS", **_CROSS)]
