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
from continuair.analysis import TRANSIENT, feature_norm, percent, samples
from continuair.figures import curves, style
from continuair.figures.style import grouped, short
from continuair.kernels import REFERENCE, UNSEEN

Array = NDArray[np.float64]

PAPER_SETTING = "nominal"
"""The setting of the paper's task, beside which the number that it prints is shown."""

_LEAST = 1e-4
"""Distances are shown from here on [mm]."""


def traces(dataset: xr.Dataset, subtitle: str = "") -> Figure:
    """Return the camera's xy trace of each letter over the target's centroid [m], with distances.

    First row as Fig. 4 of Amiri et al.; below, the horizontal distance from the target, and of each
    simpler plant's camera from the coupled one's, over time [mm].
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
        for axes in grid[1:, 0]:
            axes.set_ylim(bottom=max(_LEAST, axes.get_ylim()[0]))
        grid[0, 0].set_ylabel("y [m]")
        style.head(figure, _traced(dataset), _text(dataset, subtitle), curves.doubts(dataset),
                   style.model_handles(grid[0, 0]))  # fmt: skip
    return figure


def errors(dataset: xr.Dataset, subtitle: str = "") -> Figure:
    """Return ‖e‖ [px] of each letter over time, and DS with its transient and its rest apart."""
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
        _over_time(grid[1:], log=False)
        late = f"DS after {TRANSIENT:g} s,\n{''.join(others[:1])} [px]"
        labels = ("‖e‖ [px]", f"DS up to {TRANSIENT:g} s\n[px]", late)
        for axes, label in zip(grid[:, 0], labels, strict=False):
            axes.set_ylabel(label)
        style.head(figure, _erred(dataset), _text(dataset, subtitle), curves.doubts(dataset),
                   style.model_handles(grid[0, 0]))  # fmt: skip
    return figure


def image(dataset: xr.Dataset, camera: Any, subtitle: str = "", model: str = REFERENCE) -> Figure:
    """Return the paths of the feature points in the image [px], one panel per letter."""
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
        style.head(figure, _seen(flights), f"{subtitle} {model.capitalize()} plant.",
                   curves.doubts(flights), key)  # fmt: skip
    return figure


def stability(dataset: xr.Dataset, bounds: dict[str, float], subtitle: str = "") -> Figure:
    """Return the paper's V, the sound V [J] and ‖e_a‖ beside its ultimate bound, over time.

    Of the first letter; bounds: the least one of the proof, by letter.
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
        right.set(xlabel="time [s]", ylabel=r"$\Vert e_a\Vert$")
        for axes in (left, right):
            curves.logarithmic([axes])
        text = _text(dataset, f"{subtitle} Letter {letter}, coupled plant.")
        handles = style.model_handles(left) + style.model_handles(right)
        style.head(
            figure,
            _bounded(flight, bound),
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
        figures = {
            "traces": traces(dataset, text),
            "errors": errors(dataset, text),
            "image": image(dataset, camera, text),
            "speed": speed_of(_first(dataset), text),
        }
        if "ultimate_bound" in part:
            bounds = part["ultimate_bound"]["radius_least_of"]
            figures["stability"] = stability(dataset, bounds, text)
        if _others(dataset):
            figures["ds"] = norm_difference_of(_first(dataset), text, printed)
        for kind, figure in figures.items():
            style.save(figure, f"{kind}_{setting}", file)


def off_target(flight: xr.Dataset) -> Array:
    """Return the camera's horizontal distance from above the target's centroid (time,) [m]."""
    camera, target = (samples(flight, f"{of}_position", "axis") for of in ("camera", "target"))
    distance: Array = np.linalg.norm((camera - target)[:, :2], axis=1)
    return distance


def _first(dataset: xr.Dataset) -> xr.Dataset:
    """Return the flights of letter M, as in the paper's Figs. 5 and 6, or of the first letter."""
    letters = _letters(dataset)
    return dataset.sel(letter="M" if "M" in letters else letters[0])


def _letters(dataset: xr.Dataset) -> list[str]:
    return [str(letter) for letter in dataset["letter"].to_numpy()]


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
    """DS of a plant up to the end of the transient, and after it, there of the first plant only."""
    ds = feature_norm(flights.sel(model=REFERENCE)) - feature_norm(flights.sel(model=model))
    early = flights["time"].to_numpy() <= TRANSIENT
    flight = flights.sel(model=model)
    curves.line(panels[0], flight.isel(time=early), ds[early], model)
    if model == _others(flights)[0]:
        draw(panels[1], flight.isel(time=~early), ds[~early], model)


def _late(dataset: xr.Dataset, values: Array) -> float:
    """Return the largest finite value (…, time) after the transient, NaN if there is none."""
    late = values[..., dataset["time"].to_numpy() >= TRANSIENT]
    finite = late[np.isfinite(late)]
    return float(finite.max()) if finite.size else float("nan")


def _largest(dataset: xr.Dataset, of: Callable[[xr.Dataset, str], Array], model: str) -> float:
    """Return the largest of a quantity of all letters and a plant, after the transient."""
    found = [_late(dataset, of(dataset.sel(letter=letter), model)) for letter in _letters(dataset)]
    return max((value for value in found if np.isfinite(value)), default=float("nan"))


def _traced(dataset: xr.Dataset) -> str:
    """Return a sentence on distances between plants and from the target after the transient."""
    off = {m: _largest(dataset, _off, m) for m, _ in _each(dataset)}
    apart = {m: _largest(dataset, _between, m) for m in _others(dataset)}
    strays, words = (
        grouped({m: f"{short(1e3 * far)} mm" for m, far in found.items() if np.isfinite(far)})
        for found in (off, apart)
    )
    if not strays:
        return f"No flight lasts {TRANSIENT:g} s"
    text = f"From {TRANSIENT:g} s on the camera strays from its target by {strays}"
    return f"{text}; from the coupled plant's by {words}" if words else text


def _erred(dataset: xr.Dataset) -> str:
    """Return a sentence on ‖e‖ and |DS| after the transient, by plant."""
    errors = {m: _largest(dataset, _norms, m) for m, _ in _each(dataset)}
    words = {m: f"{short(error)} px" for m, error in errors.items() if np.isfinite(error)}
    if not words:
        return f"No flight lasts {TRANSIENT:g} s"
    text = f"From {TRANSIENT:g} s on ‖e‖ peaks at {grouped(words)}"
    for model in _others(dataset)[:1]:
        ds = _largest(dataset, lambda f, m: np.abs(_norms(f, REFERENCE) - _norms(f, m)), model)
        text += f"; |DS| at {short(ds)} px, {model}" if np.isfinite(ds) else ""
    return text


def _off(flights: xr.Dataset, model: str) -> Array:
    return off_target(flights.sel(model=model))


def _norms(flights: xr.Dataset, model: str) -> Array:
    return feature_norm(flights.sel(model=model))


def _seen(flights: xr.Dataset) -> str:
    """Return a sentence on how close the points come, and whether they stay in the image."""
    pairs = flights["feature_error"].transpose(..., "pixel", "time").to_numpy()
    pairs = pairs.reshape(*pairs.shape[:-2], -1, 2, pairs.shape[-1])
    error = np.linalg.norm(pairs, axis=-2)
    out = (flights["in_view"] < 0.5).any("point").any("time") | (flights["status"] == UNSEEN)
    lost = [str(letter) for letter in flights["letter"].to_numpy()[out.to_numpy()]]
    stay = f"points leave the image in {', '.join(lost)}" if lost else "no point leaves the image"
    near = _late(flights, error)
    if not np.isfinite(near):
        return f"No flight lasts {TRANSIENT:g} s; {stay}"
    return f"From {TRANSIENT:g} s on every point is within {short(near)} px of its place; {stay}"


def _bounded(flight: xr.Dataset, bound: float) -> str:
    """Return a sentence on the error below the proof's bound, and on rises of the paper's V."""
    reached = _late(flight, flight["servo_error"].to_numpy())
    steps = np.diff(flight["lyapunov_paper"].to_numpy())
    if not np.isfinite(reached):
        return f"The flight does not last {TRANSIENT:g} s"
    rises = np.mean(steps[np.isfinite(steps)] > 0.0)
    return (
        f"From {TRANSIENT:g} s on ‖$e_a$‖ stays below {short(reached)}, where the proof allows "
        f"{short(bound)}; over all of it the paper's V rises {percent(float(rises))} of the time"
    )
