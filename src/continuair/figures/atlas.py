"""Figures of the atlas, from its summary: maps of validity, importance, and collapse."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from continuair.figures import style

DRIVEN = {
    "force": "lateral force on the UAV",
    "moment": "moment on the UAV",
    "bend": "actuation of the arm",
    "tip": "lateral force at the tip",
}
FREE = {"release": "bent arm let go", "fall": "free fall"}
"""Excitations that have the frequency, and the damping ratio, along their map."""

_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.5)
_COLOURS = "YlOrRd"
_VEHICLE = "#0072B2"
_TICKS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9)


def validity_map(
    summary: xr.Dataset,
    vehicles: Mapping[str, Mapping[str, float]] | None = None,
    *,
    model: str = "decoupled",
    quantile: float = 0.5,
    frequencies: Mapping[str, float] | None = None,
) -> Figure:
    """Return the maps of every excitation: NRMSE in colour, the angle's error as dashed contours.

    vehicles: name -> groups, as `place` returns them, each drawn as a line at its coupling, and as
    a point where nothing oscillates; frequencies: excitation -> frequency over the clamped one, at
    which the lines get a mark. quantile: one of the summary's, over the groups that a map does not
    show.
    """
    with style.applied():
        figure = style.new_figure(height=4.3)
        grid = figure.subplots(2, 3, sharey=True)
        chosen = summary.sel(model=model, quantile=quantile)
        for axes, (name, title) in zip(grid.flat, (DRIVEN | FREE).items(), strict=True):
            drawn = _map(axes, chosen.sel(excitation=name), name in FREE)
            axes.set_title(title)
            for place, (label, groups) in enumerate((vehicles or {}).items()):
                _mark(axes, groups, name, label, place, (frequencies or {}).get(name))
        for axes in grid[:, 0]:
            axes.set_ylabel("coupling")
        bar = figure.colorbar(drawn, ax=grid, ticks=_LEVELS, aspect=40, extend="both")
        bar.minorticks_off()
        bar.set_ticklabels([f"{level:.0%}" for level in _LEVELS])
        bar.set_label(f"NRMSE of the tip, {model} ({_named(quantile)} of all other groups)")
        figure.supxlabel(
            "dashed: error of the tip's angle is 5, 10 and 20 % of the angle that the load makes "
            "without gravity, or the bend at the start",
            fontsize=7,
        )
    return figure


def importance(summary: xr.Dataset, model: str = "decoupled") -> Figure:
    """Return the importance of every group for NRMSE and angle: alone, and also with others."""
    names = [*DRIVEN, *FREE]
    with style.applied():
        figure = style.new_figure(height=2.6)
        for axes, error in zip(figure.subplots(1, 2, sharey=True), ("nrmse", "angle"), strict=True):
            one = summary.sel(model=model, error=error)
            shares = np.nan_to_num(one["total"].sel(excitation=names).to_numpy())
            axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
            for i, row in enumerate(one["total"].sel(excitation=names).to_numpy()):
                for j, value in enumerate(row):
                    if np.isfinite(value) and value >= 0.005:
                        colour = "white" if value > 0.6 else "black"
                        axes.text(j, i, f"{value:.2f}", ha="center", va="center", color=colour)
            groups = [str(g).replace("_", " ") for g in summary["group"].to_numpy()]
            axes.set_xticks(range(len(groups)), groups, rotation=40, ha="right")
            axes.set_yticks(range(len(names)), names)
            axes.grid(visible=False)
            axes.set_title({"nrmse": "NRMSE of the tip", "angle": "angle of the tip [rad]"}[error])
        figure.suptitle(
            "Share of the error's variance (in its logarithm) that a group has a part in"
        )
    return figure


def collapse(curves: xr.Dataset) -> Figure:
    """Return errors over frequency: of vehicles with the same groups, and of the same coupling.

    curves: same_groups and same_coupling (vehicle, frequency), and others (vehicle, frequency) of
    other couplings; length (vehicle,) [m] and inertia_ratio (vehicle,) for the legends.
    """
    with style.applied():
        figure = style.new_figure(height=2.5)
        left, right = figure.subplots(1, 2, sharey=True)
        x = curves["frequency"].to_numpy()
        markers = ("o", "s", "^", "x")
        for i, row in enumerate(curves["same_groups"].to_numpy()):
            size, label = 9 - 2.2 * i, f"l = {float(curves['length'][i]):.2g} m"
            left.plot(x, row, markers[i], markersize=size, mfc="none", label=label)
        for row in curves["others"].to_numpy():
            right.plot(x, row, color="#cccccc", linewidth=0.8)
        for i, row in enumerate(curves["same_coupling"].to_numpy()):
            mass, inertia = (float(curves[g][i]) for g in ("mass_ratio", "inertia_ratio"))
            label = f"mass ratio {mass:.2g}, inertia ratio {inertia:.2g}"
            right.plot(x, row, marker=markers[i], markersize=3, label=label)
        left.set_title("the same groups: vehicles of any size")
        right.set_title(f"the same coupling, {float(curves['coupling']):.2g}; grey: others")
        for axes in (left, right):
            axes.set(xscale="log", yscale="log", xlabel="frequency / clamped frequency")
            axes.legend()
        left.set_ylabel("NRMSE of the tip, decoupled")
    return figure


def write(summary: xr.Dataset, curves: xr.Dataset, file: Callable[[str], Path]) -> None:
    """Write all figures as PNG, SVG and PDF; `file` gives the path of a name."""
    figures = {
        "map": validity_map(summary),
        "map_safe": validity_map(summary, quantile=0.9),
        "importance": importance(summary),
        "collapse": collapse(curves),
    }
    for name, figure in figures.items():
        style.save(figure, name, file)


def _map(axes: Any, one: xr.Dataset, free: bool) -> Any:
    """Draw one excitation's map; return the meaning of its colours."""
    x = one["damping_edges" if free else "frequency_edges"].to_numpy()
    y = logit(one["coupling_edges"].to_numpy())
    value, angle = (np.ma.masked_invalid(one[f"{n}_map"].to_numpy()) for n in ("nrmse", "angle"))
    drawn = axes.pcolormesh(x, y, value, cmap=_COLOURS, norm=LogNorm(_LEVELS[0], _LEVELS[-1]))
    centre_x, centre_y = np.sqrt(x[1:] * x[:-1]), 0.5 * (y[1:] + y[:-1])
    full = np.isfinite(one["angle_map"].to_numpy()).all()
    if full and angle.min() < 0.2:
        lines = axes.contour(
            centre_x,
            centre_y,
            angle,
            levels=[0.05, 0.1, 0.2],
            colors="#333333",
            linewidths=0.8,
            linestyles="dashed",
        )
        axes.clabel(lines, fmt=lambda level: f"{level:.0%}", fontsize=5)
    axes.set_xscale("log")
    axes.set_xlim(x[0], x[-1])
    ticks = [t for t in (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0) if x[0] <= t <= x[-1]]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("damping ratio" if free else "frequency / clamped frequency")
    shown = [t for t in _TICKS if y[0] <= logit(t) <= y[-1]]
    axes.yaxis.set_major_locator(FixedLocator([float(logit(t)) for t in shown]))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_yticklabels([f"{t:g}" for t in shown])
    axes.set_ylim(y[0], y[-1])
    axes.grid(visible=False)
    return drawn


def _mark(
    axes: Any, groups: Mapping[str, float], name: str, label: str, place: int, at: float | None
) -> None:
    """Draw a vehicle on a map; where it lies beyond the map's edge, a triangle points there."""
    low, high = axes.get_ylim()
    y = float(np.clip(logit(groups["coupling"]), low, high))
    left, right = axes.get_xlim()
    if name in FREE:
        at = groups["damping_ratio"]
    else:
        axes.axhline(y, color=_VEHICLE, linewidth=1.2)
    if at is not None:
        shape = "<" if at < left else ">" if at > right else "D"
        axes.plot(np.clip(at, left, right), y, shape, color=_VEHICLE, markersize=4, clip_on=False)
    if name == "force":
        text = {"xytext": (2, 2 if place % 2 == 0 else -7), "textcoords": "offset points"}
        axes.annotate(label, (left, y), color=_VEHICLE, fontsize=6, **text)


def logit(share: Any) -> Any:
    """Return log(s / (1 - s)), the scale on which couplings are drawn."""
    return np.log(np.asarray(share) / (1.0 - np.asarray(share)))


def _named(quantile: float) -> str:
    return "median" if quantile == 0.5 else f"{quantile:.0%} quantile"
