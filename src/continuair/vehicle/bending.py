"""Largest admissible bends of the sections of a vehicle: just below a full circle."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from continuair.errors import InputError, shown
from continuair.typing import Array, ArrayLike
from continuair.vehicle.vehicle import Vehicle

DIFFERENCE = 2e-3
"""Step of central differences about a bend [1/m]."""

_ROOM = 2.5 * DIFFERENCE
"""Margin below a full circle [1/m], which keeps central differences inside the range."""


_STRAINED = 0.5
"""Largest coefficient of stretch and shear [-], which leaves the rod a length."""


def largest_bends(vehicle: Vehicle) -> tuple[Array, NDArray[np.intp]]:
    """Return the largest admissible lengths of the vectors that the coordinates of sections form.

    Returns
    -------
    largest : ndarray
        One per bend vector of an arc [1/m], and one per coordinate of a section whose strain varies
        [1/m; stretch and shear: -].
    owner : ndarray, shape (bends,)
        Index of the vector that each coordinate is a component of.
    """
    largest: list[float] = []
    owner: list[int] = []
    for section in (part for arm in vehicle.arms for part in arm.section):
        circle = 2.0 * np.pi / section.length - _ROOM
        if section.polar:
            owner += [len(largest)] * section.coordinates
            largest.append(circle)
        else:
            owner += range(len(largest), len(largest) + section.coordinates)
            turning = section.orders.turning
            largest += [circle] * turning + [_STRAINED] * (section.coordinates - turning)
    return np.array(largest), np.array(owner, int)


def constant_bends(vehicle: Vehicle) -> NDArray[np.intp]:
    """Return the coordinates of the constant bend of each section, along x and y, (sections, 2)."""
    sections = [part for arm in vehicle.arms for part in arm.section]
    firsts = [where.start for where in vehicle.layout.of_section]
    # Coefficients of a component follow one another.
    return np.array(
        [[first, first + part.orders.counts[0]]
         for first, part in zip(firsts, sections, strict=True)], int,
    ).reshape(-1, 2)  # fmt: skip


def evenly_bent(
    vehicle: Vehicle, sections: Iterable[int], kappa: ArrayLike, direction: ArrayLike
) -> Array:
    """Return level paper coordinates (..., coordinates) with some sections evenly bent.

    kappa, direction: the bend [1/m] and its direction [rad] of these sections, alike.
    """
    kappa, direction = np.broadcast_arrays(kappa, direction)
    q = np.zeros((*kappa.shape, vehicle.layout.coordinates))
    bends, pairs = q[..., vehicle.layout.polar], constant_bends(vehicle)
    for section in sections:
        x, y = pairs[section]
        if section in vehicle.layout.strains:
            bends[..., x], bends[..., y] = kappa * np.cos(direction), kappa * np.sin(direction)
        else:
            bends[..., x], bends[..., y] = kappa, direction
    return q


def evenly_moving(
    vehicle: Vehicle, state: Sequence[Array], rates: Sequence[Array]
) -> tuple[Array, Array]:
    """Return paper coordinates and rates (..., coordinates) with all sections bent alike.

    state, rates: x y z φ θ ψ κ ψa and their rates, each (...), as of one section.
    """
    if vehicle.layout.strains:
        # Their rates hang on the bend, too.
        both = np.broadcast_arrays(*state, *rates)
        state, rates = both[: len(state)], both[len(state) :]
    (*base, kappa, psi), (*moved, kappa_d, psi_d) = state, rates
    everywhere = range(vehicle.sections)
    q = evenly_bent(vehicle, everywhere, kappa, psi)
    qd = evenly_bent(vehicle, everywhere, kappa_d, psi_d)
    for section in vehicle.layout.strains:
        x, y = vehicle.layout.polar.start + constant_bends(vehicle)[section]
        qd[..., x] = kappa_d * np.cos(psi) - kappa * psi_d * np.sin(psi)
        qd[..., y] = kappa_d * np.sin(psi) + kappa * psi_d * np.cos(psi)
    q[..., :6], qd[..., :6] = np.stack(base, axis=-1), np.stack(moved, axis=-1)
    return q, qd


def check_bend(name: str, value: object, bends: Array, vehicle: Vehicle) -> None:
    """Raise InputError if bends (bends,) exceed `largest_bends`."""
    largest, owner = largest_bends(vehicle)
    found = np.sqrt(np.bincount(owner, bends * bends))
    for length, most in zip(found, largest, strict=True):
        if length > most:
            raise InputError(
                name,
                f"is {shown(value)}, which bends a section to {length:g} 1/m",
                f"give at most {most:.4g} 1/m, just below a full circle",
            )
