"""Figures of the tracking study, from its datasets (leading dimensions `model` and `letter`)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from continuair.analysis.metrics import TRANSIENT, feature_norm, samples
from continuair.figures import style

Array = np.ndarray


def traces(dataset: xr.Dataset, title: str = "") -> Figure:
    """Return the camera's xy trace of each letter and model over the target's centroid [m]."""
    letters = dataset["letter"].to_numpy()
    with style.applied():
        figure = style.new_figure(height=2.5 if len(letters) > 2 else 3.2)
        panels = figure.subplots(1, len(letters), squeeze=False, sharey=True)[0]
        for axes, letter in zip(panels, letters, strict=True):
            flights = dataset.sel(letter=letter)
            target = samples(flights.isel(model=0), "target_position", "axis")
            axes.plot(*target[:, :2].T, color="#bbbbbb", lw=3.0, label="target")
            for model in dataset["model"].to_numpy():
                xy = samples(flights.sel(model=model), "camera_position", "axis")
                axes.plot(*xy[:, :2].T, label=model, **style.MODELS[model])
            axes.plot(*xy[0, :2], marker="o", ms=3, color="#333333")
            axes.set_aspect("equal")
            axes.set_xlabel("x [m]")
        panels[0].set_ylabel("y [m]")
        style.finish(figure, panels[0], title)
    return figure


def deviations(dataset: xr.Dataset, title: str = "") -> Figure:
    """Return ‖e‖ [px] and the camera's horizontal distance from the target [mm] over time."""
    letters = dataset["letter"].to_numpy()
    with style.applied():
        figure = style.new_figure(height=3.6)
        grid = figure.subplots(2, len(letters), squeeze=False, sharex=True, sharey="row")
        for column, letter in enumerate(letters):
            for model in dataset["model"].to_numpy():
                flight = dataset.sel(letter=letter, model=model)
                norm = feature_norm(flight)
                off = samples(flight, "camera_position", "axis")
                off = off - samples(flight, "target_position", "axis")
                style.line(grid[0, column], flight, norm, model)
                style.line(grid[1, column], flight, 1e3 * np.linalg.norm(off[:, :2], axis=1), model)
            grid[0, column].set_title(str(letter))
            grid[1, column].set_xlabel("time [s]")
        for axes in grid.flat:
            axes.set_yscale("log")
        grid[0, 0].set_ylabel("feature error ‖e‖ [px]")
        grid[1, 0].set_ylabel("camera off target [mm]")
        style.finish(figure, grid[0, 0], title)
    return figure


def speed_and_difference(dataset: xr.Dataset, printed: float, title: str = "") -> Figure:
    """Return ‖q̇‖ and DS over time of each letter, DS with its transient and its rest apart."""
    letters = dataset["letter"].to_numpy()
    with style.applied():
        figure = style.new_figure(height=5.0)
        grid = figure.subplots(3, len(letters), squeeze=False, sharey="row")
        for column, letter in enumerate(letters):
            flights = dataset.sel(letter=letter)
            errors = {}
            for model in dataset["model"].to_numpy():
                flight = flights.sel(model=model)
                style.line(grid[0, column], flight, joint_speed(flight), model)
                errors[model] = feature_norm(flight)
            time = dataset["time"].to_numpy()
            early = time <= TRANSIENT
            for model, norm in errors.items():
                if model == "coupled":
                    continue
                ds = errors["coupled"] - norm
                grid[1, column].plot(time[early], ds[early], label=model, **style.MODELS[model])
                if model == "decoupled":
                    grid[2, column].plot(time[~early], ds[~early], **style.MODELS[model])
            for sign in (-1.0, 1.0):
                grid[2, column].axhline(sign * printed, color=style.PAPER_COLOUR, lw=0.8, ls=":")
            grid[0, column].set_title(str(letter))
            grid[0, column].set_yscale("log")
            grid[2, column].set_xlabel("time [s]")
        grid[0, 0].set_ylabel("joint speed $\\Vert\\dot q\\Vert$\n[mixed units]")
        grid[1, 0].set_ylabel("DS up to 2 s [px]")
        grid[2, 0].set_ylabel("DS after 2 s [px]\n(dotted: paper)")
        style.finish(figure, grid[0, 0], title)
    return figure


def joint_speed(flight: xr.Dataset) -> Array:
    """‖q̇‖ over time: velocity, angular velocity and bend rate in one norm, as the paper plots."""
    parts = [
        samples(flight, name, axis)
        for name, axis in (
            ("velocity", "axis"),
            ("angular_velocity", "axis"),
            ("bend_rate", "bend_axis"),
        )
    ]
    return np.linalg.norm(np.hstack(parts), axis=1)


def image(dataset: xr.Dataset, vehicle_camera: Any, title: str = "", model: str = "coupled"
) -> Figure:  # fmt: skip
    """Return the paths of the feature points in the image [px], one panel per letter."""
    letters = dataset["letter"].to_numpy()
    width, height = vehicle_camera.image_size
    colours = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
    with style.applied():
        figure = style.new_figure(height=2.3)
        panels = figure.subplots(1, len(letters), squeeze=False, sharey=True)[0]
        for axes, letter in zip(panels, letters, strict=True):
            flight = dataset.sel(letter=letter, model=model)
            pixels = samples(flight, "features", "pixel")
            wanted = pixels[0] + samples(flight, "feature_error", "pixel")[0]
            for point in range(pixels.shape[1] // 2):
                colour = colours[point % len(colours)]
                u, v = pixels[:, 2 * point], pixels[:, 2 * point + 1]
                axes.plot(u, v, color=colour, lw=0.9)
                axes.plot(u[0], v[0], marker="o", ms=3, color=colour)
                axes.plot(*wanted[2 * point : 2 * point + 2], marker="+", ms=7, color="#333333")
            axes.set(xlim=(0, width), ylim=(height, 0), aspect="equal", title=str(letter))
            axes.set_xlabel("u [px]")
        panels[0].set_ylabel("v [px]")
        figure.suptitle(
            f"{title}: feature points from start (dot) to desired (cross)", fontsize=9, x=0.01,
            ha="left",
        )  # fmt: skip
    return figure


def stability(dataset: xr.Dataset, bound: dict[str, float], title: str = "") -> Figure:
    """Return the paper's V, the sound V [J] and ‖e_a‖ beside its ultimate bound, over time."""
    with style.applied():
        figure = style.new_figure(height=2.6)
        left, right = figure.subplots(1, 2)
        flight = dataset.isel(letter=0).sel(model="coupled")
        time = flight["time"].to_numpy()
        left.plot(time, flight["lyapunov_paper"], color="#D55E00", lw=1.0, label="paper's V")
        left.plot(time, flight["lyapunov_sound"], color="#000000", lw=1.0, label="sound V")
        left.set(yscale="log", xlabel="time [s]", ylabel="V [J]")
        left.legend()
        right.plot(time, flight["servo_error"], color="#000000", lw=1.0, label=r"$\Vert e_a\Vert$")
        right.axhline(
            bound["radius_least"], color="#D55E00", lw=1.0, ls="--", label="least radius of proof"
        )
        right.set(yscale="log", xlabel="time [s]", ylabel=r"$\Vert e_a\Vert$")
        right.legend(loc="center right")
        figure.suptitle(title, fontsize=9, x=0.01, ha="left")
    return figure


def write(
    results: dict[str, Any],
    datasets: dict[str, xr.Dataset],
    camera: Any,
    file: Callable[[str], Path],
) -> None:
    """Write all figures of the study as PNG and PDF; `file` gives the path of a name."""
    name = style.plain(results["vehicle"]["name"])
    for setting, dataset in datasets.items():
        title = f"{setting}, vehicle {name}"
        style.save(traces(dataset, f"Tip traces, {title}"), f"traces_{setting}", file)
        style.save(deviations(dataset, f"Errors, {title}"), f"errors_{setting}", file)
        if dataset.sizes["model"] > 1:
            figure = speed_and_difference(
                dataset, results["printed"]["ds_max_px"], f"Speed and DS, {title}"
            )
            style.save(figure, f"speed_ds_{setting}", file)
        style.save(image(dataset, camera, f"Image, {title}"), f"image_{setting}", file)
        bound = (results if setting == results["setting"] else results["settings"][setting])[
            "ultimate_bound"
        ]
        letter = dataset["letter"].to_numpy()[0]
        style.save(
            stability(dataset, bound, f"Stability, letter {letter}, {title}"),
            f"stability_{setting}",
            file,
        )
