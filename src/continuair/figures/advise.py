"""The advice as a figure: error over frequency, and DS over the target's speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullFormatter

from continuair.figures import style
from continuair.figures.atlas import validity_map
from continuair.figures.controlled import limits_map

_SPEEDS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
_COLOURS = {"bend": "#0072B2", "moment": "#009E73", "force": "#000000", "tip": "#D55E00"}


def advice(results: dict[str, Any]) -> Figure:
    """Return the error of the decoupled model over frequency, and |DS| over the target's speed."""
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
            f"Decoupling {style.plain(results['vehicle']['name'])}, "
            f"loop: {results['loop']['name']}",
            fontsize=9,
            x=0.01,
            ha="left",
        )
    return figure


def write(results: dict[str, Any], atlas: xr.Dataset, file: Callable[[str], Path]) -> None:
    """Write the advice, and the place of a vehicle with [arm] on an atlas, as PNG, SVG and PDF."""
    style.save(advice(results), "advise", file)
    if not isinstance(results["vehicle"]["arm"], dict):
        return
    style.save(placed(results, atlas), "atlas", file)


def placed(results: dict[str, Any], atlas: xr.Dataset) -> Figure:
    """Return the maps of an atlas with the vehicle, marked at the limits that were found for it.

    A limit below or above all frequencies tried has no mark, as it has none on the other figure.
    atlas: of controlled vehicles for a position loop: there the rule's limits are the colour.
    """
    label = style.plain(results["vehicle"]["name"])
    if results["loop"]["name"] == "position":
        return limits_map(atlas, results["groups"], label=label, tolerance=results["tolerance"])
    place = {label: results["groups"]}
    limits = {
        name: part["models"]["decoupled"]["limit_hz"] / results["clamped_hz"]
        for name, part in results["excitations"].items()
        if _marked(part["models"]["decoupled"])
    }
    figure = validity_map(atlas, place, frequencies=limits)
    figure.suptitle(
        "The maps are of flights without a loop; diamonds over frequency: limits of this vehicle, "
        f"loop: {results['loop']['name']}",
        fontsize=7,
        x=0.01,
        ha="left",
    )
    return figure


def _marked(entry: dict[str, Any]) -> bool:
    return entry["limit_hz"] is not None and math.isfinite(entry["limit_hz"])


def _errors(axes: Any, results: dict[str, Any], periodic: dict[str, Any]) -> None:
    for name, entry in periodic.items():
        colour = _COLOURS[name]
        axes.plot(entry["hz"], entry["errors"], label=name, color=colour, lw=1.2)
        if _marked(entry):
            at = entry["errors"][entry["hz"].index(entry["limit_hz"])]
            axes.plot(entry["limit_hz"], at, "D", color=colour, markersize=4)
    axes.axhline(results["tolerance"], color=style.PAPER_COLOUR, lw=1.0, ls="--")
    axes.axvline(results["clamped_hz"], color=style.PAPER_COLOUR, lw=0.8, ls=":")
    axes.set(xscale="log", yscale="log", xlabel="frequency [Hz] (dotted: clamped bending)")
    axes.set_ylabel("error: RMSE / l, angle [rad]\n(dashed: tolerance; diamonds: limits)")
    axes.legend(title="excitation", title_fontsize=7)


def _tracking(axes: Any, results: dict[str, Any]) -> None:
    for task, part in results["tracking"].items():
        for model, entry in part["models"].items():
            properties = style.MODELS[model]
            axes.plot(entry["speed_m_s"], entry["ds_px"], label=f"{task}, {model}", **properties)
    axes.axhline(results["pixels"], color=style.PAPER_COLOUR, lw=1.0, ls="--")
    axes.set(xscale="log", yscale="log", xlabel="largest speed of the target [m/s]")
    drawn = [value for line in axes.lines[:-1] for value in line.get_ydata()]
    if not any(math.isfinite(value) and value > 0.0 for value in drawn):
        # Logarithmic axes need numbers to show.
        axes.set(
            xlim=_SPEEDS[:: len(_SPEEDS) - 1],
            ylim=(0.1 * results["pixels"], 10.0 * results["pixels"]),
        )
        lost = all(math.isnan(part["rms_px"]) for part in results["tracking"].values())
        says = "undecided" if lost else "decoupled flights are lost, or rounding decides them"
        axes.text(0.5, 0.35, says, transform=axes.transAxes, ha="center", va="center")
    axes.xaxis.set_major_locator(FixedLocator(_SPEEDS))
    axes.xaxis.set_major_formatter(FixedFormatter([f"{speed:g}" for speed in _SPEEDS]))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("largest |DS| after 2 s [px]\n(dashed: tolerance)")
    axes.legend()
