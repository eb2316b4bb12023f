"""Arms that are carried along by what pushes their vehicle: for laws of several sections."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from continuair import checks
from continuair.controllers.inertias import bend_inertia, straight_inertia
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle


@dataclass(frozen=True, eq=False)
class Carried:
    """Moments on the bends that keep arms straight while a push moves their vehicle.

    per_push (bends, 6): bend moments [N m²] per force [N] and moment [N m] on the body, in its
    axes; inertia (bends, bends): of the straight arms on a fixed base [kg m⁴]; rate: of each bend's
    critically damped loop about straight [rad/s].
    """

    per_push: np.ndarray
    inertia: np.ndarray
    rate: float


def carried(vehicle: Vehicle, rate: float) -> Carried:
    """What carries the arms of a vehicle, all of them, at a rate [rad/s]. Raises InputError.

    The moments are M_bu M_uu⁻¹ times the push, M of the straight vehicle: what the bends' inertia
    asks for when the push moves it as a rigid body.
    """
    check_single_vehicle(vehicle)
    return Carried(*_carrying(vehicle), checks.positive("bend_rate", rate, " [rad/s]"))


# Many gains are designed for one vehicle.
@lru_cache(maxsize=1024)
def _carrying(vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    M = straight_inertia(vehicle)
    per_push = np.linalg.solve(M[:6, :6], M[:6, 6:]).T
    return checks.frozen(per_push), checks.frozen(bend_inertia(vehicle))
