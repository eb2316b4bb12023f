"""Shape the push of a transfer by gradients, so that the arm has stopped ringing when it ends."""

from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize

import continuair as ca

DISTANCE, TIME, KNOTS = 0.4, 0.4, np.linspace(0.0, 0.4, 21)
VEHICLE = ca.load_vehicle("slender")
ARM, UAV = VEHICLE.arm, VEHICLE.uav
GOAL = {"position": [DISTANCE, 0, 3], "attitude": [0, 0, 0, 1]}
WEIGHTS = {"position": 10, "attitude": 10, "bend": 10, "velocity": 3, "angular_velocity": 1,
           "bend_rate": 1}  # fmt: skip
# What takes a rigid vehicle there, level and without a jerk: a force along x, a moment about y.
AT = (KNOTS[1:] + KNOTS[:-1]) / (2 * TIME)
FORCE = VEHICLE.mass * DISTANCE / TIME**2 * (60 * AT - 180 * AT**2 + 120 * AT**3)
LOW = (ARM.length / 2 - UAV.mount[2]) * ARM.mass / VEHICLE.mass
RIGID = np.column_stack([FORCE, -LOW * FORCE])


def transfer(push: np.ndarray) -> ca.Scenario:
    """A hover with a force along x and a moment about y (n, 2) from each knot to the next."""

    def held(t: float, axis: int) -> float:
        return np.append(push[:, axis], 0.0)[np.searchsorted(KNOTS, t, side="right") - 1]

    acting: dict[str, Any] = {"force": lambda t: [held(t, 0), 0, 9.81 * VEHICLE.mass]}
    acting |= {"moment": lambda t: [0, held(t, 1), 0], "jumps": tuple(KNOTS[1:])}
    return ca.Scenario("transfer", [0, 0, 3, 0, 0, 0, 0, 0], duration=TIME + 1, **acting)


def miss(flight: xr.Dataset) -> tuple[float, dict[str, np.ndarray]]:
    """Half the squared, weighted distance of the end from rest at the goal, and its slopes."""
    slopes = {name: np.zeros(flight[name].shape) for name in WEIGHTS}
    value = 0.0
    for name, weight in WEIGHTS.items():
        off = weight * (flight[name].to_numpy()[-1] - GOAL.get(name, 0))
        slopes[name][-1] = weight * off
        value += 0.5 * off @ off
    return value, slopes


def shaped() -> np.ndarray:
    """The push near RIGID that ends at rest, by L-BFGS."""
    size = np.abs(RIGID).max(axis=0)

    def told(x: np.ndarray) -> tuple[float, np.ndarray]:
        found = ca.gradient(VEHICLE, transfer(x.reshape(-1, 2) * size), miss, duration=TIME)
        held = found.held(KNOTS[:-1])
        slopes = np.column_stack([held["force"][:, 0], held["moment"][:, 1]])
        return found.value, (slopes * size).ravel()

    return minimize(told, (RIGID / size).ravel(), jac=True, tol=1e-12).x.reshape(-1, 2) * size


def ringing(push: np.ndarray) -> float:
    """The largest bend in the second after the transfer [1/m]."""
    flight = ca.simulate(VEHICLE, transfer(push), method="RK4", step="auto", variables=["bend"])
    bend = flight.bend
    return float(np.linalg.norm(bend.sel(time=slice(TIME, None)), axis=1).max())


def main() -> None:
    print(f"The arm rings by {ringing(RIGID):.3f} 1/m, and by {ringing(shaped()):.0e} 1/m shaped.")


if __name__ == "__main__":
    main()
