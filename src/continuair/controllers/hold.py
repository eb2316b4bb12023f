"""Hold a position, an attitude and a bend: PD loops on each, with weight and spring carried."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from continuair.controllers.controller import Controller, number
from continuair.controllers.gains import check_single, rigid_inertia, straight_bend_inertia
from continuair.errors import InputError, shown


def law(code: SimpleNamespace) -> SimpleNamespace:
    """The law on the device."""
    Real, Push, Sense = code.Real, code.Push, code.Sense
    vec2, vec3, quat, mat33 = code.vec2, code.vec3, code.quat, code.mat33
    two, zero, one = Real(2.0), Real(0.0), Real(1.0)

    @wp.struct
    class Gains:
        position: vec3
        attitude: quat
        bend: vec2
        mass: Real
        inertia: mat33
        bend_inertia: Real
        stiffness: Real
        rate: Real
        attitude_rate: Real
        bend_rate: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        w = gains.rate
        f = gains.mass * w * (w * (gains.position - sense.position) - two * sense.velocity)
        turn = wp.quat_inverse(sense.attitude) * gains.attitude
        side = two * wp.where(turn[3] < zero, -one, one)
        w = gains.attitude_rate
        error = side * vec3(turn[0], turn[1], turn[2])
        m = gains.inertia * (w * (w * error - two * sense.angular_velocity))
        w = gains.bend_rate
        b = gains.stiffness * gains.bend
        b += gains.bend_inertia * w * (w * (gains.bend - sense.bend) - two * sense.bend_rate)
        return sense.weight + Push(f[0], f[1], f[2], m[0], m[1], m[2], b[0], b[1])

    return SimpleNamespace(Gains=Gains, control=control)


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
