"""
The decoupled model is worst where the arm rings with its load
==============================================================

One call flies sixty-four arms of different radius with both models, while a moment rocks the UAV
at 2 Hz. Stiff arms do not care. The error peaks where the arm, clamped or free, has the frequency
of the load.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca


def main() -> None:
    slender, radii = ca.load_vehicle("slender"), np.geomspace(0.0004, 0.004, 64)
    batch = slender.replace({"arm.radius": radii, "arm.damping_ratio": 0.03})
    rocked = ca.Scenario(
        "rocked",
        [0, 0, 3, 0, 0, 0, 0, 0],
        moment=lambda t: (0.0, 0.3 * np.sin(4 * np.pi * t), 0.0),
        gravity=0.0,
        duration=4.0,
    )
    pairs = ca.run_pairs(batch, rocked).sel(model="decoupled")
    hertz = batch.arm.clamped_frequency / (2 * np.pi)
    figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
    axes.loglog(hertz, pairs.rmse_t_m, color="black", marker=".")
    axes.axvline(2.0, color="#D55E00", linestyle="--", label="load, 2 Hz")
    axes.set(xlabel="clamped frequency of the arm [Hz]", ylabel="RMS error of the tip [m]")
    axes.legend()
    plt.show()


if __name__ == "__main__":
    main()
