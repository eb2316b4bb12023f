"""
A second section lets the arm bow while its gripper stays in place
==================================================================

The bending modes of the preset with two sections, in one plane. In the lower one both sections
swing to one side, and the gripper with them. In the upper one, ten times as fast, they bend
against each other. An arm of one section has the lower one only.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca


def main() -> None:
    vehicle = ca.load_vehicle("two_section")
    found = ca.modes(vehicle, base="clamped")
    # Of each frequency there are two modes, along x and along y.
    in_plane = [i for i in range(4) if np.abs(found.shapes[0::2, i]).max() > 0.5]
    figure, panels = plt.subplots(1, 2, sharey=True, figsize=(6, 3.5), layout="constrained")
    for axes, mode in zip(panels, in_plane, strict=True):
        shape = found.shapes[0::2, mode] / np.abs(found.shapes[0::2, mode]).max()
        for size in np.linspace(-3.0, 3.0, 7):
            q = np.zeros(10)
            q[6::2] = size * shape + 1e-9
            path = [
                ca.equations.position(vehicle, q, np.linspace(0, part.length, 30), section=index)
                for index, part in enumerate(vehicle.arms[0].section)
            ]
            for points, colour in zip(path, ("black", "#D55E00"), strict=True):
                axes.plot(points[:, 0], points[:, 2], color=colour, alpha=0.3 + 0.1 * abs(size))
        hertz = found.frequencies[mode] / (2 * np.pi)
        axes.set(title=f"{hertz:.2f} Hz", xlabel="x [m]", xlim=(-0.4, 0.4), aspect="equal")
    panels[0].set(ylabel="z [m]")
    plt.show()


if __name__ == "__main__":
    main()
