"""Arms kept straight as an actuator wrench moves their vehicle: for laws of several sections."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import warp as wp

from continuair import checks
from continuair.controllers.inertias import bend_inertia, straight_inertia
from continuair.device.types import room
from continuair.kernels.sensing.sense import LawCode
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle


@dataclass(frozen=True, eq=False)
class Carried:
    """Moments on the bends that keep arms straight while a wrench moves their vehicle.

    per_push (bends, 6): bend moments [N m²] per force [N] and moment [N m] on the body, in its
    axes. inertia (bends, bends): of the straight arms on a fixed base [kg m⁴]. rate: of each bend's
    critically damped loop about straight [rad/s].
    """

    per_push: np.ndarray
    inertia: np.ndarray
    rate: float


def carried(vehicle: Vehicle, rate: float) -> Carried:
    """Return the moments that keep all arms of a vehicle straight, with loops of a rate [rad/s].

    The moments are M_bu M_uu⁻¹ times the wrench, M of the straight vehicle: those that the bends'
    inertia needs when the wrench moves it as a rigid body. Raises InputError.
    """
    check_single_vehicle(vehicle, strain=True)
    return Carried(*_carrying(vehicle), checks.positive("bend_rate", rate, " [rad/s]"))


# Many gains are designed for one vehicle.
@lru_cache(maxsize=1024)
def _carrying(vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    M = straight_inertia(vehicle)
    per_push = np.linalg.solve(M[:6, :6], M[:6, 6:]).T
    return checks.frozen(per_push), checks.frozen(bend_inertia(vehicle))


def carrying_gains(code: LawCode) -> dict[str, Any]:
    """Return the types of the gains that make the arms follow the body."""
    Real, bends = code.Real, code.bends
    return {
        "per_push": wp.types.matrix((room(bends), 6), Real),
        "bend_inertia": wp.types.matrix((room(bends), room(bends)), Real),
        "bend_rate": Real,
    }


def carrying_control(code: LawCode, Gains: Any, wrench_of: Any) -> Any:
    """Return the function (sense, gains) of the wrench: on the camera, and on the arms with it."""
    vec3, Bends, bends = code.vec3, code.Bends, code.bends
    Sense, push, camera_push, two = code.Sense, code.push, code.camera_push, code.Real(2.0)
    force_of, moment_of = code.force_of, code.moment_of

    @wp.func
    def carrying(sense: Sense, gains: Gains, force: vec3, moment: vec3):
        """Moments on the bends under a wrench on the body, both in its axes."""
        w = gains.bend_rate
        out = Bends()
        for i in range(bends):
            for j in range(3):
                out[i] = out[i] + gains.per_push[i, j] * force[j]
                out[i] = out[i] + gains.per_push[i, 3 + j] * moment[j]
            for j in range(bends):
                back = w * (w * sense.bend[j] + two * sense.bend_rate[j])
                out[i] = out[i] - gains.bend_inertia[i, j] * back
        return out

    @wp.func
    def control(sense: Sense, gains: Gains):
        frozen = camera_push(sense, wrench_of(sense, gains))
        force = force_of(frozen)
        moment = moment_of(frozen)
        bend = carrying(sense, gains, wp.quat_rotate_inv(sense.attitude, force), moment)
        tau = sense.weight + gains.spring * sense.spring
        return tau + push(force, moment, bend - gains.posture * sense.bend_rate)

    return control
