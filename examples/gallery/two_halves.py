"""
A push in two halves leaves the arm at rest
===========================================

A short push sideways sets the arm ringing. The same push in two halves, the second one half a
period of the free vehicle's mode later, moves the vehicle as far, and the second half cancels
what the first began.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca

WIDTH, STRENGTH = 0.05, 8.0


def pulse(starts: list[float], weight: float) -> dict[str, object]:
    """A sideways force in equal pulses from times [s] on, and when it jumps."""

    def force(t: float) -> tuple[float, float, float]:
        on = sum(start <= t < start + WIDTH for start in starts)
        return STRENGTH * on / len(starts), 0.0, weight

    ends = [start + WIDTH for start in starts]
    return {"force": force, "jumps": tuple(sorted({*starts, *ends}))}


def main() -> None:
    vehicle = ca.load_vehicle("slender")
    half = np.pi / ca.modes(vehicle, gravity=0.0).frequencies[0]
    figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
    for starts, colour, name in (
        ([0.2], "#999999", "one push"),
        ([0.2, 0.2 + half], "black", "two halves"),
    ):
        q = [0, 0, 3, 0, 0, 0, 0, 0]
        pushed = ca.Scenario(name, q, duration=1.5, **pulse(starts, 9.81 * vehicle.mass))
        bend = ca.simulate(vehicle, pushed, variables=["bend"]).bend
        axes.plot(bend.time, bend[:, 0], color=colour, label=name)
        print(f"{name}: rings by {float(abs(bend.sel(time=slice(1, None))).max()):.1e} 1/m")
    axes.set(xlabel="time [s]", ylabel="bend along x [1/m]")
    axes.legend()
    plt.show()


if __name__ == "__main__":
    main()
