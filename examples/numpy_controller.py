"""A controller in plain NumPy, at its own rate: fly over a target until it is in the middle."""

import numpy as np
import xarray as xr

import continuair as ca
from continuair import equations

RATE, TURN_RATE = 1.5, 8.0


def push(vehicle: ca.Vehicle, sim: ca.Simulation) -> np.ndarray:
    """Generalised forces (8,): carry the weight, stay level, go to where the image says."""
    q, qd, seen = sim.q, sim.qd, sim.observe()
    # The mean feature error as an offset on the ground: image x is world x, image y is -world y.
    error = (seen.features - seen.desired).reshape(-1, 2) / vehicle.camera.focal_length
    right, down = (error * seen.depth[:, None]).mean(axis=0)
    goal = q[:3] + [right, -down, 0.0]
    goal[2] = 3.0
    tau = equations.weight_vector(vehicle, q)
    tau[:3] += vehicle.mass * RATE * (RATE * (goal - q[:3]) - 2 * qd[:3])
    inertia = np.diag(ca.rigid_inertia(vehicle))[3:]
    tau[3:6] -= inertia * TURN_RATE * (TURN_RATE * q[3:6] + 2 * qd[3:6])
    return tau


def fly(duration: float = 6.0) -> xr.Dataset:
    """The flight, with a new push every 5 ms."""
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
    scenario = ca.Scenario(
        "over the target", [0.4, -0.3, 3, 0, 0, 0, 0.1, 0], target=ca.Target(ca.paths.hold())
    )
    sim = ca.Simulation(vehicle, scenario, control_period=5e-3)
    while sim.time < duration:
        sim.step(push(vehicle, sim))
    return sim.trajectory()


def main() -> None:
    error = np.abs(fly().feature_error.to_numpy()).max(axis=1)
    print(f"largest feature error: {error[0]:.0f} px at the start, {error[-1]:.2f} px at the end")


if __name__ == "__main__":
    main()
