"""The closed loop that these tests share: the paper's vehicle before a target 2 m below it."""

from typing import Any

import numpy as np

import continuair as ca
from continuair.scenario import paths

VEHICLE = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
STILL = ca.Target(paths.hold())


def start(x: float = 0.1, z: float = 0.1, kappa: float = 0.1) -> np.ndarray:
    """Off by x and z [m] from where the camera sees the desired image, and bent."""
    q = np.zeros(8)
    q[0], q[2], q[6] = x, 3.0 + z, kappa
    return q


def scenario(
    controller: ca.Controller | None, duration: float = 1.0, **changes: Any
) -> ca.Scenario:
    fields: dict[str, Any] = {"q": start(), "target": STILL} | changes
    return ca.Scenario("servoing", duration=duration, controller=controller, **fields)


def designed(bandwidth: float = 3.0, **choices: Any) -> ca.Controller:
    return ca.servoing(**ca.design(VEHICLE, bandwidth, conditioning=0.0), **choices)
