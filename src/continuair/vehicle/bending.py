"""Largest admissible bends of the sections of a vehicle: just below a full circle."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from continuair.errors import InputError, shown
from continuair.typing import Array, ArrayLike
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

DIFFERENCE = 2e-3
"""Step of central differences about a bend [1/m]."""

_ROOM = 2.5 * DIFFERENCE
"""Margin below a full circle [1/m], which keeps central differences inside the range."""


_STRAINED = 0.5
"""Largest coefficient of stretch and shear [-], which leaves the rod a length."""


def largest_bends(vehicle: Vehicle) -> Array:
    """Return the largest admissible value of each coordinate alone (bends,), of a bend [1/m]."""
    largest: list[float] = []
    for section in (part for arm in vehicle.arms for part in arm.section):
        turning = section.orders.turning
        largest += [_circle(section)] * turning + [_STRAINED] * (section.coordinates - turning)
    return np.array(largest)


def bent_shares(vehicle: Vehicle, bends: Array) -> Array:
    """Return how much of what is admissible bends (..., bends) use, 1 at most, (..., parts).

    An arc has one share, of its bend vector. Other sections have one of all that turns their
    cross-sections, by the sums of the absolute coefficients of each component, and one of each
    component that moves them; so kernels judge them.
    """
    found: list[Array] = []
    first = 0
    for section in (part for arm in vehicle.arms for part in arm.section):
        own = bends[..., first : first + section.coordinates]
        first += section.coordinates
        if section.polar:
            found.append(np.sqrt((own * own).sum(-1)) / _circle(section))
            continue
        ends = np.cumsum(section.orders.counts)[:-1]
        sums = np.stack([np.abs(part).sum(-1) for part in np.split(own, ends, axis=-1)], axis=-1)
        found.append(np.sqrt((sums[..., :3] ** 2).sum(-1)) / _circle(section))
        found += list(np.moveaxis(sums[..., 3:], -1, 0) / _STRAINED)
    return np.stack(found, axis=-1) if found else np.zeros((*np.shape(bends)[:-1], 0))


def _circle(section: Section) -> float:
    """Return the bend just below a full circle [1/m]."""
    return float(2.0 * np.pi / section.length - _ROOM)


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
        # Rates of their coordinates depend on the bend, too.
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


def check_uniform(name: str, held: ArrayLike, vehicle: Vehicle) -> None:
    """Raise InputError if a held section is tapered; name: of the argument that holds sections."""
    sections = ((arm, part) for arm in vehicle.arms for part in arm.section)
    for (arm, part), its in zip(sections, np.atleast_1d(held), strict=True):
        if its and part.tapered:
            raise InputError(
                name,
                f"holds section {arm.name}.{part.name} of arm, whose radius changes along it",
                "leave tapered sections free with a rate of 0, or give them one radius",
            )


def check_bend(name: str, value: object, bends: Array, vehicle: Vehicle) -> None:
    """Raise InputError if bends (bends,) are not admissible; see `bent_shares`."""
    most = float(bent_shares(vehicle, bends).max(initial=0.0))
    if most > 1.0:
        raise InputError(
            name,
            f"is {shown(value)}, which bends a section to {most:.3g} of a full circle or strains "
            "it too far",
            f"give at most 1/{most:.3g} of that",
        )
