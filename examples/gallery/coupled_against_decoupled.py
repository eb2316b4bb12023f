"""
Without its reaction on the UAV, the arm swings too slowly
==========================================================

Test A of the paper: 100 N push the UAV sideways for a second. The coupled arm swings on a UAV
that gives way, the decoupled one as on a rock: their phases drift apart, and so do their tips.
"""

import matplotlib.pyplot as plt

import continuair as ca
from amiri2026 import open_loop_test


def main() -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.03})
    test = open_loop_test("A")
    figure, (bends, errors) = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
    flights = {model: ca.simulate(vehicle, test, model=model) for model in ca.MODELS[:2]}
    for (model, flight), colour in zip(flights.items(), ("black", "#D55E00"), strict=True):
        bends.plot(flight.time, flight.bend[:, 0], color=colour, label=model)
    apart = flights["coupled"].tip_position - flights["decoupled"].tip_position
    errors.plot(apart.time, (apart**2).sum("axis") ** 0.5, color="#0072B2")
    bends.set(ylabel="bend towards x [1/m]")
    bends.legend()
    errors.set(xlabel="time [s]", ylabel="tips apart [m]")
    found = ca.compare(*flights.values())
    print(
        f"RMS distance of the tips: {found['rmse_t_m']:.3f} m, angle {found['angle_rad']:.2f} rad"
    )
    plt.show()


if __name__ == "__main__":
    main()
