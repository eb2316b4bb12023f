"""Inertia and weight of a level vehicle, its arms at any coordinates of sections of any kind.

In the axes of the UAV, about B's origin. Derivatives by the coordinates are by complex steps
through the products of exponentials of `rod_curve`, of which an arc is the constant case: straight
arms are not singular.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from continuair.equations.kinematics import skew
from continuair.equations.masses import slices
from continuair.equations.strain import rod_curve
from continuair.equations.turns import Array, of_quaternion
from continuair.vehicle.vehicle import Vehicle

_STEP = 1e-100
"""Complex step, which loses no digits."""

_NODES = 16
"""Gauss-Legendre nodes of a section."""


class _Bodies(NamedTuple):
    """Slices and disks of a section, or the body on a tip.

    mass, inertia: (n,) and (n, 3, 3) in own axes; place, axes: (..., n, 3) and (..., n, 3, 3).
    """

    mass: Array
    inertia: Array
    place: Array
    axes: Array


def level_inertia(vehicle: Vehicle, bends: Array) -> Array:
    """Return the mass matrix of a level vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    bends : array (n,)
        Coordinates of all sections, as in a state: the bend vectors of arcs [1/m].

    Returns
    -------
    array (6 + n, 6 + n)
        M, for the velocity of B's origin, the angular velocity and the rates of the coordinates.
    """
    count = len(bends)
    M = np.zeros((6 + count, 6 + count))
    M[:3, :3] = vehicle.uav.mass * np.eye(3)
    M[3:6, 3:6] = np.asarray(vehicle.uav.inertia)
    rows = np.asarray(bends, float) + 1j * _STEP * np.vstack([np.zeros(count), np.eye(count)])
    for bodies in _bodies(vehicle, rows):
        place, axes = bodies.place[0].real, bodies.axes[0].real
        moved = bodies.place[1:].imag / _STEP
        turned = bodies.axes[1:].imag / _STEP @ axes.swapaxes(-1, -2)
        J = np.zeros((len(place), 6, 6 + count))
        J[:, :3, :3] = J[:, 3:, 3:6] = np.eye(3)
        J[:, :3, 3:6] = -skew(place)
        J[:, :3, 6:] = np.moveaxis(moved, 0, -1)
        for axis, (row, column) in enumerate([(2, 1), (0, 2), (1, 0)]):
            J[:, 3 + axis, 6:] = turned[..., row, column].T
        M += np.einsum("p,pia,pib->ab", bodies.mass, J[:, :3], J[:, :3])
        own = axes @ bodies.inertia @ axes.swapaxes(-1, -2)
        M += np.einsum("pia,pij,pjb->ab", J[:, 3:], own, J[:, 3:])
    return np.asarray(0.5 * (M + M.T))


def level_height(vehicle: Vehicle, bends: Array) -> Array:
    """Return Σ m z (...) [kg m] of the arms of a level vehicle at coordinates (..., n)."""
    found = np.zeros(np.shape(bends)[:-1], np.asarray(bends).dtype)
    for bodies in _bodies(vehicle, np.asarray(bends)):
        found = found + bodies.place[..., 2] @ bodies.mass
    return found


def _bodies(vehicle: Vehicle, bends: Array) -> Iterator[_Bodies]:
    """Yield the bodies of each section, and of each tip, at coordinates (..., n)."""
    first = 0
    for arm in vehicle.arms:
        place: Array = np.asarray(arm.mount, float)
        axes: Array = of_quaternion(arm.attitude)
        for section in arm.section:
            own = bends[..., first : first + section.coordinates]
            first += section.coordinates
            s, mass, transverse, axial = slices(section, _NODES)
            order = np.argsort(s)
            ends = np.append(s[order], section.length)
            points, frames = rod_curve(section.orders, section.length, own, ends)
            points = place[..., None, :] + np.einsum("...ij,...pj->...pi", axes, points)
            frames = axes[..., None, :, :] @ frames
            inertia = np.stack([transverse, transverse, axial], axis=-1)[order]
            yield _Bodies(
                mass[order], inertia[:, None] * np.eye(3), points[..., :-1, :],
                frames[..., :-1, :, :],
            )  # fmt: skip
            place, axes = points[..., -1, :], frames[..., -1, :, :]
        if arm.tip is not None:
            # The axes of a tip have z out of the arm.
            turned = axes @ np.diag([1.0, -1.0, -1.0])
            at = place + turned @ np.asarray(arm.tip.centre)
            yield _Bodies(
                np.array([arm.tip.mass]), np.asarray(arm.tip.inertia)[None], at[..., None, :],
                turned[..., None, :, :],
            )  # fmt: skip
