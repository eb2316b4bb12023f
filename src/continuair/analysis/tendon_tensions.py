"""Tensions with which tendons hold given bends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from continuair import checks
from continuair.analysis.trim import trim
from continuair.equations.tendons import tendon_lengths
from continuair.errors import InputError, shown
from continuair.typing import Array, ArrayLike
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_STEP = 1e-100
"""Complex step, which loses no digits."""

_LEAST_SQUARES = 1e-7
"""Weight of the tensions beside the forces that are missing, which chooses the least ones."""


@dataclass(frozen=True)
class HeldBends:
    """Tensions that hold an arm at given bends.

    Parameters
    ----------
    tensions : ndarray, shape (tendons,)
        Tension of each tendon [N].
    command : ndarray, shape (tendons,)
        `Scenario.tendon_command` of these tensions: those above the pretension [N], or the lengths
        that winches take in [m].
    lengths : ndarray, shape (tendons,)
        Length of each tendon's path [m].
    missing : ndarray, shape (coordinates,)
        Generalised forces that the tendons do not exert, of those that hold the bends [N m²].
    """

    tensions: Array
    command: Array
    lengths: Array
    missing: Array


def tendon_tensions(vehicle: Vehicle, bends: ArrayLike, *, gravity: float = 9.81) -> HeldBends:
    """Return the least tensions that hold an arm at given bends, of a vehicle that hovers level.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with tendons.
    bends : array_like, shape (coordinates,)
        Coordinates of all sections, arm by arm: the bend vectors of arcs, two per section [1/m].
    gravity : float, optional
        Acceleration of gravity [m/s²].

    Returns
    -------
    HeldBends
        Tensions, commands, and what the tendons leave.

    Raises
    ------
    InputError
        If an argument cannot be used.

    Notes
    -----
    Without friction. No tension is below the pretension or a limit of its group. Among tensions
    that leave equally little, those with the least sum of squares above the pretension are
    returned. Tendons exert as many independent forces as there are tendons less one per group; what
    they cannot exert is in `missing`, such as forces that bend a section against gravity.

    Examples
    --------
    >>> vehicle = ca.load_vehicle("slender").replace(
    ...     {"arm.tendon": [{"angles": [0.0, 2.1, 4.2], "offset": 0.01}]}
    ... )
    >>> ca.tendon_tensions(vehicle, [0.5, 0.0]).tensions.round(1)
    array([323.7,   0. ,   0. ])
    """
    check_single_vehicle(vehicle, strain=True)
    if not vehicle.tendons:
        raise InputError(
            "vehicle",
            f"{shown(vehicle.name)} has no tendons",
            "give its arm a list of tables [[arm.tendon]]",
        )
    q = checks.vector("bends", bends, vehicle.layout.bends)
    steps = q + 1j * _STEP * np.eye(len(q))
    pulls = -tendon_lengths(vehicle, steps).imag / _STEP
    needed = trim(_without_tendons(vehicle), bend=q, gravity=gravity).bend_moment
    least, most, stiffness, by_length = _per_tendon(vehicle)
    pretension = stiffness[:, 1]
    size = np.abs(pulls).max()
    weight = _LEAST_SQUARES * np.eye(len(least))
    matrix = np.vstack([pulls / size, weight])
    right = np.concatenate([(needed - pulls @ least) / size, weight @ (pretension - least)])
    found = lsq_linear(
        matrix, right, (np.zeros(len(least)), np.maximum(most - least, 1e-12)), method="bvls"
    )
    tensions = least + found.x
    lengths = tendon_lengths(vehicle, q)
    straight = tendon_lengths(vehicle, np.zeros(len(q)))
    above = tensions - pretension
    taken = above / stiffness[:, 0] + straight - lengths
    return HeldBends(
        tensions, np.where(by_length, taken, above), lengths, needed - pulls @ tensions
    )


def _per_tendon(vehicle: Vehicle) -> tuple[Array, Array, Array, Array]:
    """Return, of each tendon, the least and greatest tension, (stiffness, pretension), and whether
    its length is commanded."""
    rows = []
    for group in (group for arm in vehicle.arms for group in arm.tendon):
        low, high = group.tension_limits
        spring = 1.0 if group.stiffness is None else group.stiffness
        row = max(low, group.pretension), high, spring, group.pretension, group.command
        rows += [row] * group.count
    least, most, stiffness, pretension, command = zip(*rows, strict=True)
    both = np.column_stack([stiffness, pretension])
    return np.array(least), np.array(most), both, np.array(command) == "length"


def _without_tendons(vehicle: Vehicle) -> Vehicle:
    """Return the vehicle with bare arms."""
    table = vehicle.arm_tables
    if isinstance(table, tuple):
        return vehicle.having(arm=tuple(arm.having(tendon=()) for arm in table))
    return vehicle.having(arm=table.having(tendon=()))
