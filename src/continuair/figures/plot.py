"""`continuair.plot`: figures of flights, each a matplotlib figure to show or to save.

A flight is a result of `simulate` for one run, or several models' with the leading dimension
`model`. A cross marks the end of a flight that failed. Of a batch, such as draws of an uncertain
vehicle, `bend` and `base_wrench` show the median and a band with nine tenths of the runs, and
`tip_path` all of them beside the median.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from continuair import checks
from continuair.analysis.motion import arm_variable, backbone, over_time
from continuair.errors import InputError, shown
from continuair.figures import curves, pictogram, style
from continuair.flight.labels import FIXED, in_order, ordered
from continuair.flight.provenance import model_of
from continuair.flight.reading import check_arms_flown, vehicle_of
from continuair.flight.trajectory import VARIABLES
from continuair.vehicle.strain import COMPONENTS, TURNING
from continuair.vehicle.vehicle import Vehicle

__all__ = ["base_wrench", "bend", "image", "snapshots", "tip_path"]

_LEAST = 1e-6
"""Least span of an axis, in its unit: what is smaller is rounding."""

_PLANES = (("x", "y"), ("x", "z"))


def tip_path(flight: xr.Dataset) -> Figure:
    """Return the path of each arm's tip, from above (x, y) and from the side (x, z) [m]."""
    flights = _flights(ordered(flight, {"axis": FIXED["axis"]}), "tip_position", batch=True)
    arms = _parts(flight, "tip_position", "arm")
    with style.applied():
        figure = style.new_figure(height=2.8 * len(arms))
        grid = figure.subplots(len(arms), 2, squeeze=False)
        for row, (name, chosen) in zip(grid, arms.items(), strict=True):
            for axes, plane in zip(row, _PLANES, strict=True):
                _paths(axes, flights, chosen, plane)
                axes.set(xlabel=f"{plane[0]} [m]", ylabel=f"{name} {plane[1]} [m]".strip())
        _head(figure, "Path of the tip", flight, grid[0, 0], "Thin: all of them.")
    return figure


def bend(flight: xr.Dataset) -> Figure:
    """Return the coordinates of each section over time: bend vectors of arcs [1/m], or the strain.

    A flight with a section whose strain varies has a row of panels per section, one panel for each
    coordinate [1/m; stretch and shear: -].
    """
    name = arm_variable(flight) if isinstance(flight, xr.Dataset) else "bend"
    flights = _flights(flight, name, batch=True)
    if name == "strain":
        return _over_time(flight, flights, _strain_rows(flight), "Strain over time")
    rows = _rows(flight, {"bend": ("bend", "1/m")}, "section")
    return _over_time(flight, flights, rows, "Bend over time")


def base_wrench(flight: xr.Dataset) -> Figure:
    """Return the force and the moment of each arm on the UAV over time, body axes [N, N m]."""
    names = {"base_force": ("force", "N"), "base_moment": ("moment", "N m")}
    flights = _flights(flight, *names, batch=True)
    return _over_time(flight, flights, _rows(flight, names, "arm"), "Wrench of the arm on the UAV")


def image(flight: xr.Dataset) -> Figure:
    """Return the paths of the feature points in the camera's image [px], a panel per model."""
    flights = _flights(flight, "features")
    width, height = vehicle_of(flight).camera.image_size
    with style.applied():
        figure = style.new_figure(height=3.0)
        panels = figure.subplots(1, len(flights), squeeze=False, sharey=True)[0]
        for axes, (model, one) in zip(panels, flights.items(), strict=True):
            curves.feature_paths(axes, one)
            axes.set(xlim=(0, width), ylim=(height, 0), aspect="equal", title=model)
            axes.set_xlabel("u [px]")
        panels[0].set_ylabel("v [px]")
        style.head(figure, "Feature points in the image", "", curves.failures(flight))
    return figure


def snapshots(flight: xr.Dataset, times: Sequence[float], vehicle: Vehicle | None = None) -> Figure:
    """Return the side views of the vehicle at given times [s], the models overlaid.

    vehicle: by default that of the result's attributes.
    """
    moving = arm_variable(flight) if isinstance(flight, xr.Dataset) else "bend"
    _flights(flight, moving)
    flown = vehicle_of(flight) if vehicle is None else vehicle
    flight = in_order(over_time(flight), flown)
    flights = _flights(flight, moving)
    at = _instants(flight, times)
    # The coupled model is in front, and the legend in the order of all figures.
    models = sorted(flights, key=list(style.MODELS).index, reverse=True)
    whole = flight if "model" in flight.dims else flight.expand_dims(model=models)
    with style.applied():
        figure = style.new_figure(height=2.2)
        axes: Any = figure.subplots()
        pictogram.draw(axes, whole, flown, list(at), _room(flown, flights, at), models)
        _head(figure, "The vehicle from the side", flight, axes)
    return figure


def _instants(flight: xr.Dataset, times: Any) -> np.ndarray:
    """Return times of a flight; raises InputError for times after its end."""
    found, ends = checks.finite_array(times), flight["time"].to_numpy()[[0, -1]]
    if found is None or found.ndim != 1 or not found.size:
        raise InputError("times", f"is {shown(times)}", "give a list of times [s]")
    if (found < ends[0]).any() or (found > ends[1]).any():
        raise InputError(
            "times",
            f"is {shown(times)}, but the flight lasts from {ends[0]:g} to {ends[1]:g} s",
            "give times within it",
        )
    return found


def _room(vehicle: Vehicle, flights: dict[str, xr.Dataset], times: np.ndarray) -> float:
    """Return the distance at which snapshots do not meet [m]."""
    ends = [-0.4 * float(vehicle.reach), 0.4 * float(vehicle.reach)]
    for one in flights.values():
        # Each sample once and in order, whatever order the times are in.
        at = one.isel(time=np.unique(one.indexes["time"].get_indexer(times, method="nearest")))
        aside = backbone(vehicle, at).sel(axis="x") - at["position"].sel(axis="x")
        ends += [float(aside.min()), float(aside.max())]
    return 1.15 * float(np.nanmax(ends) - np.nanmin(ends))


@dataclass(frozen=True)
class _Panel:
    """A variable over time: its name in a flight, the dimension and labels of one component of one
    arm or section, and the label of the axis."""

    variable: str
    component: dict[str, str]
    part: dict[str, int]
    label: str


def _rows(flight: xr.Dataset, names: dict[str, tuple[str, str]], part: str) -> list[list[_Panel]]:
    """Return a row of panels per variable and part, one for each component.

    names: variable -> its word and unit. part: "arm" or "section".
    """
    return [
        [
            _Panel(name, {component: letter}, chosen, f"{label}\n{word} {letter} [{unit}]".strip())
            for component in [VARIABLES[name][0]]
            for letter in map(str, flight[component].to_numpy())
        ]
        for name, (word, unit) in names.items()
        for label, chosen in _parts(flight, name, part).items()
    ]


def _strain_rows(flight: xr.Dataset) -> list[list[_Panel]]:
    """Return a row of panels per section, one for each of its coordinates."""
    found: dict[str, list[_Panel]] = {}
    for label in map(str, flight["strain_coordinate"].to_numpy()):
        section, component = label.rsplit(".", 1)
        unit = "1/m" if component.rsplit("_", 1)[0] in COMPONENTS[:TURNING] else "-"
        panel = _Panel(
            "strain", {"strain_coordinate": label}, {}, f"{section}\n{component} [{unit}]"
        )
        found.setdefault(section, []).append(panel)
    return list(found.values())


def _over_time(
    flight: xr.Dataset, flights: dict[str, xr.Dataset], rows: list[list[_Panel]], title: str
) -> Figure:
    """Return a figure of rows of panels, the models of a flight overlaid."""
    with style.applied():
        figure = style.new_figure(height=0.6 + 1.3 * len(rows))
        grid = figure.subplots(len(rows), max(map(len, rows)), squeeze=False, sharex=True)
        for places, row in zip(grid, rows, strict=True):
            for axes, panel in zip(places, row, strict=False):
                for model, one in flights.items():
                    values = one[panel.variable].sel(panel.component).isel(panel.part)
                    if "run" in values.dims:
                        each = values.transpose("run", "time").to_numpy()
                        curves.runs(axes, one, each, model)
                    else:
                        curves.line(axes, one, values.to_numpy(), model)
                axes.set_ylabel(panel.label)
                curves.widen([axes], _LEAST)
            for axes in places[len(row) :]:
                axes.remove()
        for axes in grid[-1][: len(rows[-1])]:
            axes.set_xlabel("time [s]")
        _head(figure, title, flight, grid[0, 0])
    return figure


def _paths(axes: Any, flights: dict[str, xr.Dataset], chosen: Any, plane: tuple[str, str]) -> None:
    for model, one in flights.items():
        tip = one["tip_position"].isel(chosen).transpose("axis", ..., "time")
        x, y = (tip.sel(axis=letter).to_numpy() for letter in plane)
        batch = "run" in tip.dims
        if batch:
            thin = {"color": style.MODELS[model]["color"], "alpha": 0.15, "lw": 0.5}
            axes.plot(x.T, y.T, **thin)
            x, y = np.nanmedian(x, axis=0), np.nanmedian(y, axis=0)
        axes.plot(x, y, label=model, **style.MODELS[model])
        if not batch and curves.ending(one):
            curves.cross(axes, x, y, style.MODELS[model]["color"])
    curves.widen([axes], _LEAST)
    axes.set_aspect("equal", adjustable="datalim")


def _flights(flight: Any, *names: str, batch: bool = False) -> dict[str, xr.Dataset]:
    """Return flights by their model; raises InputError if they lack these variables.

    batch: whether flights may have runs.
    """
    if not isinstance(flight, xr.Dataset):
        raise InputError("flight", f"is {shown(flight)}", "give a Dataset of continuair.simulate")
    for name in names:
        if name not in flight:
            check_arms_flown("flight", flight)
            raise InputError("flight", f"has no {name}", "simulate it with this variable")
        if "time" not in flight[name].dims:
            raise InputError("flight", "is one sample of a flight", "give one with some over time")
        own = {"model", "time", "arm", "section", VARIABLES[name][0], *(["run"] * batch)}
        for dim in sorted(set(map(str, flight[name].dims)) - own):
            raise InputError(
                "flight",
                f"holds {flight.sizes[dim]} flights along {dim}",
                f"choose one, as in flight.isel({dim}=0)",
            )
    if "model" in flight.dims:
        return {
            _checked_model(str(each)): flight.sel(model=each) for each in flight["model"].values
        }
    return {_checked_model(model_of(flight)): flight}


def _checked_model(name: str) -> str:
    """Return the name of a model; InputError for any other."""
    if name not in style.MODELS:
        raise InputError(
            "flight",
            f"holds the model {shown(name)}",
            "name it, as in xr.concat([a, b], xr.Variable('model', ['coupled', 'decoupled']))",
        )
    return name


def _parts(flight: xr.Dataset, name: str, part: str) -> dict[str, dict[str, int]]:
    """Arms or sections that a variable has, by name; one without a name where they are no list."""
    if part not in flight[name].dims:
        return {"": {}}
    return {str(label): {part: index} for index, label in enumerate(flight[part].to_numpy())}


def _head(
    figure: Figure,
    title: str,
    flight: xr.Dataset,
    axes: Any,
    others: str = "Bands: 5 to 95 % of them.",
) -> None:
    """Write title and legend; others: how a batch's runs are shown beside their median."""
    said = json.loads(flight.attrs.get("vehicle", "{}")).get("name", "")
    text = f"Vehicle {style.plain(said)}." if said else ""
    if "run" in flight.dims:
        text += f" Lines: medians of {flight.sizes['run']} runs. {others}"
    style.head(figure, title, text, curves.failures(flight), style.model_handles(axes))
