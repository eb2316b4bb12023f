"""Hold a position, an attitude and a bend; kernels/laws/hold.py writes the law."""

from typing import Any

import numpy as np

from continuair import checks
from continuair.controllers.controller import Controller
from continuair.controllers.gains import rigid_inertia, straight_bend_inertia
from continuair.errors import InputError, shown
from continuair.kernels.laws.hold import law
from continuair.vehicle.vehicle import check_single_vehicle


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
    check_single_vehicle(vehicle)
    turn = checks.vector("attitude", attitude, 4)
    if not np.linalg.norm(turn) > 0.0:
        raise InputError(f"attitude is {shown(attitude)}; give a unit quaternion (x, y, z, w).")
    settings = {
        "position": checks.vector("position", position, 3),
        "attitude": turn / np.linalg.norm(turn),
        "bend": checks.vector("bend", bend, 2),
        "rate": checks.positive("rate", rate),
        "attitude_rate": checks.positive("attitude_rate", attitude_rate),
        "bend_rate": checks.number("bend_rate", bend_rate, least=0.0),
    }
    arm = vehicle.arm
    plant = {
        "mass": vehicle.mass,
        "inertia": rigid_inertia(vehicle)[3:, 3:],
        "bend_inertia": straight_bend_inertia(vehicle),
        "stiffness": arm.bending_stiffness * arm.length if settings["bend_rate"] else 0.0,
    }
    gains = {name: np.asarray(value) for name, value in (settings | plant).items()}
    return Controller("hold", law, gains, False, settings)
