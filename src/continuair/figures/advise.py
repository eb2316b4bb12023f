"""The advice as a figure: error over frequency, and DS over the target's speed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullFormatter

from continuair.figures import style
from continuair.figures.atlas import validity_map

_SPEEDS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
_COLOURS = {"bend": "#0072B2", "moment": "#009E73", "force": "#000000", "tip": "#D55E00"}


def advice(results: dict[str, Any]) -> Figure:
    """Return error of the decoupled model over frequency, and |DS| over the target's speed."""
    periodic = {
        name: part["models"]["decoupled"]
        for name, part in results["excitations"].items()
        if "hz" in part["models"]["decoupled"]
    }
    panels = bool(periodic) + bool(results["tracking"])
    with style.applied():
        figure = style.new_figure(
            width=style.PAGE_WIDTH if panels > 1 else style.COLUMN_WIDTH, height=2.7
        )
        axes = list(figure.subplots(1, max(panels, 1), squeeze=False)[0])
        if periodic:
            _errors(axes.pop(0), results, periodic)
        if results["tracking"]:
            _tracking(axes.pop(0), results)
        figure.suptitle(
            f"Decoupling {style.plain(results['vehicle']['name'])}", fontsize=9, x=0.01, ha="left"
        )
    return figure


def write(results: dict[str, Any], atlas: xr.Dataset, file: Callable[[str], Path]) -> None:
    """Write the advice, and the place of a vehicle with [arm] on an atlas, as PNG, SVG and PDF."""
    style.save(advice(results), "advise", file)
    if not isinstance(results["vehicle"]["arm"], dict):
        return
    place = {style.plain(results["vehicle"]["name"]): results["groups"]}
    style.save(validity_map(atlas, place), "atlas", file)


def _errors(axes: Any, results: dict[str, Any], periodic: dict[str, Any]) -> None:
    for name, entry in periodic.items():
        axes.plot(entry["hz"], entry["errors"], label=name, color=_COLOURS[name], lw=1.2)
    axes.axhline(results["tolerance"], color=style.PAPER_COLOUR, lw=1.0, ls="--")
    axes.axvline(results["clamped_hz"], color=style.PAPER_COLOUR, lw=0.8, ls=":")
    axes.set(xscale="log", yscale="log", xlabel="frequency [Hz] (dotted: clamped bending)")
    axes.set_ylabel("error: RMSE / l, angle [rad]\n(dashed: tolerance)")
    axes.legend(title="excitation", title_fontsize=7)


def _tracking(axes: Any, results: dict[str, Any]) -> None:
    for task, part in results["tracking"].items():
        for model, entry in part["models"].items():
            properties = style.MODELS[model]
            axes.plot(entry["speed_m_s"], entry["ds_px"], label=f"{task}, {model}", **properties)
    axes.axhline(results["pixels"], color=style.PAPER_COLOUR, lw=1.0, ls="--")
    axes.set(xscale="log", yscale="log", xlabel="largest speed of the target [m/s]")
    axes.xaxis.set_major_locator(FixedLocator(_SPEEDS))
    axes.xaxis.set_major_formatter(FixedFormatter([f"{speed:g}" for speed in _SPEEDS]))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("largest |DS| after 2 s [px]\n(dashed: tolerance)")
    axes.legend()
