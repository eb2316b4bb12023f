"""The vehicle drawn from the side: the UAV with its rotors, and the arm as it is bent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from continuair.analysis.backbone import along, parts, placed
from continuair.analysis.motion import coordinates_of
from continuair.figures import style
from continuair.vehicle.vehicle import Vehicle

Array = NDArray[np.float64]

_POINTS = 40

_WORDS = "#555555"


def snapshots(
    dataset: xr.Dataset,
    vehicle: Vehicle,
    times: Sequence[float],
    models: Sequence[str] = ("decoupled", "coupled"),
) -> Figure:
    """Return side views at given times [s], as `draw` draws them, with a legend of the models."""
    with style.applied():
        figure = style.new_figure(height=2.5)
        axes: Any = figure.subplots()
        draw(axes, dataset, vehicle, times, 0.9, models)
        style.model_legend(figure, axes)
    return figure


def draw(
    axes: Any,
    dataset: xr.Dataset,
    vehicle: Vehicle,
    times: Sequence[float],
    spacing: float,
    models: Sequence[str],
) -> None:
    """Draw side views (world x and z) at given times [s], side by side, the models overlaid.

    dataset: trajectories with leading dimension `model`. The last of `models` is in front, and the
    picture falls with its UAV: each snapshot has it at the same height. spacing: distance between
    snapshots [m]. Several arms are named where their tips are farthest apart.
    """
    axes.set_axis_off()
    axes.set_aspect("equal")
    for model in reversed(models):
        look = {"color": style.MODELS[model]["color"], "ls": style.MODELS[model]["linestyle"]}
        axes.plot([], [], label=model, lw=2.5, **look)
    ends = []
    for index, time in enumerate(times):
        front = dataset.sel(model=models[-1]).sel(time=time, method="nearest")
        origin = front["position"].to_numpy() - np.array([index * spacing, 0.0, 0.0])
        for model in models:
            flight = dataset.sel(model=model).sel(time=time, method="nearest")
            tips = _draw(axes, flight, vehicle, origin, model, front=model == models[-1])
        ends.append(tips)
    if len(vehicle.arms) > 1:
        _name(axes, vehicle, max(ends, key=lambda tips: np.ptp([tip[0] for tip in tips])))
    above = max(0.42 * float(vehicle.reach), axes.dataLim.y1 + 0.08 * float(vehicle.reach))
    shown = dataset["time"].sel(time=list(times), method="nearest").to_numpy()
    digits = 1 if np.allclose(shown, np.round(shown, 1), rtol=0.0, atol=1e-9) else 3
    for index, time in enumerate(shown):
        words = f"{time:.{digits}f} s"
        axes.annotate(words, (index * spacing, above), ha="center", color=_WORDS)
    _ground(axes, dataset.sel(model=models[-1]), vehicle, times, spacing)
    bottom = _scale(axes, vehicle)
    reach = float(vehicle.reach)
    axes.set_ylim(bottom - 0.05 * reach, above + 0.08 * reach)


def _ground(
    axes: Any, front: xr.Dataset, vehicle: Vehicle, times: Sequence[float], spacing: float
) -> None:
    """Draw z = 0 below snapshots near it, of a vehicle that stays above it in all of them."""
    low, size = axes.dataLim.y0, 0.45 * spacing
    at = front["position"].sel(time=list(times), method="nearest").isel(axis=2)
    heights = at.to_numpy()
    if not (heights >= -low).all():
        return
    seen = []
    for index, height in enumerate(heights):
        if height <= -low + float(vehicle.reach):
            x = np.array([-size, size]) + index * spacing
            axes.plot(x, [-height, -height], color=_WORDS, lw=0.8, gid="ground")
            seen.append((x[1], -height))
    if seen:
        axes.annotate(
            "z = 0", seen[-1], (3, -3), textcoords="offset points", color=_WORDS, fontsize=7
        )


def _scale(axes: Any, vehicle: Vehicle) -> float:
    """Draw a bar of a round length at the lower left, with its length [m]; return its height."""
    length = round_length(0.5 * float(vehicle.reach))
    low, left = axes.dataLim.y0 - 0.2 * float(vehicle.reach), axes.dataLim.x0
    ends = {"marker": "|", "ms": 5, "mew": 1.2}
    axes.plot([left, left + length], [low, low], color=_WORDS, lw=1.2, gid="scale", **ends)
    axes.annotate(
        f"{length:g} m", (left + 0.5 * length, low), (0, 3), textcoords="offset points",
        color=_WORDS, fontsize=7, ha="center",
    )  # fmt: skip
    return low


def round_length(most: float) -> float:
    """Return the largest of 1, 2 or 5 times a power of ten that is not above `most`."""
    power = 10.0 ** np.floor(np.log10(most))
    return float(max(each * power for each in (1.0, 2.0, 5.0) if each * power <= most))


def _name(axes: Any, vehicle: Vehicle, tips: list[Array]) -> None:
    """Write the arms' names outwards of their tips."""
    middle = np.mean([tip[0] for tip in tips])
    for arm, tip in zip(vehicle.arms, tips, strict=True):
        side = 1 if tip[0] >= middle else -1
        axes.annotate(
            arm.name, tip[[0, 2]], (6 * side, -3), textcoords="offset points", color=_WORDS,
            ha="left" if side > 0 else "right",
        )  # fmt: skip


def _draw(
    axes: Any, flight: xr.Dataset, vehicle: Vehicle, origin: Array, model: str, front: bool
) -> list[Array]:
    """Draw one vehicle at one time, and return its tips; origin: world point drawn at (0, 0)."""
    attitude = flight["attitude"].to_numpy()
    position = flight["position"].to_numpy() - origin
    colour = style.MODELS[model]["color"]

    def line(points: Array, width: float, alpha: float = 1.0, dashes: Any = "-") -> None:
        world = placed(position, attitude, points)
        axes.plot(
            world[:, 0],
            world[:, 2],
            color=colour,
            lw=width,
            alpha=alpha,
            ls=dashes,
            solid_capstyle="round",
            zorder=3 if front else 2,
        )

    size = 0.28 * float(vehicle.reach)
    line(np.array([[-size, 0, 0], [size, 0, 0]]), 2.2)
    line(np.array([[-0.3 * size, 0, 0.05 * size], [0.3 * size, 0, 0.05 * size]]), 5.0)
    for side in (-size, size):
        line(np.array([[side, 0, 0], [side, 0, 0.22 * size]]), 1.2)
        disk = [[side - 0.42 * size, 0, 0.22 * size], [side + 0.42 * size, 0, 0.22 * size]]
        line(np.array(disk), 1.8, alpha=0.6)
    tips = []
    bends = coordinates_of(flight, vehicle)
    for arm, bend in parts(vehicle, bends):
        points, _ = along(arm, bend, _POINTS)
        line(np.array([np.zeros(3), points[0]]), 1.2)
        line(points, 2.6, dashes=style.MODELS[model]["linestyle"])
        tips.append(placed(position, attitude, points)[-1])
        place = tips[-1][[0, 2]]
        axes.plot(*place, marker="o", ms=4, color=colour, zorder=4 if front else 2)
    return tips
