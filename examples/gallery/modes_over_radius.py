"""
A UAV that gives way makes its arm ring faster
==============================================

The frequency of an arm on a UAV that is held fast, and on one that flies: the more the arm weighs
beside its UAV, the farther they are apart. 1 less their ratio squared, without gravity, is the
coupling, which decides whether the models may be decoupled.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca


def main() -> None:
    paper, radii = ca.load_vehicle("paper"), np.linspace(0.001, 0.006, 26)
    batch = paper.replace({"arm.radius": radii})
    frequency = {
        base: np.array(
            [
                ca.modes(batch.select(i), base=base, gravity=0.0).frequencies[0]
                for i in range(len(radii))
            ]
        )
        for base in ("clamped", "free")
    }
    figure, (hertz, couplings) = plt.subplots(1, 2, figsize=(7, 3), layout="constrained")
    for base, omega in frequency.items():
        hertz.plot(1e3 * radii, omega / (2 * np.pi), label=f"{base} base")
    hertz.set(xlabel="radius of the arm [mm]", ylabel="lowest frequency [Hz]")
    hertz.legend()
    coupling = 1.0 - (frequency["clamped"] / frequency["free"]) ** 2
    couplings.plot(1e3 * radii, coupling, color="black")
    couplings.set(xlabel="radius of the arm [mm]", ylabel="coupling [-]", ylim=(0, 1))
    print(f"coupling at {1e3 * radii[-1]:g} mm: {coupling[-1]:.2f}")
    plt.show()


if __name__ == "__main__":
    main()
