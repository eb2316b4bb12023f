"""
Where a pushed tip ends hangs on lengths and masses, hardly on stiffness
========================================================================

Derivatives of one flight with respect to the vehicle, all from one sweep back over it: how far
the tip's place after half a second moves when a field grows by one per cent.
"""

from operator import attrgetter

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca

FIELDS = ("arm.length", "arm.radius", "arm.youngs_modulus", "arm.density", "uav.mass")


def along_x(flight):
    """The tip's x at the end [m], and its derivatives with respect to the flight."""
    slope = np.zeros(flight["tip_position"].shape)
    slope[-1, 0] = 1.0
    return float(flight["tip_position"][-1, 0]), {"tip_position": slope}


def main() -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.02})
    push = ca.Scenario("push", [0, 0, 3, 0, 0, 0, 0, 0], force=(5.0, 0, 21.0), duration=0.5)
    found = ca.gradient(vehicle, push, along_x, fields=FIELDS)
    now = [attrgetter(field)(vehicle) for field in FIELDS]
    slopes = [float(found.fields[field]) for field in FIELDS]
    figure, axes = plt.subplots(figsize=(6, 2.6), layout="constrained")
    axes.barh(FIELDS, 1e3 * 0.01 * np.multiply(now, slopes), color="#0072B2")
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set(xlabel="the tip moves along x per 1 % more of a field [mm]")
    axes.invert_yaxis()
    plt.show()


if __name__ == "__main__":
    main()
