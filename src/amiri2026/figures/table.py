"""The figure of Table I: the paper's numbers beside ours, and the same flights in m and rad."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from continuair.figures import style

_WIDTH = 0.38
_OURS = style.MODELS["decoupled"]["color"]


def table(results: dict[str, Any]) -> Figure:
    """Return four panels: both rows of the table, printed and ours, and both in plain units."""
    plain = results["in_metres_and_radians"]
    position = [plain[test]["rmse_t_m"] for test in OPEN_LOOP_TESTS]
    angle = [plain[test]["angle_rad"] for test in OPEN_LOOP_TESTS]
    with style.applied():
        figure = style.new_figure(height=2.5)
        panels = figure.subplots(1, 4)
        for axes, row, name in zip(panels[:2], range(2), ("T", "R"), strict=True):
            _bars(axes, results["printed"][row], -_WIDTH / 2, style.PAPER_COLOUR, "paper")
            _bars(axes, results["ours"][row], _WIDTH / 2, _OURS, "vehicle table1")
            axes.set_title(f"NRMSE_{name} [-]", loc="left")
        _bars(panels[2], position, 0.0, _OURS, "")
        panels[2].set_title("tip position, RMSE [m]", loc="left")
        _bars(panels[3], angle, 0.0, _OURS, "")
        panels[3].set_title("tip angle, RMS [rad]", loc="left")
        for axes in panels:
            axes.set_xticks(range(len(OPEN_LOOP_TESTS)), OPEN_LOOP_TESTS)
            axes.grid(axis="x", visible=False)
            axes.set_xlabel("test")
        style.head(
            figure,
            _finding(results, position),
            "Left: Table I of Amiri et al. and the same metric of vehicle table1. Right: the same "
            "flights without normalisation.",
            handles=panels[0].containers,
        )
    return figure


def write(results: dict[str, Any], file: Callable[[str], Path]) -> None:
    """Write the figure as PNG, SVG and PDF."""
    style.save(table(results), "table", file)


def _bars(axes: Any, heights: list[float], offset: float, colour: str, label: str) -> None:
    places = np.arange(len(heights)) + offset
    axes.bar(places, heights, _WIDTH, color=colour, label=label)


def _finding(results: dict[str, Any], position: list[float]) -> str:
    """Return the title: the finding in the bars, with its numbers."""
    most = OPEN_LOOP_TESTS[int(np.argmax(position))]
    normalised = OPEN_LOOP_TESTS[int(np.argmax(results["ours"][0]))]
    return (
        f"Table I is met within a factor of {results['factor']:.2f}; position errs most in Test "
        f"{normalised} normalised, and in Test {most} in metres"
    )
