"""Curves over time, one per model: with a cross where a flight failed, as a band where it is noisy.

A flight is a Dataset of one run: `time`, `status` and `end_time` beside its variables.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.metrics import samples
from continuair.figures import style
from continuair.flight.resolution import RESOLVED
from continuair.kernels.dynamics import REFERENCE
from continuair.kernels.step import NOT_FINITE, STATUS, UNSEEN
from continuair.vehicle.uncertain import band as share_of_draws

Array = NDArray[np.float64]

POINTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of feature points, in turn."""

WINDOW = 0.5
"""Length of the windows of a band [s]."""

BAND = (
    f"Bands: least to largest, lines: RMS, or mean of what has a sign, in windows of {WINDOW:g} s."
)
"""What figures with bands say of them."""

WORDS = STATUS | {NOT_FINITE: "diverged", UNSEEN: "target lost from view"}
"""How a flight ended, by status."""

_RANGE = 1e6
"""Largest value over the least one that a logarithmic axis shows."""

_WATCHED = ("tip_position", "bend", "strain")


def ending(flight: xr.Dataset) -> str:
    """Return how a flight failed, as in "ended at 3.2 s, diverged"; nothing if it did not.

    A flight without status and with values that are not finite has failed too.
    """
    status = int(flight["status"])
    if status:
        return f"ended at {float(flight['end_time']):.3g} s, {WORDS[status]}"
    for name in [each for each in _WATCHED if each in flight]:
        values = flight[name].transpose("time", ...).to_numpy()
        finite = np.isfinite(values).reshape(len(values), -1).all(-1)
        if not finite.all():
            return f"not finite from {float(flight['time'][~finite][0]):.3g} s on"
    return ""


def failures(dataset: xr.Dataset) -> list[str]:
    """Return a sentence per flight that failed, of all models, letters and runs in a dataset."""
    named = [
        " ".join([*names, end])
        for names, flight in _flights(dataset, [])
        if (end := ending(flight))
    ]
    return [f"× Failed: {'; '.join(named)}."] if named else []


def doubts(dataset: xr.Dataset) -> list[str]:
    """Return `failures`, and a sentence on flights that are not resolved."""
    named = [
        " ".join(names)
        for names, flight in _flights(dataset, [])
        if float(flight["error_estimate"]) > RESOLVED
    ]
    told = f"Not resolved: {'; '.join(named)}."
    return [*failures(dataset), *([told] if named else [])]


def _flights(dataset: xr.Dataset, names: list[str]) -> Iterator[tuple[list[str], xr.Dataset]]:
    dimensions = dataset["status"].dims
    if not dimensions:
        yield names, dataset
        return
    first = dimensions[0]
    for index in range(dataset.sizes[first]):
        one = dataset.isel({first: index})
        name = f"{one[first].item()}" if first in dataset.coords else f"{first} {index}"
        yield from _flights(one, [*names, name])


def noisy(dataset: xr.Dataset) -> bool:
    """Return whether the camera of these flights has noise."""
    vehicle = json.loads(dataset.attrs.get("vehicle", "{}"))
    return bool(vehicle.get("camera", {}).get("noise", 0.0) > 0.0)


def line(axes: Any, flight: xr.Dataset, values: Any, model: str, **changes: Any) -> None:
    """Draw values (time,) over the time of a flight in the style of its model.

    A cross marks where a flight that failed ends. changes: of the line's properties.
    """
    time, values = flight["time"].to_numpy(), np.asarray(values)
    properties = {"label": model} | style.MODELS[model] | changes
    axes.plot(time, values, **properties)
    if _ends(flight, values):
        cross(axes, time, values, properties["color"])


def _ends(flight: xr.Dataset, values: Array) -> bool:
    """Return whether a flight fails within the times given."""
    early = int(flight["status"]) != 0 and float(flight["end_time"]) <= float(flight["time"][-1])
    return early or not bool(np.isfinite(values).all())


def cross(axes: Any, x: Array, y: Array, colour: str) -> None:
    """Mark the last place at which a curve is finite, if there is one."""
    last = np.flatnonzero(np.isfinite(x) & np.isfinite(y))[-1:]
    if not last.size:
        return
    properties = {"ms": 7, "mew": 2, "zorder": 6, "clip_on": False, "gid": "failed"}
    axes.plot(x[last], y[last], "x", color=colour, **properties)


def band(axes: Any, flight: xr.Dataset, values: Any, model: str, **changes: Any) -> None:
    """Draw the least and largest value in short windows as a band, and their RMS as a line.

    Of values with a sign, the line is the mean: an RMS would lie beside its band. A flight that
    fills no window is drawn as it is. changes: of the line's properties.
    """
    middle, (low, high, rms, mean) = windows(flight["time"].to_numpy(), np.asarray(values), WINDOW)
    if not middle.size:
        line(axes, flight, values, model, **changes)
        return
    centre = mean if np.any(low < 0.0) else rms
    properties = {"label": model} | style.MODELS[model] | changes
    axes.fill_between(middle, low, high, color=properties["color"], alpha=0.25, lw=0)
    axes.plot(middle, centre, **properties)
    if ending(flight):
        cross(axes, middle, centre, properties["color"])


def runs(axes: Any, flight: xr.Dataset, values: Array, model: str) -> None:
    """Draw values (run, time): nine tenths of the runs as a band, and their median as a line.

    A run counts as long as its flight lasts.
    """
    time, properties = flight["time"].to_numpy(), style.MODELS[model]
    there = np.isfinite(values).any(axis=0)
    low, high = share_of_draws(values[:, there])
    axes.fill_between(time[there], low, high, color=properties["color"], alpha=0.25, lw=0)
    axes.plot(time[there], np.nanmedian(values[:, there], axis=0), label=model, **properties)


def tell_empty(panels: Any) -> None:
    """Label panels in which no curve has a value."""
    for axes in panels:
        curves = [np.ravel(drawn.get_ydata()) for drawn in axes.get_lines()]
        if not np.isfinite(np.concatenate([np.empty(0), *curves]).astype(float)).any():
            axes.set_xticks([])
            place = {"transform": axes.transAxes, "ha": "center", "va": "center"}
            axes.text(0.5, 0.65, "no flight gets here", color=style.FAILED_COLOUR, **place)


def logarithmic(panels: Any) -> None:
    """Give panels of one scale a logarithmic one, if anything in them is above zero.

    What is less than a share of 1 / _RANGE of the largest value is below the axes.
    """
    values = [np.ravel(drawn.get_ydata()) for axes in panels for drawn in axes.get_lines()]
    found = np.concatenate([np.empty(0), *values]).astype(float)
    found = found[np.isfinite(found) & (found > 0.0)]
    if found.size:
        for axes in panels:
            axes.set_yscale("log")
            axes.set_ylim(bottom=max(axes.get_ylim()[0], found.max() / _RANGE))


def floor(panels: Any, least: float) -> None:
    """Let logarithmic axes begin no lower than at `least`, below which values are rounding."""
    for axes in panels:
        if axes.get_yscale() == "log":
            low, high = axes.get_ylim()
            axes.set_ylim(max(least, low), max(10.0 * least, high))


def widen(panels: Any, least: float) -> None:
    """Let linear y axes span at least `least`, so that rounding does not fill them."""
    for axes in panels:
        low, high = axes.get_ylim()
        if high - low < least:
            middle = 0.5 * (low + high)
            axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def highest(axes: Any) -> dict[str, tuple[float, float]]:
    """Return where the curves with a label are highest, label -> (x, y), as they are drawn.

    Titles that state where a curve peaks, or how far it goes, are made of this. A curve without a
    finite value is left out.
    """
    found: dict[str, tuple[float, float]] = {}
    for drawn in axes.get_lines():
        x, y = (np.asarray(each, float) for each in drawn.get_data())
        label, finite = str(drawn.get_label()), np.isfinite(y)
        if label.startswith("_") or not finite.any():
            continue
        top = int(np.argmax(np.where(finite, y, -np.inf)))
        if label not in found or y[top] > found[label][1]:
            found[label] = (float(x[top]), float(y[top]))
    return found


def windows(
    time: Array, values: Array, length: float
) -> tuple[Array, tuple[Array, Array, Array, Array]]:
    """Return the middles of windows, and least, largest, RMS and mean of the values in each.

    time, values: (samples,), evenly sampled; a window that is not full or not finite is left out.
    length: of a window [s].
    """
    size = max(1, round(length / float(time[1] - time[0])))
    count = len(time) // size
    middle = time[: count * size].reshape(count, size).mean(axis=1)
    parts = values[: count * size].reshape(count, size)
    whole = np.isfinite(parts).all(axis=1)
    middle, parts = middle[whole], parts[whole]
    rms = np.sqrt(np.mean(parts**2, axis=1))
    return middle, (parts.min(axis=1), parts.max(axis=1), rms, parts.mean(axis=1))


def feature_paths(axes: Any, flight: xr.Dataset) -> None:
    """Draw the paths of the feature points, their starts, and where they belong."""
    pixels = samples(flight, "features", "pixel")
    wanted = pixels[0] + samples(flight, "feature_error", "pixel")[0]
    failed = ending(flight)
    for point in range(pixels.shape[1] // 2):
        colour = POINTS[point % len(POINTS)]
        u, v = pixels[:, 2 * point], pixels[:, 2 * point + 1]
        axes.plot(u, v, color=colour, lw=0.9)
        axes.plot(u[0], v[0], marker="o", ms=3, color=colour)
        axes.plot(*wanted[2 * point : 2 * point + 2], marker="+", ms=7, color="#333333")
        if failed:
            cross(axes, u, v, style.MODELS[REFERENCE]["color"])
