"""Figures of the open-loop study, from its datasets (leading dimension `model`) and results."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from continuair.analysis.metrics import geodesic_angle, samples, tip_euler
from continuair.figures import style


def motion(dataset: xr.Dataset, title: str = "") -> Figure:
    """Return tip position [m], tip attitude [deg] and bend [1/m] over time, a line per model."""
    with style.applied():
        figure = style.new_figure(height=4.6)
        grid = figure.subplots(3, 3, sharex=True)
        for model in dataset["model"].to_numpy():
            flight = dataset.sel(model=model)
            tip = samples(flight, "tip_position", "axis")
            degrees = np.degrees(tip_euler(flight))
            bend = samples(flight, "bend", "bend_axis")
            for column in range(3):
                style.line(grid[0, column], flight, tip[:, column], model)
                style.line(grid[1, column], flight, degrees[:, column], model)
            for column in range(2):
                style.line(grid[2, column], flight, bend[:, column], model)
            style.line(grid[2, 2], flight, np.linalg.norm(bend, axis=-1), model)
        for column, names in enumerate(_MOTION_LABELS):
            for row, name in enumerate(names):
                grid[row, column].set_ylabel(name)
                _widen_flat(grid[row, column])
            grid[2, column].set_xlabel("time [s]")
        style.finish(figure, grid[0, 0], title)
    return figure


_MOTION_LABELS = (
    ("tip x [m]", "tip roll [deg]", r"bend $k_x$ [1/m]"),
    ("tip y [m]", "tip pitch [deg]", r"bend $k_y$ [1/m]"),
    ("tip z [m]", "tip yaw [deg]", r"bend $|k|$ [1/m]"),
)


def differences(dataset: xr.Dataset, title: str = "") -> Figure:
    """Return distance [m] and geodesic angle [deg] of the tip from the coupled one over time."""
    with style.applied():
        figure = style.new_figure(height=2.4)
        left, right = figure.subplots(1, 2, sharex=True)
        coupled = dataset.sel(model="coupled")
        for model in dataset["model"].to_numpy():
            if model == "coupled":
                continue
            flight = dataset.sel(model=model)
            apart = samples(flight, "tip_position", "axis") - samples(
                coupled, "tip_position", "axis"
            )
            angle = geodesic_angle(
                samples(coupled, "tip_attitude", "quaternion"),
                samples(flight, "tip_attitude", "quaternion"),
            )
            style.line(left, flight, np.linalg.norm(apart, axis=-1), model)
            style.line(right, flight, np.degrees(angle), model)
        left.set_ylabel("tip distance from coupled [m]")
        right.set_ylabel("tip angle from coupled [deg]")
        for axes in (left, right):
            axes.set_xlabel("time [s]")
            axes.set_ylim(bottom=0)
        style.finish(figure, left, title)
    return figure


def overview(results: dict[str, Any]) -> Figure:
    """Return the table as bars: each model's metrics beside the numbers that the paper prints."""
    tests = list(results["tests"])
    models = [m for m in style.MODELS if m != "coupled" and m in results["tests"][tests[0]]]
    panels = (
        ("nrmse_t", "nrmse_t", "NRMSE$_T$ as printed [-]"),
        ("rmse_t_m", "nrmse_t", "RMSE of tip position [m]"),
        ("nrmse_r", "nrmse_r", "NRMSE$_R$ as printed [-]"),
        ("rmse_r_rad", "nrmse_r", "RMSE of Euler angles [rad]"),
    )
    with style.applied():
        figure = style.new_figure(height=4.4)
        for axes, (key, printed, label) in zip(figure.subplots(2, 2).flat, panels, strict=True):
            _bars(axes, results, tests, models, key, printed)
            axes.set_ylabel(label)
            axes.set_xticks(range(len(tests)), [f"Test {letter}" for letter in tests])
            axes.grid(axis="x", visible=False)
        style.model_legend(figure, figure.axes[0])
        figure.supxlabel(
            "The paper prints no parameters and one number per test and kind, shown in both "
            "readings; no match is claimed. Hatched: not converged.",
            fontsize=7,
        )
    return figure


def _bars(
    axes: Any, results: dict[str, Any], tests: list[str], models: list[str], key: str, printed: str
) -> None:
    width = 0.8 / (len(models) + 1)
    places = np.arange(len(tests)) - 0.4 + width / 2
    paper = [results["printed"][letter][printed] for letter in tests]
    axes.bar(places, paper, width, color=style.PAPER_COLOUR, label="paper, decoupled (printed)")
    for index, model in enumerate(models, start=1):
        entries = [results["tests"][letter][model] for letter in tests]
        heights = [e[key] if math.isfinite(e[key]) else 0.0 for e in entries]
        bars = axes.bar(
            places + index * width, heights, width, color=style.MODELS[model]["color"], label=model
        )
        for bar, entry in zip(bars, entries, strict=True):
            if not entry["converged"]:
                bar.set(hatch="////", facecolor="white", edgecolor=style.MODELS[model]["color"])


def write(
    results: dict[str, Any], datasets: dict[str, xr.Dataset], file: Callable[[str], Path]
) -> None:
    """Write all figures of the study as PNG and PDF; `file` gives the path of a name."""
    name = style.plain(results["vehicle"]["name"])
    for letter, dataset in datasets.items():
        title = f"Test {letter}, vehicle {name}"
        style.save(motion(dataset, title), f"test_{letter}_motion", file)
        if dataset.sizes["model"] > 1:
            style.save(differences(dataset, title), f"test_{letter}_differences", file)
    if any(model != "coupled" for model in next(iter(results["tests"].values()))):
        style.save(overview(results), "overview", file)


def _widen_flat(axes: Any) -> None:
    """Show a quantity that stays at one value as a level line, not as magnified rounding."""
    low, high = axes.get_ylim()
    if high - low < 1e-6:
        middle = (low + high) / 2
        axes.set_ylim(middle - 0.5, middle + 0.5)
