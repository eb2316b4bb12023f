"""
A camera at the tip follows a letter that is being written
==========================================================

The paper's visual servoing law flies the vehicle so that the camera at its tip stays two metres
above a target, which writes the letter M within twenty seconds. Seen from above, the camera's
trace is the letter.
"""

import matplotlib.pyplot as plt
import numpy as np

import continuair as ca


def main() -> None:
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
    target = ca.Target(ca.paths.letter("M", duration=20.0))
    law = ca.servoing(**ca.design(vehicle, bandwidth=8.0))
    flight = ca.simulate(
        vehicle,
        ca.Scenario(
            "letter M",
            [-0.3, -0.4, 3.1, 0, 0, 0, 0.1, 0],
            controller=law,
            target=target,
            duration=20.0,
        ),
        sample=0.02,
    )
    figure, (above, errors) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
    place, _, _ = target.path(flight.time.to_numpy())
    above.plot(place[:, 0], place[:, 1], color="#bbbbbb", linewidth=5, label="target")
    above.plot(flight.tip_position[:, 0], flight.tip_position[:, 1], color="black", label="camera")
    above.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    above.legend(loc="lower center")
    size = np.sqrt((flight.feature_error**2).mean(flight.feature_error.dims[1]))
    errors.semilogy(flight.time, size, color="black")
    errors.set(xlabel="time [s]", ylabel="RMS error of the image [px]")
    print(f"RMS error after 5 s: {float(size.sel(time=slice(5, None)).max()):.2f} px at most")
    plt.show()


if __name__ == "__main__":
    main()
