"""Where the mass of a vehicle is when its arm is bent."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.backbone import backbone_point
from continuair.analysis.metrics import samples
from continuair.vehicle.vehicle import Vehicle

Array = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


def centre_of_mass(flown: xr.Dataset, com: Array) -> Array:
    """Return the centre of mass in world axes (runs, time, 3) from that in body axes [m]."""
    x, y, z, w = np.moveaxis(samples(flown, "attitude", "quaternion"), -1, 0)
    # Unlike SciPy's rotations this lets the rows of a flight that ended early be NaN.
    axis = np.stack([x, y, z], axis=-1)
    turned = com + 2 * np.cross(axis, np.cross(axis, com) + w[..., None] * com)
    position: Array = samples(flown, "position", "axis") + turned
    return position


def mass_distribution(vehicle: Vehicle, bend: Array) -> tuple[Array, Array]:
    """Return the centre of mass (..., 3) [m] and the inertia about it (..., 3, 3) [kg m²].

    bend: bend vectors (runs, time, 2). Body axes. Sections count as points of the backbone: their
    own inertia does not depend on the bend to the order of the radius squared.
    """
    arm = vehicle.arm
    points: list[tuple[Any, Any]] = [
        (arm.backbone_mass * w / 2, np.asarray(arm.length) * (1 + x) / 2)
        for x, w in zip(_NODES, _WEIGHTS, strict=True)
    ]
    points += [(disk.mass, disk.position) for disk in arm.disks]
    mount = np.asarray(vehicle.uav.mount)[..., None, :]
    first: Array = np.zeros((*bend.shape[:-1], 3))
    second: Array = np.zeros((*first.shape, 3))
    for mass, s in points:
        r = mount + backbone_point(bend, _column(s))
        first += _column(mass)[..., None] * r
        second += _column(mass)[..., None, None] * r[..., :, None] * r[..., None, :]
    total = _column(vehicle.mass)[..., None]
    com: Array = first / total
    second -= total[..., None] * com[..., :, None] * com[..., None, :]
    own = np.asarray(vehicle.uav.inertia)
    own = own[:, None] if own.ndim == 3 else own
    trace = np.trace(second, axis1=-2, axis2=-1)[..., None, None]
    return com, own + trace * np.eye(3) - second


def _column(value: Any) -> Array:
    """A number or an array over runs, to multiply arrays over (runs, time)."""
    return np.atleast_1d(np.asarray(value, float))[:, None]
