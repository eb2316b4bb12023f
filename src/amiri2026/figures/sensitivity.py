"""Figures of the sensitivity study: tip paths as in the paper's figure, and errors between."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from continuair.figures import curves, style
from continuair.figures.style import short
from continuair.kernels import REFERENCE

Array = NDArray[np.float64]

VALUES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of the values of a parameter, in ascending order (Okabe and Ito)."""

WILD = 2.0
"""Factor between the errors at neighbouring values from which on no line joins them."""

_WINDOW = 0.25
"""Length of the windows of the running RMS [s]."""

_DASHES = (0, (3, 1.5))
_SHOWN = "decoupled"


def paths(results: dict[str, Any], datasets: dict[str, xr.Dataset]) -> Figure:
    """Return the tips' paths in the world's xy plane [m], as Fig. 3 of Amiri et al. has them.

    A panel per parameter, and below it the distance between the two models over time. A colour is
    a value, a solid line the coupled model, a dashed one the decoupled.
    """
    rows = -(-len(datasets) // 3)
    with style.applied():
        figure = style.new_figure(height=3.7 * rows)
        grid = figure.subplots(
            2 * rows, min(3, len(datasets)), squeeze=False, height_ratios=[2.3, 1.0] * rows
        )
        largest, failed = {}, []
        for index, (name, dataset) in enumerate(datasets.items()):
            row, column = divmod(index, 3)
            labels = [entry["label"] for entry in results["sweeps"][name]["rows"]]
            above, below = grid[2 * row : 2 * row + 2, column]
            largest[name] = _sweep(above, below, dataset, labels)
            # Of values, as the panel's legend has them, not of places in a row.
            failed += [
                f"{name}: {told}" for told in curves.failures(dataset.assign_coords(run=labels))
            ]
            _title(above, index, name)
        for axes in grid.flat:
            axes.set_axis_on() if axes.has_data() else axes.set_axis_off()
        distances = grid[1::2].ravel()[: len(datasets)]
        low, high = (f(axes.get_ylim()[i] for axes in distances) for i, f in ((0, min), (1, max)))
        for axes in distances:
            axes.set_ylim(low, high)
        text = f"{_subtitle(results)} Apart: RMS distance of the tips, windows of {_WINDOW:g} s."
        told = [*failed, *_unconverged(results)]
        style.head(figure, _farthest(results, largest), text, told, _key())
    return figure


def errors(results: dict[str, Any]) -> Figure:
    """Return each model's horizontal error [m] over the parameters; rings: the values compared.

    Values between are joined by a line only where neighbours are within a factor of WILD, and no
    value between them was left out.
    """
    rows = -(-len(results["sweeps"]) // 3)
    with style.applied():
        figure = style.new_figure(height=2.0 * rows)
        for index, (axes, name) in enumerate(_panels(figure, results["sweeps"])):
            sweep = results["sweeps"][name]
            for model in sweep["between"]["rmse_xy_m"]:
                _errors(axes, sweep, model)
            _ended(axes, sweep)
            _title(axes, index, name)
            axes.set_xlabel(f"{name} [{sweep['units']}]")
            if index % 3 == 0:
                axes.set_ylabel("tip RMSE, xy [m]")
        curves.logarithmic(figure.axes)
        handles = [handle for axes in figure.axes for handle in style.model_handles(axes)]
        text = f"{_subtitle(results)} Rings: values whose paths are drawn."
        told = [*_failures(results), *_unconverged(results), *_left_out(results)]
        style.head(figure, _scatter(results), text, told, handles)
    return figure


def write(
    results: dict[str, Any], datasets: dict[str, xr.Dataset], file: Callable[[str], Path]
) -> None:
    """Write both figures as PNG, SVG and PDF; `file` gives the path of a name."""
    for name, figure in (("paths", paths(results, datasets)), ("errors", errors(results))):
        style.save(figure, name, file)


def _sweep(above: Any, below: Any, dataset: xr.Dataset, labels: list[str]) -> tuple[float, str]:
    """Draw the paths of a parameter's values, and how far apart they get; return the farthest."""
    farthest = (0.0, "")
    for run, label in enumerate(labels):
        flights = {m: dataset.sel(model=m).isel(run=run) for m in (REFERENCE, _SHOWN)}
        tips = {model: _xy(flight) for model, flight in flights.items()}
        for model, dashes in ((REFERENCE, "-"), (_SHOWN, _DASHES)):
            text = label if model == REFERENCE else f"_{label}"
            above.plot(*tips[model].T, color=VALUES[run], ls=dashes, lw=0.9, label=text)
            if curves.ending(flights[model]):
                curves.cross(above, tips[model][:, 0], tips[model][:, 1], VALUES[run])
        above.plot(*tips[REFERENCE][0], "o", ms=3.5, color="#333333", zorder=4)
        distance = np.linalg.norm(tips[_SHOWN] - tips[REFERENCE], axis=1)
        middle, (_, _, rms, _) = curves.windows(dataset["time"].to_numpy(), distance, _WINDOW)
        below.plot(middle, rms, color=VALUES[run], lw=1.1)
        if any(curves.ending(flight) for flight in flights.values()):
            curves.cross(below, middle, rms, VALUES[run])
        reached = float(np.nanmax(distance))
        farthest = max(farthest, (reached, label))
    above.set_aspect("equal", adjustable="datalim")
    above.set(xlabel="tip x [m]", ylabel="tip y [m]")
    below.set(xlabel="time [s]", ylabel="apart [m]", yscale="log")
    above.legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(labels),
        handlelength=0.8, columnspacing=0.8, handletextpad=0.3,
    )  # fmt: skip
    return farthest


def _xy(flight: xr.Dataset) -> Array:
    tip: Array = flight["tip_position"].sel(axis=["x", "y"]).transpose("time", "axis").to_numpy()
    return tip


def _errors(axes: Any, sweep: dict[str, Any], model: str) -> None:
    """One model's errors: points, joined where they follow each other, and the values compared."""
    x = sweep["scale"] * np.array(sweep["between"]["value"])
    y = np.array(sweep["between"]["rmse_xy_m"][model], float)
    colour = style.MODELS[model]["color"]
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.abs(np.log(y[1:] / y[:-1])) <= np.log(WILD)
    near &= np.array(sweep["between"]["follows"], bool)
    for first in np.flatnonzero(near):
        axes.plot(x[first : first + 2], y[first : first + 2], color=colour, lw=0.7, alpha=0.6)
    marker = {"decoupled": "o", "independent": "s"}[model]
    axes.plot(x, y, marker, ms=2.4, color=colour, label=model)
    compared = [(sweep["scale"] * row["value"], row["models"][model]) for row in sweep["rows"]]
    finite = [(value, entry["rmse_xy_m"]) for value, entry in compared if not entry["status"]]
    if finite:
        axes.plot(*np.transpose(finite), "o", ms=6, mfc="none", mew=1.0, color=colour)


def _ended(axes: Any, sweep: dict[str, Any]) -> None:
    """Crosses along the upper edge at values with a flight that ended early."""
    ended = set(sweep["between"]["ended_early"])
    ended |= {r["value"] for r in sweep["rows"] if any(e["status"] for e in r["models"].values())}
    if ended:
        axes.plot(
            sweep["scale"] * np.array(sorted(ended)), np.full(len(ended), 0.97), "x", ms=5, mew=1.5,
            color=style.FAILED_COLOUR, transform=axes.get_xaxis_transform(), clip_on=False,
            label="a flight failed", gid="failed",
        )  # fmt: skip


def _failures(results: dict[str, Any]) -> list[str]:
    """Return a sentence on the values with flights that ended early."""
    named = []
    for name, sweep in results["sweeps"].items():
        ended = set(sweep["between"]["ended_early"])
        ended |= {
            row["value"]
            for row in sweep["rows"]
            if any(entry["status"] for entry in row["models"].values())
        }
        if ended:
            values = ", ".join(f"{sweep['scale'] * value:.3g}" for value in sorted(ended))
            named.append(f"{name} {values} {sweep['units']}")
    return [f"× A flight ended early at {'; '.join(named)}."] if named else []


def _unconverged(results: dict[str, Any]) -> list[str]:
    """Return a sentence on the values compared with flights that have not converged."""
    named = [
        f"{name} {row['label']}"
        for name, sweep in results["sweeps"].items()
        for row in sweep["rows"]
        if any(not e["converged"] and not e["status"] for e in row["models"].values())
    ]
    return [f"Not converged: {', '.join(named)}."] if named else []


def _left_out(results: dict[str, Any]) -> list[str]:
    """Return a sentence on the values between that are left out, as they are not resolved."""
    named = [
        f"{len(sweep['between']['unresolved'])} of {name}"
        for name, sweep in results["sweeps"].items()
        if sweep["between"]["unresolved"]
    ]
    return [f"Left out, as they are not resolved: {', '.join(named)}."] if named else []


def _panels(figure: Figure, names: Any) -> list[tuple[Any, str]]:
    """Return three panels in a row."""
    rows = -(-len(names) // 3)
    panels = figure.subplots(rows, min(3, len(names)), squeeze=False, sharey=True).flat
    used = list(zip(panels, names, strict=False))
    for axes in panels[len(used) :]:
        axes.set_axis_off()
    return used


def _title(axes: Any, index: int, name: str) -> None:
    axes.set_title(
        f"({ascii_lowercase[index]}) {name}", loc="left", pad=18 if axes.get_legend() else 6
    )


def _key() -> list[Any]:
    grey = "#444444"
    return [
        Line2D([], [], color=grey, lw=1, ls="-", label="coupled"),
        Line2D([], [], color=grey, lw=1, ls=_DASHES, label="decoupled"),
        Line2D([], [], color="#333333", ls="", marker="o", ms=3.5, label="start"),
    ]


def _subtitle(results: dict[str, Any]) -> str:
    name = style.plain(results["vehicle"]["name"])
    values = {"paper": "the paper's values", "own": "values about its own"}[results["values"]]
    return (
        f"Vehicle {name}, {values}, a force of 100 N on the UAV with {results['reading_of_f']}, "
        "f = 10."
    )


def _farthest(results: dict[str, Any], largest: dict[str, tuple[float, str]]) -> str:
    """Return how far the decoupled tip deviates at values drawn, and between them."""
    most = max(largest, key=lambda name: largest[name][0])
    drawn = f"{short(largest[most][0])} m off where it is drawn ({most} {largest[most][1]})"
    rms = {
        (name, sweep["scale"] * value): float("nan" if error is None else error)
        for name, sweep in results["sweeps"].items()
        for value, error in zip(
            sweep["between"]["value"], sweep["between"]["rmse_xy_m"][_SHOWN], strict=True
        )
    }
    finite = {at: error for at, error in rms.items() if np.isfinite(error)}
    if not finite:
        return f"The decoupled tip gets up to {drawn}"
    (name, value), error = max(finite.items(), key=lambda item: item[1])
    units = results["sweeps"][name]["units"]
    return (
        f"The decoupled tip gets up to {drawn}; over all values it errs by up to "
        f"{short(error)} m RMS ({name} {short(value)} {units})"
    )


def _scatter(results: dict[str, Any]) -> str:
    """Return how much the decoupled error changes between neighbouring values."""
    factors = {}
    for name, sweep in results["sweeps"].items():
        error = np.array(sweep["between"]["rmse_xy_m"][_SHOWN], float)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = np.exp(np.abs(np.log(error[1:] / error[:-1])))
        finite = ratios[np.isfinite(ratios) & np.array(sweep["between"]["follows"], bool)]
        if finite.size:
            factors[name] = float(finite.max())
    if not factors:
        return "No two values can be compared"
    most = max(factors, key=factors.__getitem__)
    wild = sum(factor > WILD for factor in factors.values())
    if not wild:
        return f"Between values the decoupled error changes up to {short(factors[most])}-fold"
    return (
        f"From one value to the next the decoupled error changes up to {short(factors[most])}-fold "
        f"({most}), and more than {WILD:g}-fold in {wild} of {len(factors)} sweeps"
    )
