"""Draw the figure of docs/howto/export.md: the transfer of examples/mpc_transfer.py."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np

from continuair.figures import style

HERE = Path(__file__).parent


def main() -> None:
    example = runpy.run_path(str(HERE.parent / "examples" / "mpc_transfer.py"))
    (states, inputs), knots = example["planned"](), example["KNOTS"]
    flight = example["flown"](inputs)
    with style.applied():
        figure = style.new_figure(height=2.2)
        place, bend, thrust = figure.subplots(1, 3)
        place.plot(flight.time, flight.position.sel(axis="x"), **style.MODELS["coupled"])
        bend.plot(flight.time, flight.bend.sel(bend_axis="x"), **style.MODELS["coupled"])
        for panel, row in ((place, 0), (bend, 3)):
            panel.plot(knots, states[row], ".", color=style.MODELS["decoupled"]["color"], ms=4)
        for each in flight.rotor_thrust.transpose("rotor", "time"):
            thrust.plot(flight.time, each, **style.MODELS["coupled"])
        for panel in (place, bend, thrust):
            panel.axvspan(knots[-1], float(flight.time[-1]), color="#f4f4f4", zorder=0)
            panel.set(xlabel="time [s]", xlim=(0.0, float(flight.time[-1])))
        place.set(ylabel="x [m]")
        bend.set(ylabel="bend [1/m]")
        thrust.set(ylabel="thrust of a rotor [N]")
        after = np.abs(flight.bend.sel(time=slice(example["TIME"], None))).max()
        style.head(
            figure,
            f"A planned transfer leaves a bend of {float(after):.0e} 1/m",
            f"{example['DISTANCE']:g} m in {example['TIME']:g} s, vehicle slender with rotors. "
            "Dots: the plan in CasADi; lines: the flight, open loop. Shaded: afterwards.",
        )
    style.save_as(figure, HERE / "images" / "mpc_transfer.png")


if __name__ == "__main__":
    main()
