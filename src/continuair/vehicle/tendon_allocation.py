"""How tendons share the bend moments that a controller asks for."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from continuair.typing import Array
from continuair.vehicle.allocation import pseudo_inverse
from continuair.vehicle.runs import per_run
from continuair.vehicle.tendon_path import pieces, stretches
from continuair.vehicle.vehicle import Vehicle

_BALANCED = 1e-3
"""Sum of unit pulls up to which they balance; angles in files are rounded."""


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


def lifts_of(vehicle: Vehicle, runs: int) -> Array:
    """Return tensions (runs, tendons) of each group that bend no arm, none below 1.

    They are 0 in a group without such tensions, whose tendons are all on one side.
    """
    found = [np.zeros((runs, 0))]
    for group in (group for arm in vehicle.arms for group in arm.tendon):
        angles = per_run(group.angles, runs, group.count)
        distinct, rows = np.unique(angles, axis=0, return_inverse=True)
        found.append(np.array([_balance(each) for each in distinct])[rows.ravel()])
    return np.hstack(found)


def _balance(angles: Array) -> Array:
    """Return the least tensions of 1 or more at some angles whose pulls sum to 0, or zeros."""
    pulls = np.stack([np.cos(angles), np.sin(angles)])
    beyond, missing = nnls(pulls, -pulls.sum(axis=1))
    return 1.0 + beyond if missing < _BALANCED else np.zeros(len(angles))


def _means(vehicle: Vehicle, section: int) -> list[int]:
    """Return the two coordinates of the mean bend of a section, among those of all."""
    first = vehicle.layout.of_section[section].start
    orders = [part.orders for arm in vehicle.arms for part in arm.section][section]
    at = [first + n for n, (_, order) in enumerate(orders.coordinates) if order == 0]
    return at[:2]
