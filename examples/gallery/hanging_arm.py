"""
An arm held out ahead hangs the more, the heavier its gripper
=============================================================

The hover of a vehicle whose arm sticks out: ``trim`` finds the bends into which the arm sinks
under its own weight and that of a gripper, and the force and moment that the UAV has to give.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca

SECTION = {"length": 0.25, "bending_stiffness": 0.35, "mass_per_length": 0.06}
AHEAD = (0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5))  # turns the arm's -z to the body's x


def main() -> None:
    figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
    for mass in (0.0, 0.05, 0.1, 0.2):
        vehicle = ca.Vehicle(
            name="arm held out",
            uav={"mass": 1.8, "inertia": [0.02, 0.02, 0.035]},
            arm=[{"attitude": AHEAD, "section": [SECTION] * 2, "tip": {"mass": mass}}],
        )
        hover = ca.trim(vehicle)
        shape = [
            ca.equations.position(vehicle, hover.q, np.linspace(0, 0.25, 30), section=index)
            for index in (0, 1)
        ]
        path = np.concatenate(shape)
        moment = float(hover.moment[1])
        axes.plot(path[:, 0], path[:, 2], label=f"{1e3 * mass:g} g: {abs(moment):.2f} N m")
    axes.plot(0, 0, marker="s", markersize=12, color="#999999")
    axes.set(xlabel="x ahead [m]", ylabel="z [m]", aspect="equal")
    axes.legend(title="gripper: moment on the UAV")
    plt.show()


if __name__ == "__main__":
    main()
