"""Figures of the atlas of controlled vehicles: which numbers decide, the rule, and its judges."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from continuair.analysis.decoupling_rule import allowed, beyond
from continuair.analysis.shares import percent
from continuair.figures import style
from continuair.figures.atlas import DRIVEN, logit

Array = np.ndarray

COLOURS = {"bend": "#0072B2", "moment": "#009E73", "force": "#000000", "tip": "#D55E00"}
"""Colour of each excitation, as figures of `advise` have it."""

_STEPS = {
    "": "frequency,\ncoupling",
    "gravity_number": "and\ngravity",
    "gravity_number bandwidth": "and\nbandwidth",
    "gravity_number bandwidth mass_ratio": "and\nmass ratio",
}
_LEVELS = (0.0, 0.15, 0.25, 0.35, 0.5, 0.7, 1.0, 2.0)
_TYPICAL: dict[str, float] = {"mass_ratio": 0.03}
_GRAVITY = (0.02, 0.5)
"""Gravity numbers of the maps' rows: a stiff arm, and a soft one that hangs."""
_TICKS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8)
_CELLS = 60
_VEHICLE = "#D0006F"
_LIMITS = ("ruled_limit", "flown_limit")
_SPAN = (0.1, 3.0)
_AT, _NAMES = (0.12, 0.25, 0.5, 1.0, 2.5), ("none", "0.25", "0.5", "1", "all")


def numbers(summary: xr.Dataset) -> Figure:
    """Return a figure of the error's variance explained by a vehicle's numbers, in each loop."""
    titles = {"none": "nothing holds the hover", "position": "a position loop holds it"}
    with style.applied():
        figure = style.new_figure(height=2.3)
        for axes, (loop, title) in zip(
            figure.subplots(1, 2, sharey=True), titles.items(), strict=True
        ):
            for name, colour in COLOURS.items():
                shares = summary["explained"].sel(loop=loop, excitation=name, besides=list(_STEPS))
                axes.plot(np.maximum(shares, 0.0), "o-", color=colour, markersize=3, label=name)
            axes.set_xticks(range(len(_STEPS)), list(_STEPS.values()))
            axes.set(title=title, ylim=(-0.03, 1.03))
        axes.legend(title="load", title_fontsize=7, loc="lower right")
        figure.axes[0].set_ylabel("share of the error's variance\nthat is explained")
        style.head(figure, _finding(summary))
    return figure


def limits_map(
    summary: xr.Dataset,
    groups: Mapping[str, float] | None = None,
    *,
    label: str = "",
    tolerance: float = 0.02,
) -> Figure:
    """Return a figure of the frequency limit of decoupling, over bandwidth and coupling.

    groups: of a vehicle, with its loop's bandwidth. It is marked, and the maps are those of its
    gravity number and mass ratio; beyond the atlas's range they are marked as extrapolated. Without
    groups, two gravity numbers have a row each.
    """
    rows = [dict(groups)] if groups else [_TYPICAL | {"gravity_number": n} for n in _GRAVITY]
    with style.applied():
        figure = style.new_figure(height=1.0 + 1.35 * len(rows))
        grid = figure.subplots(len(rows), len(DRIVEN), sharex=True, sharey=True, squeeze=False)
        for line, row in zip(grid, rows, strict=True):
            for axes, name in zip(line, DRIVEN, strict=True):
                drawn = _map(axes, summary, name, row, tolerance)
                if groups:
                    _mark(axes, groups, label)
            line[0].set_ylabel(f"gravity number {row['gravity_number']:.2g}\ncoupling")
        for axes, title in zip(grid[0], DRIVEN.values(), strict=True):
            axes.set_title(title)
        for axes in grid[-1]:
            axes.set_xlabel("bandwidth / clamped fr.")
        bar = figure.colorbar(drawn, ax=grid, aspect=25, ticks=_LEVELS, spacing="uniform")
        bar.minorticks_off()
        bar.set_ticklabels(["0", *(f"{each:g}" for each in _LEVELS[1:])])
        bar.set_label("decouple up to\n(frequency / clamped fr.)")
        style.head(
            figure,
            "Up to which frequency decoupling errs by less than "
            f"{percent(tolerance)}, in a position loop",
            "What the rule says of the atlas's vehicles with a mass ratio of "
            f"{rows[0]['mass_ratio']:.2g}, over the bandwidth of the attitude and the coupling."
            + _guessed(summary, groups or {}, tolerance),
        )
    return figure


def judged(summary: xr.Dataset) -> Figure:
    """Return a figure of the rule's limit and the simulated one, of every test vehicle."""
    tolerance = float(summary["accepted"][0])
    ends = [float(each) for each in summary["frequency"][[0, -1]]]
    with style.applied():
        figure = style.new_figure(height=2.1)
        for axes, (name, title) in zip(
            figure.subplots(1, len(DRIVEN), sharex=True, sharey=True), DRIVEN.items(), strict=True
        ):
            one = summary.sel(excitation=name)
            ruled, flown = (_shown(one[each].to_numpy(), ends) for each in _LIMITS)
            says = ~np.isnan(one["ruled_limit"].to_numpy())
            good = flown >= ruled
            for chosen, colour in ((good, "#999999"), (~good, style.FAILED_COLOUR)):
                axes.plot(ruled[says & chosen], flown[says & chosen], ".", ms=2.5, color=colour)
            axes.plot(_SPAN, _SPAN, color="#000000", lw=0.8)
            wrong, of = (int(one[each][0]) for each in ("refuted", "answers"))
            axes.set_title(f"{title}\n{wrong} of {of} too high")
            axes.set(xscale="log", yscale="log", xlim=_SPAN, ylim=_SPAN, xlabel="rule's limit")
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_locator(FixedLocator(_AT))
                axis.set_minor_locator(NullLocator())
            axes.set_xticklabels(_NAMES)
            axes.set_yticklabels(_NAMES)
        figure.axes[0].set_ylabel(f"flown limit\n(tolerance {tolerance:.0%})")
        wrong, of = (int(summary[each].isel(accepted=0).sum()) for each in ("refuted", "answers"))
        style.head(
            figure,
            f"Of {of} limits that the rule gives vehicles it has not seen, {wrong} are too high",
            "Frequencies over the clamped one. Counted are flights at the rule's own limit and "
            "below; red: below the line, between the frequencies that all vehicles are flown at.",
        )
    return figure


def _finding(summary: xr.Dataset) -> str:
    """How far two numbers go in a loop, and four."""
    two, four = (
        100.0 * summary["explained"].sel(loop="position", besides=each).to_numpy()
        for each in ("", "gravity_number bandwidth")
    )
    return (
        f"In a loop, frequency and coupling explain {two.min():.0f} to {two.max():.0f} % of the "
        f"error; with gravity number and bandwidth it is {four.min():.0f} to {four.max():.0f} %"
    )


def write(summary: xr.Dataset, file: Callable[[str], Path]) -> None:
    """Write all figures as PNG, SVG and PDF; `file` gives the path of a name."""
    drawn = {
        "numbers": numbers(summary),
        "limits": limits_map(summary),
        "judged": judged(summary),
    }
    for name, figure in drawn.items():
        style.save(figure, name, file)


def _shown(limits: Array, ends: list[float]) -> Array:
    """Return limits as they are drawn: none below all frequencies flown, all of them above."""
    return np.clip(np.nan_to_num(limits, nan=0.0, posinf=np.inf), 0.8 * ends[0], 1.25 * ends[1])


def _map(axes: Any, summary: xr.Dataset, name: str, row: dict[str, float], tolerance: float) -> Any:
    """Draw the rule's limits of one load; return the meaning of the colours."""
    ends = summary["ends"]
    slow, fast = ends.sel(number="bandwidth").to_numpy()
    low, high = logit(ends.sel(number="coupling").to_numpy())
    x, y = np.geomspace(slow, fast, _CELLS), np.linspace(low, high, _CELLS)
    across, up = np.meshgrid(x, 1.0 / (1.0 + np.exp(-y)))
    at = {key: np.full(across.size, row[key]) for key in ("gravity_number", "mass_ratio")}
    at |= {"bandwidth": across.ravel(), "coupling": up.ravel()}
    found = allowed(summary, "position", at, tolerance)
    place = list(summary["excitation"].values).index(name)
    value = np.clip(np.nan_to_num(found[place], nan=0.0, posinf=np.inf), 0.0, _LEVELS[-1] - 1e-9)
    norm = BoundaryNorm(_LEVELS, 256)
    drawn = axes.pcolormesh(
        x,
        y,
        value.reshape(across.shape),
        cmap="YlGn",
        norm=norm,
        shading="nearest",
        rasterized=True,
    )
    axes.set_xscale("log")
    axes.set_xticks([0.2, 0.5, 1.0, 2.0, 4.0], ["0.2", "0.5", "1", "2", "4"])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yticks(logit(np.array(_TICKS)), [f"{each:g}" for each in _TICKS])
    axes.grid(visible=False)
    return drawn


def _guessed(summary: xr.Dataset, groups: Mapping[str, float], tolerance: float) -> str:
    """Return a note on a vehicle's numbers, or a tolerance, beyond those of the atlas."""
    said = [
        f"{name.replace('_', ' ')} of {value:.2g} (atlas: {low:.2g} to {high:.2g})"
        for name, value, (low, high) in beyond(summary, groups)
    ]
    least, most = float(summary["accepted"].min()), float(summary["accepted"].max())
    if not least <= tolerance <= most:
        kept = f"{percent(least)} to {percent(most)}"
        said.append(f"tolerance of {percent(tolerance)} (atlas: {kept})")
    return f" A guess, with a {' and a '.join(said)}." if said else ""


def _mark(axes: Any, groups: Mapping[str, float], label: str) -> None:
    place = (groups["bandwidth"], logit(groups["coupling"]))
    axes.plot(*place, "D", color=_VEHICLE, markersize=4, clip_on=False)
    axes.annotate(
        label, place, xytext=(4, 3), textcoords="offset points", fontsize=6, color=_VEHICLE
    )
