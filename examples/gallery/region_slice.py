"""
Gains of the image of now bring home what constant gains lose
=============================================================

Two hundred starts, displaced to the side and in yaw, under one law: which of them end with the
image where it is to be? Constant gains are made for the desired image; far from it small errors
of its shape look like large ones, and the loop loses its target. Current gains are made anew at
every instant.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca

ASIDE, YAW = np.linspace(-0.8, 0.8, 17), np.linspace(-0.9, 0.9, 13)


def home(vehicle, gains, starts):
    """Which starts end with every point within 5 px of its place."""
    law, target = ca.design(vehicle, bandwidth=6.0, gains=gains), ca.Target(ca.paths.hold())
    scenario = ca.Scenario("home", starts, controller=ca.servoing(**law), target=target, duration=6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ca.ContinuairWarning)  # lost loops chatter
        flights = ca.simulate(vehicle, scenario, variables=["feature_error"], sample=0.05)
    last = np.abs(flights.feature_error.to_numpy()[:, -1]).max(axis=1)
    return (flights.status.to_numpy() == 0) & (last < 5.0)


def main() -> None:
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
    x, yaw = (each.ravel() for each in np.meshgrid(ASIDE, YAW))
    starts = np.zeros((len(x), 8))
    starts[:, 0], starts[:, 2], starts[:, 5] = x, 3.0, yaw
    figure, panels = plt.subplots(1, 2, sharey=True, figsize=(7, 3), layout="constrained")
    for axes, gains in zip(panels, ("constant", "current"), strict=True):
        came = home(vehicle, gains, starts)
        for kind, mask, colour in (("home", came, "#0072B2"), ("lost", ~came, "#D55E00")):
            axes.scatter(x[mask], yaw[mask], s=50, marker="s", color=colour, label=kind)
        axes.set(xlabel="start aside [m]", title=f"{gains} gains")
        print(f"{gains}: {came.sum()} of {len(x)} come home")
    panels[0].set(ylabel="start in yaw [rad]")
    panels[1].legend(loc="upper left", bbox_to_anchor=(1, 1))
    plt.show()


if __name__ == "__main__":
    main()
