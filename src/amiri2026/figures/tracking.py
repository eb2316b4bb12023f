"""Figures of the tracking study, from its datasets (leading dimensions `model` and `letter`)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from amiri2026.figures.one_letter import norm_difference_of, speed_of
from amiri2026.tracking.largest import (
    ds_extremes,
    in_transient,
    largest_norm,
    largest_of_a_point,
    largest_off_target,
    largest_servo_error,
    largest_since,
    off_target,
)
from continuair.analysis import TRANSIENT, feature_norm, norm_difference, percent, samples
from continuair.figures import curves, style
from continuair.figures.style import grouped, short
from continuair.kernels import REFERENCE, UNSEEN
from continuair.scenario import SETTINGS

Array = NDArray[np.float64]

PAPER_SETTING = "nominal"
"""The setting of the paper's task, beside which the number that it prints is shown."""

_SETTLED = SETTINGS[PAPER_SETTING].settled
"""From when titles and tables count errors [s], unless a setting says otherwise."""

_NONE_LASTS = "No flight lasts to its end"

_LEAST = 1e-4
"""Distances are shown from here on [mm]."""

_LEAST_PIXELS = 1e-3
"""Errors in the image are shown from here on [px]."""


def traces(dataset: xr.Dataset, subtitle: str = "", since: float = _SETTLED) -> Figure:
    """Return the camera's xy trace of each letter over the target's centroid [m], with distances.

    First row as Fig. 4 of Amiri et al.; below, the horizontal distance from the target, and of each
    simpler plant's camera from the coupled one's, over time [mm]. since: the title tells of the
    largest distances from then on [s].
    """
    letters, others = _letters(dataset), _others(dataset)
    heights = [2.1, 1.2, 1.2][: 3 if others else 2]
    with style.applied():
        figure = style.new_figure(height=1.1 * sum(heights))
        grid = figure.subplots(
            len(heights), len(letters), squeeze=False, sharey="row", height_ratios=heights
        )
        draw = _drawing(dataset)
        for column, letter in enumerate(letters):
            flights = dataset.sel(letter=letter)
            _trace(grid[0, column], flights)
            for model, flight in _each(flights):
                draw(grid[1, column], flight, 1e3 * off_target(flight), model)
                if model in others:
                    draw(grid[2, column], flight, 1e3 * _between(flights, model), model)
            grid[0, column].set_title(letter)
        for axes, label in zip(grid[1:, 0], ("off target [mm]", "off coupled [mm]"), strict=False):
            axes.set_ylabel(label)
        _over_time(grid[1:], log=True)
        curves.floor(grid[1:, 0], _LEAST)
        grid[0, 0].set_ylabel("y [m]")
        told = _traced(dataset, since), _text(dataset, subtitle), curves.doubts(dataset)
        style.head(figure, *told, style.model_handles(grid[0, 0]))
    return figure


def errors(dataset: xr.Dataset, subtitle: str = "", since: float = _SETTLED) -> Figure:
    """Return ‖e‖ [px] of each letter over time, and DS with its transient and its rest apart.

    The rest is |DS|, on a logarithmic axis that shows all plants. since: as in `traces`.
    """
    letters, others = _letters(dataset), _others(dataset)
    with style.applied():
        figure = style.new_figure(height=1.5 * (3 if others else 1))
        grid = figure.subplots(3 if others else 1, len(letters), squeeze=False, sharey="row")
        draw = _drawing(dataset)
        for column, letter in enumerate(letters):
            flights = dataset.sel(letter=letter)
            for model, flight in _each(flights):
                draw(grid[0, column], flight, feature_norm(flight), model)
                if model in others:
                    _ds(grid[1:, column], flights, model, draw)
            grid[0, column].set_title(letter)
        _over_time(grid[:1], log=True)
        _over_time(grid[1:2], log=False)
        _over_time(grid[2:], log=True)
        curves.floor(grid[::2, 0], _LEAST_PIXELS)
        labels = (
            "‖e‖ [px]",
            f"DS before {TRANSIENT:g} s\n[px]",
            f"|DS| from {TRANSIENT:g} s\n[px]",
        )
        for axes, label in zip(grid[:, 0], labels, strict=False):
            axes.set_ylabel(label)
        told = _erred(dataset, since), _text(dataset, subtitle), curves.doubts(dataset)
        style.head(figure, *told, style.model_handles(grid[0, 0]))
    return figure


def image(
    dataset: xr.Dataset,
    camera: Any,
    subtitle: str = "",
    model: str = REFERENCE,
    since: float = _SETTLED,
) -> Figure:
    """Return the paths of the feature points in the image [px], one panel per letter.

    since: as in `traces`.
    """
    letters = _letters(dataset)
    width, height = camera.image_size
    flights = dataset.sel(model=model)
    with style.applied():
        figure = style.new_figure(height=2.1)
        panels = figure.subplots(1, len(letters), squeeze=False, sharey=True)[0]
        for axes, letter in zip(panels, letters, strict=True):
            curves.feature_paths(axes, flights.sel(letter=letter))
            axes.set(xlim=(0, width), ylim=(height, 0), aspect="equal", title=letter)
            axes.set_xlabel("u [px]")
        panels[0].set_ylabel("v [px]")
        grey = "#333333"
        key = [
            Line2D([], [], color=curves.POINTS[0], lw=0.9, label="a feature point"),
            Line2D([], [], color=grey, ls="", marker="o", ms=3, label="start"),
            Line2D([], [], color=grey, ls="", marker="+", ms=7, label="where it belongs"),
        ]
        style.head(figure, _seen(flights, since), f"{subtitle} {model.capitalize()} plant.",
                   curves.doubts(flights), key)  # fmt: skip
    return figure


def stability(
    dataset: xr.Dataset, bounds: dict[str, float], subtitle: str = "", since: float = _SETTLED
) -> Figure:
    """Return the paper's V, the sound V [J] and ‖e_a‖ beside its ultimate bound, over time.

    Of the first letter; bounds: the least one of the proof, by letter. since: as in `traces`.
    """
    flight = dataset.isel(letter=0).sel(model=REFERENCE)
    letter = str(flight["letter"].item())
    bound = bounds[letter]
    with style.applied():
        figure = style.new_figure(height=2.3)
        left, right = figure.subplots(1, 2)
        draw = _drawing(dataset)
        for name, colour, label in (
            ("lyapunov_paper", "#D55E00", "V as the paper defines it"),
            ("lyapunov_sound", "#000000", "V of a sound proof"),
        ):
            draw(left, flight, flight[name].to_numpy(), REFERENCE, color=colour, label=label)
        error = flight["servo_error"].to_numpy()
        draw(right, flight, error, REFERENCE, label="_error")
        least = {"color": "#0072B2", "lw": 1.2, "ls": "--", "label": "least bound of the proof"}
        right.axhline(bound, **least)
        left.set(xlabel="time [s]", ylabel="V [J]")
        right.set(xlabel="time [s]", ylabel=r"$\Vert e_a\Vert$ [-]")
        for axes in (left, right):
            curves.logarithmic([axes])
        text = _text(dataset, f"{subtitle} Letter {letter}, coupled plant.")
        handles = style.model_handles(left) + style.model_handles(right)
        style.head(
            figure,
            _bounded(flight, bound, since),
            text,
            curves.doubts(dataset.isel(letter=[0]).sel(model=[REFERENCE])),
            handles,
        )
    return figure


def write(
    results: dict[str, Any],
    datasets: dict[str, xr.Dataset],
    camera: Any,
    file: Callable[[str], Path],
) -> None:
    """Write all figures of the study as PNG, SVG and PDF; `file` gives the path of a name."""
    name = style.plain(results["vehicle"]["name"])
    for setting, dataset in datasets.items():
        part = results if setting == results["setting"] else results["settings"][setting]
        text = f"Vehicle {name}, {setting}: {part['setting_meaning']}."
        printed = results["printed"] if setting == PAPER_SETTING else {}
        since = SETTINGS[setting].settled
        figures = {
            "traces": traces(dataset, text, since),
            "errors": errors(dataset, text, since),
            "image": image(dataset, camera, text, since=since),
            "speed": speed_of(_first(dataset), text),
        }
        if "ultimate_bound" in part:
            bounds = part["ultimate_bound"]["radius_least_of"]
            figures["stability"] = stability(dataset, bounds, text, since)
        if _others(dataset):
            figures["ds"] = norm_difference_of(_first(dataset), text, printed)
        for kind, figure in figures.items():
            style.save(figure, f"{kind}_{setting}", file)


def _first(dataset: xr.Dataset) -> xr.Dataset:
    """Return the flights of letter M, as in the paper's Figs. 5 and 6, or of the first letter."""
    letters = _letters(dataset)
    return dataset.sel(letter="M" if "M" in letters else letters[0])


def _letters(dataset: xr.Dataset) -> list[str]:
    return [str(letter) for letter in dataset["letter"].to_numpy()]


def _plants(dataset: xr.Dataset) -> list[str]:
    return [str(m) for m in dataset["model"].to_numpy()]


def _others(dataset: xr.Dataset) -> list[str]:
    return [str(m) for m in dataset["model"].to_numpy() if m != REFERENCE]


def _each(flights: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    return [(str(model), flights.sel(model=model)) for model in flights["model"].to_numpy()]


def _drawing(dataset: xr.Dataset) -> Callable[..., None]:
    """Return the style of curves over time: bands if the camera has noise."""
    return curves.band if curves.noisy(dataset) else curves.line


def _text(dataset: xr.Dataset, subtitle: str) -> str:
    return f"{subtitle} {curves.BAND}" if curves.noisy(dataset) else subtitle


def _over_time(grid: Any, log: bool) -> None:
    for row in grid:
        curves.tell_empty(row)
        if log:
            curves.logarithmic(row)
        else:
            for axes in row:
                axes.axhline(0.0, color="#000000", lw=0.5)
    for axes in grid[-1] if len(grid) else ():
        axes.set_xlabel("time [s]")


def _trace(axes: Any, flights: xr.Dataset) -> None:
    """The traces of all plants over the target's, with their common start."""
    target = samples(flights.isel(model=0), "target_position", "axis")
    axes.plot(*target[:, :2].T, color="#bbbbbb", lw=3.0, label="target")
    for model, flight in _each(flights):
        x, y = samples(flight, "camera_position", "axis")[:, :2].T
        axes.plot(x, y, label=model, **style.MODELS[model])
        if curves.ending(flight):
            curves.cross(axes, x, y, style.MODELS[model]["color"])
    start = {"color": "#333333", "ls": "", "zorder": 5, "label": "start of the camera"}
    axes.plot(x[0], y[0], marker="o", ms=3.5, **start)
    axes.set(aspect="equal", xlabel="x [m]")


def _between(flights: xr.Dataset, model: str) -> Array:
    """Return the distance between the cameras of a plant and of the coupled one (time,) [m]."""
    own, coupled = (
        samples(flights.sel(model=name), "camera_position", "axis") for name in (model, REFERENCE)
    )
    return np.linalg.norm(own - coupled, axis=1)


def _ds(panels: Any, flights: xr.Dataset, model: str, draw: Callable[..., None]) -> None:
    """DS of a plant before the end of the transient, and its size from then on."""
    ds = norm_difference(flights.sel(model=REFERENCE), flights.sel(model=model))
    early = in_transient(flights)
    flight = flights.sel(model=model)
    curves.line(panels[0], flight.isel(time=early), ds[early], model)
    draw(panels[1], flight.isel(time=~early), np.abs(ds[~early]), model)


def _largest(dataset: xr.Dataset, of: Callable[[xr.Dataset, str], float], model: str) -> float:
    """The largest of a number of all letters and a plant; NaN if none flies to its end."""
    found = [of(dataset.sel(letter=letter), model) for letter in _letters(dataset)]
    return max((value for value in found if np.isfinite(value)), default=float("nan"))


def _by_plant(
    dataset: xr.Dataset, plants: list[str], of: Callable[[xr.Dataset, str], float], unit: str
) -> str:
    """The largest of a number of all letters, of each plant that flies one to its end."""
    found = {model: _largest(dataset, of, model) for model in plants}
    return grouped({m: f"{short(far)} {unit}" for m, far in found.items() if np.isfinite(far)})


def _traced(dataset: xr.Dataset, since: float) -> str:
    """How far the plants are off the target and apart, at the most."""

    def off(flights: xr.Dataset, model: str) -> float:
        return 1e3 * largest_off_target(flights.sel(model=model), since)

    def apart(flights: xr.Dataset, model: str) -> float:
        return 1e3 * largest_since(flights, _between(flights, model), since)

    strays = _by_plant(dataset, _plants(dataset), off, "mm")
    words = _by_plant(dataset, _others(dataset), apart, "mm")
    if not strays:
        return _NONE_LASTS
    text = f"From {since:g} s on the camera strays from its target by up to {strays}"
    return f"{text}; from the coupled plant's by {words}" if words else text


def _erred(dataset: xr.Dataset, since: float) -> str:
    """How large ‖e‖ and |DS| are at the most, by plant."""
    words = _by_plant(
        dataset,
        _plants(dataset),
        lambda flights, model: largest_norm(flights.sel(model=model), since),
        "px",
    )
    ds = _by_plant(
        dataset,
        _others(dataset),
        lambda flights, m: ds_extremes(flights.sel(model=REFERENCE), flights.sel(model=m))[1],
        "px",
    )
    if not words:
        return _NONE_LASTS
    text = f"From {since:g} s on ‖e‖ is at most {words}"
    return f"{text}; |DS| from {TRANSIENT:g} s on at most {ds}" if ds else text


def _seen(flights: xr.Dataset, since: float) -> str:
    """How near the points come, and whether they stay in the image."""
    out = (flights["in_view"] < 0.5).any("point").any("time") | (flights["status"] == UNSEEN)
    lost = [str(letter) for letter in flights["letter"].to_numpy()[out.to_numpy()]]
    stay = f"points leave the image in {', '.join(lost)}" if lost else "no point leaves the image"
    found = [largest_of_a_point(flights.sel(letter=each), since) for each in _letters(flights)]
    near = [distance for distance in found if np.isfinite(distance)]
    if not near:
        return f"{_NONE_LASTS}; {stay}"
    return f"From {since:g} s on every point is within {short(max(near))} px of its place; {stay}"


def _bounded(flight: xr.Dataset, bound: float, since: float) -> str:
    """How far the error stays below the proof's bound, or how far it exceeds it, and how often the
    paper's V rises."""
    reached = largest_servo_error(flight, since)
    steps = np.diff(flight["lyapunov_paper"].to_numpy())
    if not np.isfinite(reached):
        return _NONE_LASTS
    rises = np.mean(steps[np.isfinite(steps)] > 0.0)
    return (
        f"From {since:g} s on ‖$e_a$‖ is at most {short(reached)}, where the proof allows "
        f"{short(bound)}; over all of it the paper's V rises {percent(float(rises))} of the time"
    )
