"""How tendons share the bend moments that a controller asks for."""

from __future__ import annotations

import numpy as np

from continuair.typing import Array
from continuair.vehicle.allocation import pseudo_inverse
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.tendon_path import pieces, stretches
from continuair.vehicle.vehicle import Vehicle


def pulls_of(vehicle: Vehicle, runs: int) -> Array:
    """Return the forces of unit tensions on the coordinates of straight arms.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle, plain or batched.
    runs : int
        Number of runs.

    Returns
    -------
    ndarray, shape (runs, coordinates, tendons)
        Forces on the means of the bends per tension [m²]; 0 for all other coordinates.
    """
    layout = vehicle.layout
    found = np.zeros((runs, layout.bends, vehicle.tendons))
    tendon = section = 0
    for arm in vehicle.arms:
        for group in arm.tendon:
            each, first = pieces(group, arm, runs), 0
            moments = each[..., 0:1] * each[..., 1:3]
            moments /= np.sqrt(1.0 + np.square(each[..., 3:5]).sum(axis=-1))[..., None]
            for part in stretches(group, arm):
                mean = np.array(_means(vehicle, section + part.section))
                whole = moments[:, :, first : first + part.pieces].sum(axis=2)
                found[:, mean, tendon : tendon + group.count] += np.swapaxes(whole, 1, 2)
                first += part.pieces
            tendon += group.count
        section += len(arm.section)
    return found


def shares_of(vehicle: Vehicle, runs: int) -> Array:
    """Return the least tensions (runs, tendons, coordinates) [1/m²] per force on a coordinate."""
    return pseudo_inverse(pulls_of(vehicle, runs))[0]


def lifts(group: Tendon) -> float:
    """Return 1 if a common tension of a group bends no arm, else 0."""
    angles = np.asarray(group.angles, float)
    both = np.hypot(np.cos(angles).sum(axis=-1), np.sin(angles).sum(axis=-1))
    return float(np.all(both < 1e-6))


def _means(vehicle: Vehicle, section: int) -> list[int]:
    """Return the two coordinates of the mean bend of a section, among those of all."""
    first = vehicle.layout.of_section[section].start
    orders = [part.orders for arm in vehicle.arms for part in arm.section][section]
    at = [first + n for n, (_, order) in enumerate(orders.coordinates) if order == 0]
    return at[:2]
