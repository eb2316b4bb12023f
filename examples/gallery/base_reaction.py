"""
An arm that is let go pulls its base to and fro
===============================================

The UAV is held in its place while its arm swings from a bend of half a radian per metre. What the
arm puts on it, beside its weight, is what holds it: a side force and a moment at the arm's
clamped frequency, whose periods are grey and white.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca


def main() -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.03})
    held = ca.hold(vehicle, (0, 0, 2), rate=60.0, attitude_rate=120.0, bend_rate=0.0)
    swing = ca.Scenario("let go", [0, 0, 2, 0, 0, 0, 0.5, 0], controller=held, duration=2.0)
    flight = ca.simulate(vehicle, swing)
    figure, (forces, moments) = plt.subplots(
        2, 1, sharex=True, figsize=(6, 4), layout="constrained"
    )
    forces.plot(flight.time, flight.base_force[:, 0], color="black")
    forces.set(ylabel="side force [N]")
    moments.plot(flight.time, flight.base_moment[:, 1], color="black")
    moments.set(xlabel="time [s]", ylabel="moment [N m]")
    period = 2 * np.pi / vehicle.arm.clamped_frequency
    for axes in (forces, moments):
        for start in np.arange(0.0, 2.0, 2 * period):
            axes.axvspan(start, start + period, color="#eeeeee")
    print(f"largest moment: {float(abs(flight.base_moment).max()):.2f} N m")
    plt.show()


if __name__ == "__main__":
    main()
