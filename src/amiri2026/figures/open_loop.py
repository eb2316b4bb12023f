"""Figures of the open-loop study, from its datasets (leading dimension `model`) and results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from amiri2026.figures import overview
from amiri2026.figures.frames import bend_variables, frames
from amiri2026.spectrum import STILL, dominant, spectrum
from continuair import Vehicle, modes
from continuair.analysis import differences as metrics_of
from continuair.analysis import geodesic_angle, rotation_metric, samples, tip_euler
from continuair.figures import curves, style
from continuair.figures.style import grouped, short
from continuair.kernels import REFERENCE
from continuair.vehicle import vehicle_of_run

Array = NDArray[np.float64]

_LEAST_AMPLITUDE = 0.5 * STILL
"""Amplitude of a bend up to which it is rounding [1/m]."""

_SMALL = 0.1
"""Share of its largest amplitude beyond whose frequencies a spectrum is not shown."""

_STILL_SPAN = 25.0
"""Frequencies that are shown where nothing bends [Hz]."""

ACTS = {
    "A": "100 N along x on the UAV",
    "B": "free fall",
    "C": "sinusoidal moments on the arm",
    "D": "a turning force at the tip",
}
"""Loads of each test."""

_ZOOM = 0.5
"""Length of the part of a flight in which single swings can be seen [s]."""

_PER_SWING = 4.0
"""Least samples per period with which a spectrum resolves a frequency without aliasing."""


def motion(dataset: xr.Dataset, name: str = "", subtitle: str = "") -> Figure:
    """Return a figure of the tip's motion over time, above each model's difference from coupled.

    Positions [m], z beyond free fall, and attitude [deg]; components at rest are listed in words.
    """
    moving, still = _moving(_tip(dataset))
    columns = min(3, max(1, len(moving)))
    rows = max(1, -(-len(moving) // columns))
    heights = ([1.4, 0.9] if _others(dataset) else [1.4]) * rows
    with style.applied():
        figure = style.new_figure(height=1.25 * sum(heights))
        grid = figure.subplots(len(heights), columns, squeeze=False, height_ratios=heights)
        for index, (label, values) in enumerate(moving.items()):
            row, column = divmod(index, columns)
            own = len(heights) // rows
            _curves(grid[row * own : (row + 1) * own, column], dataset, label, values)
        for axes in grid.flat:
            axes.set_axis_on() if axes.has_data() else axes.set_axis_off()
        finding, more = f"{name}: {_moved(dataset, moving)}", f"{still} {_unfollowed(dataset)}"
        _finish(figure, grid[0, 0], finding, dataset, subtitle, more.strip())
    return figure


def bending(dataset: xr.Dataset, name: str = "", subtitle: str = "", swing: float = 0.0) -> Figure:
    """Return a figure of the bend over the first 0.5 s [1/m], and of its amplitude spectrum.

    swing: the arm's frequency in free fall [Hz]. If samples are too coarse for it, there are no
    amplitudes, and the title says so.
    """
    moving, still = _moving(_bends(dataset))
    interval = float(dataset["time"][1] - dataset["time"][0])
    told = _PER_SWING * swing * interval <= 1.0
    count = max(1, len(moving) + told)
    rows = -(-count // 3)
    with style.applied():
        figure = style.new_figure(height=2.2 * rows)
        panels = figure.subplots(rows, -(-count // rows), squeeze=False).ravel()
        for axes, (label, values) in zip(panels, moving.items(), strict=False):
            for model, flight in _each(dataset):
                shown = flight["time"].to_numpy() <= _ZOOM
                curves.line(axes, flight.isel(time=shown), values[model][shown], model)
            axes.set(xlim=(0.0, _ZOOM), xlabel=f"time, first {_ZOOM:g} s [s]", ylabel=label)
        finding = f"samples {1e3 * interval:g} ms apart do not tell swings of {short(swing)} Hz"
        doubt = ""
        if told:
            finding, doubt = _spectra(panels[count - 1], dataset)
        for axes in panels[count:]:
            axes.set_axis_off()
        more = " ".join(part for part in (still, doubt) if part)
        _finish(figure, panels[count - 1], f"{name}: {finding}", dataset, subtitle, more)
    return figure


def _bends(dataset: xr.Dataset) -> dict[str, dict[str, Array]]:
    """Label -> model -> values (time,) of the bend of each section [1/m]."""
    found: dict[str, dict[str, Array]] = {}
    names = [str(each) for each in dataset["section"].to_numpy()] if "section" in dataset else []
    for model, flight in _each(dataset):
        bends = np.atleast_3d(samples(flight, "bend", "bend_axis").T)  # (axis, time, section)
        for section in range(bends.shape[2]):
            where = f" of {names[section]}" if len(names) > 1 else ""
            for axis, values in zip("xy", bends[..., section], strict=True):
                found.setdefault(f"bend $k_{axis}${where} [1/m]", {})[model] = values
    return found


def _spectra(axes: Any, dataset: xr.Dataset) -> tuple[str, str]:
    """Draw the spectra of the bend; return where they peak, and what to say of peaks in doubt."""
    clear = {model: _spectrum(axes, flight, model) for model, flight in _each(dataset)}
    axes.set(xlabel="frequency [Hz]", ylabel="amplitude of the bend [1/m]")
    peaks = curves.highest(axes)
    for model, (hz, top) in peaks.items():
        _mark_peak(axes, model, hz, top, clear[model])
    axes.set_xlim(0.0, _highest(axes))
    axes.set_ylim(0.0, 1.15 * max([STILL, *(top for _, top in peaks.values())]))
    doubtful = any(top > _LEAST_AMPLITUDE and not clear[m] for m, (_, top) in peaks.items())
    duration = float(dataset["time"][-1] - dataset["time"][0])
    told = f"Open marks: less than two cycles in {duration:g} s, or spread over frequencies."
    return spectral_peaks(peaks), told if doubtful else ""


def differences(dataset: xr.Dataset, name: str = "", subtitle: str = "") -> Figure:
    """Return distance [m] and geodesic angle [deg] of the tip from the coupled one over time."""
    with style.applied():
        figure = style.new_figure(height=2.2)
        left, right = figure.subplots(1, 2, sharex=True)
        coupled = dataset.sel(model=REFERENCE)
        for model in _others(dataset):
            flight = dataset.sel(model=model)
            distance, angle = _apart(coupled, flight)
            curves.line(left, flight, distance, model)
            curves.line(right, flight, np.degrees(angle), model)
        left.set_ylabel("tip distance from coupled [m]")
        right.set_ylabel("tip angle from coupled [deg]")
        for axes in (left, right):
            axes.set_xlabel("time [s]")
            axes.set_ylim(0.0, max(STILL, axes.get_ylim()[1]))
        finding = _erred(curves.highest(left), curves.highest(right))
        _finish(figure, left, f"{name}: {finding}", dataset, subtitle)
    return figure


def write(
    results: dict[str, Any], datasets: dict[str, xr.Dataset], file: Callable[[str], Path]
) -> None:
    """Write all figures of the study as PNG, SVG and PDF; `file` gives the path of a name.

    Of several arms each has its own, but for the overviews, of the arm that carries the camera. The
    paper's Figs. 1 and 2 are of one section, and drawn of vehicles with [arm] alone.
    """
    drawn = vehicle_of_run(results["vehicle"], None)
    vehicle = style.plain(results["vehicle"]["name"])
    swing = float(modes(drawn, gravity=0.0).frequencies.max()) / (2.0 * np.pi)
    for letter, whole in datasets.items():
        for index, arm in enumerate(drawn.arms):
            dataset, entries = _of_arm(whole, drawn, index), results["tests"][letter]
            name, acts = f"Test {letter}", f"Vehicle {vehicle}, Test {letter}: {ACTS[letter]}."
            end = ""
            if len(drawn.arms) > 1:
                entries = results["arms"][letter][arm.name]
                name, end = f"{name}, arm {style.plain(arm.name)}", f"_{arm.name}"
            subtitle = " ".join([acts, *_unconverged(entries)])
            style.save(motion(dataset, name, subtitle), f"test_{letter}_motion{end}", file)
            style.save(bending(dataset, name, subtitle, swing), f"test_{letter}_bending{end}", file)
            if _others(dataset):
                figure = differences(dataset, name, subtitle)
                style.save(figure, f"test_{letter}_differences{end}", file)
    if any(model != REFERENCE for model in next(iter(results["tests"].values()))):
        style.save(overview.bars(results), "overview", file)
        style.save(overview.table(results), "table", file)
    if not drawn.has_arm_list:
        style.save(bend_variables(drawn), "bend_variables", file)
        style.save(frames(drawn), "frames", file)


def _of_arm(dataset: xr.Dataset, vehicle: Vehicle, index: int) -> xr.Dataset:
    """Flights with the tip and the sections of one arm alone."""
    if "arm" not in dataset.dims:
        return dataset
    first = sum(vehicle.shape[:index])
    return dataset.isel(arm=index, section=slice(first, first + vehicle.shape[index]))


def spectral_peaks(peaks: dict[str, tuple[float, float]]) -> str:
    """Return where the spectrum of each model peaks, in words; peaks: model -> (Hz, amplitude).

    A bend whose amplitude is rounding has no peak.
    """
    words = {
        model: f"at {short(hz)} Hz" for model, (hz, top) in peaks.items() if top > _LEAST_AMPLITUDE
    }
    return f"the bend's spectrum peaks {grouped(words)}" if words else "the bend does not change"


def _erred(
    distances: dict[str, tuple[float, float]], angles: dict[str, tuple[float, float]]
) -> str:
    """How far each model's tip gets from the coupled one, and how far it is turned from it."""
    words = {
        model: f"by up to {short(far)} m and {short(angles[model][1])}°"
        for model, (_, far) in distances.items()
        if model in angles and (far > STILL or angles[model][1] > STILL)
    }
    if words:
        return f"the tip errs {grouped(words)}"
    return "the tips coincide" if distances else "nothing can be compared"


def _unconverged(entries: dict[str, dict[str, Any]]) -> list[str]:
    """Return a sentence on models whose flights have not converged; early ends are elsewhere."""
    names = [name for name, each in entries.items() if not each["converged"] and not each["status"]]
    return [f"Not converged: {', '.join(names)}."] if names else []


def _tip(dataset: xr.Dataset) -> dict[str, dict[str, Array]]:
    """Return the label -> model -> values (time,) of the tip's position and attitude."""
    found: dict[str, dict[str, Array]] = {}
    fall = 0.5 * float(dataset.attrs["gravity"]) * dataset["time"].to_numpy() ** 2
    for model, flight in _each(dataset):
        x, y, z = samples(flight, "tip_position", "axis").T
        roll, pitch, yaw = np.degrees(tip_euler(flight)).T
        values = {"tip x [m]": x, "tip y [m]": y, "tip z beyond\nfree fall [m]": z - z[0] + fall}
        values |= {"tip roll [deg]": roll, "tip pitch [deg]": pitch, "tip yaw [deg]": yaw}
        for label, series in values.items():
            found.setdefault(label, {})[model] = series
    return found


def _each(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Return models and their flights."""
    return [(str(model), dataset.sel(model=model)) for model in dataset["model"].to_numpy()]


def _others(dataset: xr.Dataset) -> list[str]:
    return [model for model, _ in _each(dataset) if model != REFERENCE]


def _moving(
    quantities: dict[str, dict[str, Array]],
) -> tuple[dict[str, dict[str, Array]], str]:
    """Return the quantities that change in any model's flight, and a sentence on the others."""
    moving, still = {}, []
    for label, values in quantities.items():
        if any(np.nanmax(v) - np.nanmin(v) > STILL for v in values.values()):
            moving[label] = values
        else:
            name, unit = label.replace("\n", " ").split(" [")
            first = float(next(iter(values.values()))[0])
            still.append(f"{name} {0.0 if abs(first) < STILL else first:.3g} {unit.split(']')[0]}")
    return moving, f"Stays at one value: {', '.join(still)}." if still else ""


def _curves(panels: Any, dataset: xr.Dataset, label: str, values: dict[str, Array]) -> None:
    """A quantity of all models in the first panel, and differences from coupled in the second."""
    if len(panels) > 1:
        panels[1].sharex(panels[0])  # whose times are those of the panel above, too
    for model, flight in _each(dataset):
        curves.line(panels[0], flight, values[model], model)
        if model != REFERENCE:
            curves.line(panels[1], flight, values[model] - values[REFERENCE], model)
    panels[0].set_ylabel(label)
    if len(panels) > 1:
        panels[0].tick_params(labelbottom=False)
        panels[1].set_ylabel(f"minus\ncoupled [{label.split('[')[1]}")
        curves.widen([panels[1]], STILL)
        panels[1].axhline(0.0, color=style.MODELS[REFERENCE]["color"], lw=0.6)
    panels[-1].set_xlabel("time [s]")


def _spectrum(axes: Any, flight: xr.Dataset, model: str) -> bool:
    """Draw a spectrum up to where its flight ends; tell whether it has a clear peak."""
    time = flight["time"].to_numpy()
    bend = np.moveaxis(samples(flight, "bend", "bend_axis"), -2, 0).reshape(len(time), -1)
    flown = np.isfinite(bend).all(-1)
    if flown.sum() < 3:
        return False
    time, bend = time[flown], bend[flown]
    axes.plot(*spectrum(time, bend), label=model, **style.MODELS[model])
    return dominant(time, bend) is not None


def _mark_peak(axes: Any, model: str, hz: float, top: float, clear: bool) -> None:
    """Mark the peak of a spectrum with its frequency: filled where it is clear."""
    if top <= _LEAST_AMPLITUDE:
        return
    colour = style.MODELS[model]["color"]
    axes.plot(hz, top, "o", ms=3.5, color=colour, mfc=colour if clear else "white")
    # To either side, since the two simpler models often agree.
    side = {"xytext": (-4, 3), "ha": "right"} if model == "decoupled" else {"xytext": (4, 3)}
    words = {"textcoords": "offset points", "fontsize": 7, "color": colour} | side
    axes.annotate(f"{short(hz)} Hz", (hz, top), **words)


def _highest(axes: Any) -> float:
    """Where to end an axis of frequencies [Hz]: beyond all that is not small in a spectrum."""
    ends = [0.0]
    for drawn in axes.get_lines():
        hz, amplitudes = drawn.get_data()
        if len(amplitudes) > 1 and amplitudes.max() > _LEAST_AMPLITUDE:
            ends.append(float(hz[np.flatnonzero(amplitudes > _SMALL * amplitudes.max())[-1]]))
    return 1.3 * max(ends) or _STILL_SPAN


def _moved(dataset: xr.Dataset, moving: dict[str, dict[str, Array]]) -> str:
    """Return where the decoupled or another tip differs most, or how far the coupled one moves."""
    others = _others(dataset)
    model = "decoupled" if "decoupled" in others else (others or [REFERENCE])[0]
    texts = []
    for unit in ("m", "deg"):
        sizes = {}
        for label, values in moving.items():
            start = values[REFERENCE] if others else values[REFERENCE][0]
            size = np.abs(values[model] - start)
            if f"[{unit}]" in label and np.isfinite(size).any():
                sizes[label.split(" [")[0]] = float(np.nanmax(size))
        # Euler angles that jump tell of no rotation.
        told = unit == "m" or not others or _followed(dataset, model)
        if sizes and told and max(sizes.values()) > STILL:
            most = max(sizes, key=sizes.__getitem__)
            texts.append(f"{most} by up to {short(sizes[most])} {unit}")
    if not moving:
        return "the tip does not move beyond free fall"
    if not texts:
        return "the tip over time, and what the models differ by"
    if not others:
        return f"coupled, {' and '.join(texts)}"
    changed = "decoupling" if model == "decoupled" else f"the {model} model"
    return f"{changed} changes {' and '.join(texts)}"


def _unfollowed(dataset: xr.Dataset) -> str:
    """A sentence on the angles between tips where Euler angles do not tell them."""
    lost = {}
    for model in _others(dataset):
        if not _followed(dataset, model):
            _, angle = _apart(dataset.sel(model=REFERENCE), dataset.sel(model=model))
            lost[model] = f"{short(float(np.degrees(np.nanmax(angle))))}°"
    if not lost:
        return ""
    return f"Euler angles do not follow the rotation; between tips it is up to {grouped(lost)}."


def _followed(dataset: xr.Dataset, model: str) -> bool:
    """Return whether Euler angles describe the rotation between both tips."""
    found = metrics_of(dataset.sel(model=REFERENCE), dataset.sel(model=model))
    return bool(np.isnan(found["angle_rad"]) or rotation_metric([found]) == "rmse_r_rad")


def _apart(coupled: xr.Dataset, flight: xr.Dataset) -> tuple[Array, Array]:
    """Return the distance [m] and angle [rad] between two tips, (time,)."""
    tips = [samples(one, "tip_position", "axis") for one in (coupled, flight)]
    turned = [samples(one, "tip_attitude", "quaternion") for one in (coupled, flight)]
    return np.linalg.norm(tips[1] - tips[0], axis=-1), geodesic_angle(*turned)


def _coinciding(dataset: xr.Dataset) -> str:
    """Return a sentence where the curves of the simpler models lie on top of each other."""
    others = _others(dataset)
    if len(others) < 2:
        return ""
    tips = [samples(dataset.sel(model=m), "tip_position", "axis") for m in (REFERENCE, *others)]
    far, between = (np.abs(tips[i] - tips[-1]).max() for i in (0, 1))
    return f"{others[0].capitalize()} and {others[1]} coincide." if between < 0.01 * far else ""


def _finish(
    figure: Figure, axes: Any, finding: str, dataset: xr.Dataset, subtitle: str, more: str = ""
) -> None:
    """Put finding, subtitle, words on failed flights and the models' legend above the panels."""
    text = " ".join(part for part in (subtitle, more, _coinciding(dataset)) if part)
    failed = curves.failures(dataset)
    style.head(figure, finding.removeprefix(": "), text, failed, style.model_handles(axes))
