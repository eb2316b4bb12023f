"""The advice as a figure: error over frequency, and DS over the target's speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedFormatter, FixedLocator, NullFormatter

from continuair.figures import curves, style
from continuair.figures.atlas import validity_map
from continuair.figures.controlled import COLOURS, MARKERS, limits_map

_SPEEDS = (0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0)
_TASKS = ("o", "s", "^", "v")
"""Markers of tracking tasks, in turn."""


def advice(results: dict[str, Any]) -> Figure:
    """Return errors of the simpler models over frequency, and |DS| over the target's speed."""
    periodic = {
        name: part["models"]
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
        style.head(
            figure,
            _finding(results, periodic),
            f"Vehicle {style.plain(results['vehicle']['name'])}, loop: {results['loop']['name']}. "
            "Dashed grey: tolerance; diamonds: limits of the decoupled model; dotted grey: clamped "
            "bending." + (" Bars: limits of 90 % of the draws." if "draws" in results else ""),
        )
    return figure


def within(x: list[float], errors: list[float | None], tolerance: float) -> float:
    """Return up to which x a curve is within a tolerance: NaN is nowhere, inf is all along.

    x ascends. An error that is None or NaN, as of flights that are lost, is beyond the tolerance.
    """
    values = np.array(errors, float)
    beyond = np.flatnonzero(~(values <= tolerance))
    if not beyond.size:
        return math.inf
    return float(x[beyond[0] - 1]) if beyond[0] else math.nan


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
    return validity_map(
        atlas,
        place,
        frequencies=limits,
        note="The maps are of flights without a loop; diamonds over frequency: limits of this "
        f"vehicle, loop: {results['loop']['name']}.",
    )


def _marked(entry: dict[str, Any]) -> bool:
    return entry["limit_hz"] is not None and math.isfinite(entry["limit_hz"])


def _finding(results: dict[str, Any], periodic: dict[str, Any]) -> str:
    """Up to where the decoupled curves are within the tolerances that are drawn."""
    words = []
    for name, models in periodic.items():
        entry = models["decoupled"]
        limit = within(entry["hz"], entry["errors"], results["tolerance"])
        words.append(f"{name} {_up_to(limit, 'frequencies', 'Hz')}")
    for task, part in results["tracking"].items():
        if entry := part["models"].get("decoupled"):
            limit = within(entry["speed_m_s"], entry["ds_px"], results["pixels"])
            words.append(f"{task} {_up_to(limit, 'speeds', 'm/s')}")
    if not words:
        return "Errors of the simpler models"
    return f"Decoupling is within tolerance for {', '.join(words)}"


def _up_to(limit: float, what: str, unit: str) -> str:
    if math.isnan(limit):
        return f"at none of the {what}"
    return f"at all {what}" if math.isinf(limit) else f"up to {style.short(limit)} {unit}"


def _errors(axes: Any, results: dict[str, Any], periodic: dict[str, Any]) -> None:
    for name, models in periodic.items():
        look = {"color": COLOURS[name], "marker": MARKERS[name], "ms": 2.5, "lw": 1.2}
        decoupled = models["decoupled"]
        axes.plot(decoupled["hz"], decoupled["errors"], label=name, **look)
        if (each := models.get("independent")) and "hz" in each:
            axes.plot(each["hz"], each["errors"], **look | {"ls": ":", "lw": 1.0, "marker": ""})
        limit = within(decoupled["hz"], decoupled["errors"], results["tolerance"])
        if math.isfinite(limit):
            at = decoupled["errors"][decoupled["hz"].index(limit)]
            axes.plot(limit, at, "D", color=COLOURS[name], mec="white", ms=5.5, zorder=4)
        band = results["draws"][name]["decoupled"]["limit_band_hz"] if "draws" in results else None
        if band is not None:
            bar = {"color": COLOURS[name], "marker": "|", "ms": 10.0, "mew": 1.5, "zorder": 5}
            axes.plot(band, 2 * [results["tolerance"]], **bar)
    axes.axhline(results["tolerance"], color=style.PAPER_COLOUR, lw=1.0, ls="--")
    axes.axvline(results["clamped_hz"], color=style.PAPER_COLOUR, lw=0.8, ls=":")
    curves.logarithmic([axes])
    axes.set(xscale="log", xlabel="frequency [Hz]")
    axes.set_ylabel("error: RMSE / l [-],\nangle [rad]")
    handles = [
        *axes.get_legend_handles_labels()[0],
        Line2D([], [], color="#444444", ls="-", label="decoupled"),
        Line2D([], [], color="#444444", ls=":", label="independent"),
    ]
    axes.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def _tracking(axes: Any, results: dict[str, Any]) -> None:
    for marker, (task, part) in zip(_TASKS, results["tracking"].items(), strict=False):
        for model, entry in part["models"].items():
            look = style.MODELS[model] | {"marker": marker, "ms": 3.0}
            values = np.array(entry["ds_px"], float)
            axes.plot(entry["speed_m_s"], values, label=f"{task}, {model}", **look)
    axes.axhline(results["pixels"], color=style.PAPER_COLOUR, lw=1.0, ls="--")
    curves.logarithmic([axes])
    axes.set(xscale="log", xlabel="largest speed of the target [m/s]")
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
    axes.set_ylabel("largest |DS| after 2 s [px]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
