"""Where the mass of a vehicle is when its arm is bent."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.backbone import backbone_point
from continuair.analysis.metrics import samples
from continuair.equations.arc import arc_tangent
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

    bend: bend vectors (runs, time, 2). Body axes.
    """
    mount = np.asarray(vehicle.uav.mount)[..., None, :]
    kappa, psi = np.linalg.norm(bend, axis=-1), np.arctan2(bend[..., 1], bend[..., 0])
    first: Array = np.zeros((*bend.shape[:-1], 3))
    second: Array = np.zeros((*first.shape, 3))
    own = np.asarray(vehicle.uav.inertia)
    turning = np.array(np.broadcast_to(own[:, None] if own.ndim == 3 else own, second.shape))
    for mass, s, transverse, axial in map(_columns, _slices(vehicle)):
        r = mount + backbone_point(bend, s)
        first += mass[..., None] * r
        second += mass[..., None, None] * r[..., :, None] * r[..., None, :]
        t = arc_tangent(kappa, psi, s)
        along = (axial - transverse)[..., None, None] * t[..., :, None] * t[..., None, :]
        turning += transverse[..., None, None] * np.eye(3) + along
    total = _columns([vehicle.mass])[0][..., None]
    com: Array = first / total
    second -= total[..., None] * com[..., :, None] * com[..., None, :]
    trace = np.trace(second, axis1=-2, axis2=-1)[..., None, None]
    return com, turning + trace * np.eye(3) - second


def straight_arm_inertia(vehicle: Vehicle) -> float:
    """Return the inertia of the straight arm about its base, across its axis [kg m²]."""
    return float(sum(mass * s**2 + transverse for mass, s, transverse, _ in _slices(vehicle)))


def _slices(vehicle: Vehicle) -> list[tuple[Any, Any, Any, Any]]:
    """Mass, arc length, transverse and axial inertia of slices that stand for the arm."""
    arm = vehicle.arm
    parts = arm.backbone_mass, arm.transverse_inertia_per_length, arm.axial_inertia_per_length
    mass, transverse, axial = parts[0], parts[1] * arm.length, parts[2] * arm.length
    backbone = [
        (mass * w / 2, arm.length * (1 + x) / 2, transverse * w / 2, axial * w / 2)
        for x, w in zip(_NODES, _WEIGHTS, strict=True)
    ]
    disks = [
        (disk.mass, disk.position, disk.transverse_inertia, disk.axial_inertia)
        for disk in arm.disks
    ]
    return backbone + disks


def _columns(values: Iterable[Any]) -> list[Array]:
    """Numbers or arrays over runs, to multiply arrays over (runs, time)."""
    return [np.atleast_1d(np.asarray(value, float))[:, None] for value in values]
