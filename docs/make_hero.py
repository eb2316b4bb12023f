"""Draw docs/images/hero.gif: one flight of a quadrotor with a bending arm, by two models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.animation import PillowWriter

import continuair as ca
from continuair.figures import pictogram, style

PERIOD = 3.0  # [s]
FRAMES_PER_SECOND = 20
SETTLED = 3  # periods before the one that is shown, which then repeats itself
VEHICLE = ca.load_vehicle("two_section")


def fly() -> xr.Dataset:
    """Return one period of flight to and fro, with the arm bent by its servos, by both models."""
    rate = 2.0 * np.pi / PERIOD
    commands = ca.Setpoints(
        position=lambda t: [0.6 * np.sin(rate * t), 0.0, 2.0],
        velocity=lambda t: [0.6 * rate * np.cos(rate * t), 0.0, 0.0],
        bend=lambda t: [3.0 * np.sin(rate * t), 0.0] * 2,
    )
    scenario = ca.Scenario(
        "to and fro",
        [0, 0, 2, 0, 0, 0, 0, 0, 0, 0],
        controller=ca.flight_controller(VEHICLE),
        setpoints=commands,
        duration=(SETTLED + 1) * PERIOD,
    )
    kept = ["position", "attitude", "bend", "tip_position"]
    flights = [
        ca.simulate(VEHICLE, scenario, model=model, variables=kept, sample=1.0 / FRAMES_PER_SECOND)
        for model in ("coupled", "decoupled")
    ]
    both = xr.concat(flights, "model").assign_coords(model=["coupled", "decoupled"])
    last = both.isel(time=slice(SETTLED * FRAMES_PER_SECOND * int(PERIOD), None))
    return last.assign_coords(time=last["time"] - last["time"][0])


def draw(axes: Any, flights: xr.Dataset, time: float) -> None:
    """Draw both vehicles at a time in place, and the paths of their tips."""
    axes.clear()
    place = flights["position"].sel(model="coupled").sel(time=time, method="nearest").to_numpy()
    for model in ("decoupled", "coupled"):
        path = flights["tip_position"].sel(model=model).to_numpy().reshape(-1, 3) - place
        axes.plot(path[:, 0], path[:, 2], color=style.MODELS[model]["color"], lw=1.0, alpha=0.4)
    pictogram.draw(axes, flights, VEHICLE, [time], 0.0, ["decoupled", "coupled"])
    for text in list(axes.texts):
        text.remove()
    # Drawn about the vehicle: moved back to where it is in the world.
    axes.set_xlim(-1.45 - place[0], 1.45 - place[0])
    axes.set_ylim(1.36 - place[2], 2.24 - place[2])


def main() -> None:
    flights = fly()
    path = Path(__file__).parent / "images" / "hero.gif"
    with style.applied():
        figure = style.new_figure(7.2, 2.6)
        axes: Any = figure.subplots()
        draw(axes, flights, 0.0)
        style.model_legend(figure, axes)
        figure.draw_without_rendering()
        figure.set_layout_engine(None)  # the same frame throughout
        writer = PillowWriter(fps=FRAMES_PER_SECOND)
        with writer.saving(figure, str(path), dpi=110):
            for time in flights["time"].to_numpy()[:-1]:
                draw(axes, flights, float(time))
                writer.grab_frame()


if __name__ == "__main__":
    main()
