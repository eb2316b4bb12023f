"""Figures of the sensitivity study: tip paths as in the paper's figure, and errors between."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from continuair.figures import style

VALUES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of the values of a parameter, in ascending order (Okabe and Ito)."""


def paths(results: dict[str, Any], datasets: dict[str, xr.Dataset]) -> Figure:
    """Return the tips' paths in the world's xy plane [m]: a panel per parameter.

    A colour is a value, a solid line the coupled model, a dashed one the decoupled.
    """
    with style.applied():
        figure = style.new_figure(height=5.6)
        for index, (axes, name) in enumerate(_panels(figure, datasets)):
            dataset = datasets[name]
            for run, row in enumerate(results["sweeps"][name]["rows"]):
                for model, dashes in (("coupled", "-"), ("decoupled", (0, (3, 1.5)))):
                    tip = dataset["tip_position"].sel(model=model).isel(run=run)
                    x, y = (tip.sel(axis=axis).to_numpy() for axis in "xy")
                    axes.plot(
                        x, y, color=VALUES[run], ls=dashes, lw=0.9,
                        label=row["label"] if model == "coupled" else f"{row['label']}, decoupled",
                    )  # fmt: skip
            _title(axes, index, name)
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_xlabel("tip x [m]")
            axes.set_ylabel("tip y [m]")
            handles = [line for line in axes.get_lines() if "," not in str(line.get_label())]
            axes.legend(handles=handles, loc="best", handlelength=1.2)
        _model_key(figure)
    return figure


def errors(results: dict[str, Any]) -> Figure:
    """Return each model's horizontal error [m] over the parameters; dots: the values compared."""
    with style.applied():
        figure = style.new_figure(height=4.2)
        for index, (axes, name) in enumerate(_panels(figure, results["sweeps"], sharey=True)):
            sweep = results["sweeps"][name]
            x = sweep["scale"] * np.array(sweep["between"]["value"])
            for model, column in sweep["between"]["rmse_xy_m"].items():
                axes.semilogy(x, column, label=model, **style.MODELS[model])
                axes.semilogy(
                    [sweep["scale"] * row["value"] for row in sweep["rows"]],
                    [row["models"][model]["rmse_xy_m"] for row in sweep["rows"]],
                    "o", ms=3.5, color=style.MODELS[model]["color"],
                )  # fmt: skip
            _title(axes, index, name)
            axes.set_xlabel(f"{name} [{sweep['units']}]")
            if index % 3 == 0:
                axes.set_ylabel("tip RMSE, xy [m]")
        style.model_legend(figure, figure.axes[0])
    return figure


def _panels(figure: Figure, names: Any, sharey: bool = False) -> list[tuple[Any, str]]:
    """Three panels in a row."""
    rows = -(-len(names) // 3)
    panels = figure.subplots(rows, min(3, len(names)), squeeze=False, sharey=sharey).flat
    used = list(zip(panels, names, strict=False))
    for axes in panels[len(used) :]:
        axes.set_axis_off()
    return used


def _title(axes: Any, index: int, name: str) -> None:
    axes.set_title(f"({'abcdef'[index]}) {name}", loc="left")


def _model_key(figure: Figure) -> None:
    grey = "#444444"
    handles = [
        Line2D([], [], color=grey, lw=1, ls="-", label="coupled"),
        Line2D([], [], color=grey, lw=1, ls=(0, (3, 1.5)), label="decoupled"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=2)


def write(
    results: dict[str, Any], datasets: dict[str, xr.Dataset], file: Callable[[str], Path]
) -> None:
    """Write both figures as PNG and PDF; `file` gives the path of a name."""
    for name, figure in (("paths", paths(results, datasets)), ("errors", errors(results))):
        style.save(figure, name, file)
