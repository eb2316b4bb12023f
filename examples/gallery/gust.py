"""
A quadrotor leans into a gust, and its arm hardly feels it
==========================================================

A flight controller holds a quadrotor whose rotors lag. A gust of 6 m/s, which acts on the UAV
alone, carries it aside within a second, and it leans into it by some degrees. That is slow beside
the arm, which bends by thousandths of a radian.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca

ROTORS = {
    "layout": "quad_x",
    "lever": 0.2,
    "thrust_limits": [0.2, 12.0],
    "torque_per_thrust": 0.016,
    "lag": 0.04,
}


def main() -> None:
    vehicle = ca.load_vehicle("slender").replace(
        {"uav.rotors": ROTORS, "uav.drag": {"linear": [0.3, 0.3, 0.1]}, "arm.damping_ratio": 0.02}
    )
    law = ca.flight_controller(vehicle, bend_bandwidth=0.0)
    wind = ca.gust((6, 0, 0), start=1.0, duration=1.0)
    start = [0, 0, 2, 0, 0, 0, 0, 0]
    scenario = ca.Scenario("gust", start, controller=law, wind=wind, duration=6.0)
    flight = ca.simulate(vehicle, scenario, sample=0.01, variables=["position", "q", "bend"])
    figure, rows = plt.subplots(3, 1, sharex=True, figsize=(6, 5), layout="constrained")
    rows[0].plot(flight.time, 100 * flight.position[:, 0], color="black")
    rows[1].plot(flight.time, np.degrees(flight.q[:, 4]), color="black")
    rows[2].plot(flight.time, flight.bend[:, 0], color="#D55E00")
    names = ("place along x [cm]", "pitch [°]", "bend along x [1/m]")
    for axes, name in zip(rows, names, strict=True):
        axes.axvspan(1.0, 2.0, color="#e4eef8")
        axes.set(ylabel=name)
    rows[0].annotate("gust", (1.5, 0.9), xycoords=("data", "axes fraction"), ha="center", va="top")
    rows[2].set(xlabel="time [s]")
    plt.show()


if __name__ == "__main__":
    main()
