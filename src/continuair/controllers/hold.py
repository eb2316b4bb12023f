"""Hold a position, an attitude and a bend; kernels/laws/hold.py writes the law."""

from typing import Any

import numpy as np

from continuair.controllers.controller import Controller, number
from continuair.controllers.gains import check_single, rigid_inertia, straight_bend_inertia
from continuair.errors import InputError, shown
from continuair.kernels.laws.hold import law


def hold(
    vehicle: Any,
    position: Any,
    attitude: Any = (0.0, 0.0, 0.0, 1.0),
    bend: Any = (0.0, 0.0),
    *,
    rate: float = 3.0,
    attitude_rate: float = 8.0,
    bend_rate: float = 5.0,
) -> Controller:
    """Hold B's origin at a position (3,) [m], an attitude (x y z w) and a bend vector (2,) [1/m].

    rate, attitude_rate, bend_rate: of the critically damped loops [rad/s]; a bend_rate of 0 leaves
    the arm free, as open-loop users want who look at what it does to the base. Raises InputError.
    """
    at, turn, bent = (
        _numbers(name, value, size)
        for name, value, size in (
            ("position", position, 3),
            ("attitude", attitude, 4),
            ("bend", bend, 2),
        )
    )
    check_single(vehicle)
    if not np.linalg.norm(turn) > 0.0:
        raise InputError(f"attitude is {shown(attitude)}; give a unit quaternion (x, y, z, w).")
    free = number("bend_rate", bend_rate, 0.0) == 0.0
    arm = vehicle.arm
    gains = {
        "position": at,
        "attitude": turn / np.linalg.norm(turn),
        "bend": bent,
        "mass": vehicle.mass,
        "inertia": rigid_inertia(vehicle)[3:, 3:],
        "bend_inertia": straight_bend_inertia(vehicle),
        "stiffness": 0.0 if free else arm.bending_stiffness * arm.length,
        "rate": number("rate", rate, 0.0, above=True),
        "attitude_rate": number("attitude_rate", attitude_rate, 0.0, above=True),
        "bend_rate": bend_rate,
    }
    settings = {"position": at, "attitude": turn, "bend": bent, "rate": rate}
    settings |= {"attitude_rate": attitude_rate, "bend_rate": bend_rate}
    return Controller("hold", law, {k: np.asarray(v) for k, v in gains.items()}, False, settings)


def _numbers(name: str, value: Any, size: int) -> np.ndarray:
    try:
        array = np.array(value, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise InputError(f"{name} is {shown(value)}; give {size} finite numbers.")
    return array
