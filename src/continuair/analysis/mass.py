"""Centre of mass and inertia of a vehicle with a bent arm."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair.analysis.metrics import samples
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


def centre_of_mass(flown: xr.Dataset, com: Array) -> Array:
    """Return the centre of mass in world axes.

    Parameters
    ----------
    flown : xarray.Dataset
        Flight with position and attitude.
    com : ndarray, shape (runs, time, 3)
        Centre of mass in body axes [m].

    Returns
    -------
    ndarray, shape (runs, time, 3)
        Centre of mass in world axes [m].
    """
    x, y, z, w = np.moveaxis(samples(flown, "attitude", "quaternion"), -1, 0)
    # Unlike SciPy's rotations, this accepts the NaN rows of a flight that stopped early.
    axis = np.stack([x, y, z], axis=-1)
    turned = com + 2 * np.cross(axis, np.cross(axis, com) + w[..., None] * com)
    position: Array = samples(flown, "position", "axis") + turned
    return position


def mass_distribution(vehicle: Vehicle, bend: Array) -> tuple[Array, Array]:
    """Return the centre of mass and the inertia about it, in body axes.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with an [arm] table, or a batch.
    bend : ndarray, shape (runs, time, 2)
        Bend vectors [1/m].

    Returns
    -------
    com : ndarray, shape (runs, time, 3)
        Centre of mass [m].
    inertia : ndarray, shape (runs, time, 3, 3)
        Inertia about it [kg m²].
    """
    κ, ψ = np.linalg.norm(bend, axis=-1), np.arctan2(bend[..., 1], bend[..., 0])
    # First moments in the plane of the bend: along its direction, and down.
    moment = np.zeros((*κ.shape, 2))
    second, tangents = np.zeros((*κ.shape, 2, 2)), np.zeros((*κ.shape, 2, 2))
    for mass, s, transverse, axial in map(_columns, _slices(vehicle)):
        half = 0.5 * κ * s
        sine, cosine = np.sin(half), np.cos(half)
        chord = s * np.sinc(half / np.pi)
        aside, down = chord * sine, chord * cosine
        moment[..., 0] += mass * aside
        moment[..., 1] += mass * down
        _add_square(second, mass, aside, down)
        _add_square(tangents, axial - transverse, 2 * sine * cosine, 1 - 2 * sine**2)
    plane = np.zeros((*κ.shape, 3, 2))
    plane[..., 0, 0], plane[..., 1, 0], plane[..., 2, 1] = np.cos(ψ), np.sin(ψ), -1.0
    return _about_the_centre(vehicle, plane, moment, second, tangents)


def _about_the_centre(
    vehicle: Vehicle, plane: Array, moment: Array, second: Array, tangents: Array
) -> tuple[Array, Array]:
    """Return centre of mass and inertia, from moments of the arm in a plane (..., 3, 2)."""
    slices = [_columns(each) for each in _slices(vehicle)]
    mass, across = (np.sum([each[index] for each in slices], axis=0) for index in (0, 2))
    mount = np.asarray(vehicle.uav.mount)[..., None, :]
    own = np.asarray(vehicle.uav.inertia)
    turned = np.swapaxes(plane, -1, -2)
    arm = (plane @ moment[..., None])[..., 0]
    total = _columns([vehicle.mass])[0][..., None]
    com: Array = (mass[..., None] * mount + arm) / total
    off = mount[..., :, None] * arm[..., None, :]
    spread = plane @ second @ turned + off + np.swapaxes(off, -1, -2)
    spread += mass[..., None, None] * mount[..., :, None] * mount[..., None, :]
    spread -= total[..., None] * com[..., :, None] * com[..., None, :]
    turning = (own[:, None] if own.ndim == 3 else own) + plane @ tangents @ turned
    trace = (np.trace(spread, axis1=-2, axis2=-1) + across)[..., None, None]
    return com, turning + trace * np.eye(3) - spread


def _add_square(to: Array, weight: Array, x: Array, y: Array) -> None:
    """Add weighted squares (..., 2, 2) of vectors."""
    for (row, column), part in (((0, 0), x * x), ((0, 1), x * y), ((1, 1), y * y)):
        to[..., row, column] += weight * part
    to[..., 1, 0] = to[..., 0, 1]


def straight_arm_inertia(vehicle: Vehicle) -> float:
    """Return the inertia of the straight arm about its base, across its axis.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with an [arm] table.

    Returns
    -------
    float
        Inertia [kg m²].
    """
    return float(sum(mass * s**2 + transverse for mass, s, transverse, _ in _slices(vehicle)))


def _slices(vehicle: Vehicle) -> list[tuple[Any, Any, Any, Any]]:
    """Return mass, arc length, transverse and axial inertia of slices that represent the arm."""
    arm = vehicle.arm
    parts = arm.backbone_mass, arm.transverse_inertia_per_length, arm.axial_inertia_per_length
    mass, transverse, axial = parts[0], parts[1] * arm.length, parts[2] * arm.length
    masses, inertias = arm.mass_shares((1.0 + np.array(_NODES)) / 2.0)
    backbone = [
        (
            mass * (w / 2 * masses[..., k]),
            arm.length * (1 + x) / 2,
            transverse * (w / 2 * inertias[..., k]),
            axial * (w / 2 * inertias[..., k]),
        )
        for k, (x, w) in enumerate(zip(_NODES, _WEIGHTS, strict=True))
    ]
    disks = [
        (disk.mass, disk.position, disk.transverse_inertia, disk.axial_inertia)
        for disk in arm.disks
    ]
    return backbone + disks


def _columns(values: Iterable[Any]) -> list[Array]:
    """Return numbers or arrays over runs as columns that multiply arrays over (runs, time)."""
    return [np.atleast_1d(np.asarray(value, float))[:, None] for value in values]
