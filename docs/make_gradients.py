"""Draw the figure of docs/howto/gradients.md: the transfer of examples/quiet_transfer.py."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np

import continuair as ca
from continuair.figures import style

HERE = Path(__file__).parent


def main() -> None:
    example = runpy.run_path(str(HERE.parent / "examples" / "quiet_transfer.py"))
    vehicle, knots, rigid = example["VEHICLE"], example["KNOTS"], example["RIGID"]
    pushes = {"planned for a rigid vehicle": rigid, "shaped by gradients": example["shaped"]()}
    looks = [style.MODELS["decoupled"], style.MODELS["coupled"]]
    with style.applied():
        figure = style.new_figure(height=2.2)
        force, bend = figure.subplots(1, 2)
        for (name, push), look in zip(pushes.items(), looks, strict=True):
            force.step(knots, np.append(push[:, 0], 0.0), where="post", label=name, **look)
            flight = ca.simulate(vehicle, example["transfer"](push), variables=["bend"])
            bend.plot(flight.time, flight.bend.sel(bend_axis="x"), label=name, **look)
        bend.axvspan(knots[-1], float(flight.time[-1]), color="#f4f4f4", zorder=0)
        force.set(xlabel="time [s]", ylabel="force along x [N]")
        bend.set(xlabel="time [s]", ylabel="bend [1/m]", xlim=(0.0, float(flight.time[-1])))
        style.head(
            figure,
            "Forces that hardly differ: one leaves the arm ringing, one at rest",
            f"A transfer by {example['DISTANCE']:g} m in {example['TIME']:g} s; vehicle "
            f"{vehicle.name}. Shaded: afterwards.",
            handles=style.model_handles(bend),
        )
    style.save_as(figure, HERE / "images" / "quiet_transfer.png")


if __name__ == "__main__":
    main()
