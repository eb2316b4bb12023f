"""
Beside the clamped frequency of its arm, a UAV hardly turns
===========================================================

What a moment on the UAV does to its pitch, by frequency, from the linear vehicle. Where the arm
would ring on a base that cannot turn, and may move aside, it takes up the whole moment, and the UAV
does not turn: a little above its frequency on a base that is held fast, 2 % here. Higher up, both
ring together.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca


def main() -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.01})
    A, B = ca.linearize(vehicle, gravity=0.0)
    hertz = np.geomspace(0.3, 30.0, 800)
    moment_y, pitch = 4, 4  # columns of B and rows of the state: 3 of place, then 3 of rotation
    response = [
        np.linalg.solve(2j * np.pi * f * np.eye(len(A)) - A, B[:, moment_y])[pitch] for f in hertz
    ]
    figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
    axes.loglog(hertz, np.abs(response), color="black")
    for base, colour in (("clamped", "#0072B2"), ("free", "#D55E00")):
        frequency = ca.modes(vehicle, base=base, gravity=0.0).frequencies[0] / (2 * np.pi)
        axes.axvline(frequency, color=colour, linestyle="--", label=f"{base}: {frequency:.2f} Hz")
    axes.set(xlabel="frequency [Hz]", ylabel="pitch per moment [rad/(N m)]")
    axes.legend()
    plt.show()


if __name__ == "__main__":
    main()
