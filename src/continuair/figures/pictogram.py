"""The vehicle drawn from the side: the UAV with its rotors, and the arm as it is bent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from continuair.analysis.backbone import along, parts, placed
from continuair.figures import style
from continuair.vehicle.vehicle import Vehicle

Array = NDArray[np.float64]

_POINTS = 40


def snapshots(
    dataset: xr.Dataset,
    vehicle: Vehicle,
    times: Sequence[float],
    spacing: float = 0.9,
    models: Sequence[str] = ("decoupled", "coupled"),
) -> Figure:
    """Return side views (world x and z) at given times [s], side by side, the models overlaid.

    dataset: trajectories with leading dimension `model`. The last of `models` is in front, and the
    picture falls with its UAV: each snapshot has it at the same height. spacing: distance between
    snapshots [m].
    """
    with style.applied():
        figure = style.new_figure(height=2.5)
        axes: Any = figure.subplots()
        axes.set_axis_off()
        axes.set_aspect("equal")
        for model in reversed(models):
            axes.plot([], [], label=model, color=style.MODELS[model]["color"], lw=2.5)
        for index, time in enumerate(times):
            front = dataset.sel(model=models[-1]).sel(time=time, method="nearest")
            origin = front["position"].to_numpy() - np.array([index * spacing, 0.0, 0.0])
            for model in models:
                flight = dataset.sel(model=model).sel(time=time, method="nearest")
                _draw(axes, flight, vehicle, origin, model, front=model == models[-1])
            axes.annotate(
                f"{float(front['time']):.1f} s",
                (index * spacing, 0.42 * float(vehicle.reach)),
                ha="center",
                color="#555555",
            )
        axes.set_ylim(top=max(axes.get_ylim()[1], 0.5 * float(vehicle.reach)))
        style.model_legend(figure, axes)
    return figure


def _draw(
    axes: Any, flight: xr.Dataset, vehicle: Vehicle, origin: Array, model: str, front: bool
) -> None:
    """Draw one vehicle at one time; origin is the world point drawn at (0, 0)."""
    attitude = flight["attitude"].to_numpy()
    position = flight["position"].to_numpy() - origin
    colour = style.MODELS[model]["color"]

    def line(points: Array, width: float, alpha: float = 1.0) -> None:
        world = placed(position, attitude, points)
        axes.plot(
            world[:, 0],
            world[:, 2],
            color=colour,
            lw=width,
            alpha=alpha,
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
    for arm, bend in parts(vehicle, flight["bend"].to_numpy().reshape(-1, 2)):
        points, _ = along(arm, bend, _POINTS)
        line(np.array([np.zeros(3), points[0]]), 1.2)
        line(points, 2.6)
        tip = placed(position, attitude, points)[-1]
        axes.plot(*tip[[0, 2]], marker="o", ms=4, color=colour, zorder=4 if front else 2)
