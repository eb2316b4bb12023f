"""Kinds of sections, one file or package each, in a table by name."""

from typing import Literal

import numpy as np

from continuair.sections.arc import Arc
from continuair.sections.kind import SectionCode, SectionKind
from continuair.sections.strain import StrainField
from continuair.typing import Array
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

KINDS: dict[str, type[SectionKind]] = {kind.name: kind for kind in (Arc, StrainField)}


def kind_of(section: Section) -> SectionKind:
    """Return the kind of a section.

    Parameters
    ----------
    section : Section
        A section of a vehicle or of a batch.

    Returns
    -------
    SectionKind
        The kind named by its attribute `kind`.
    """
    return KINDS[section.kind].of(section)


def of_coordinates(
    vehicle: Vehicle, what: Literal["stiffness", "damping", "natural", "units"], runs: int = 1
) -> Array:
    """Return numbers of the coordinates of all sections, as the kinds of sections give them.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.
    what : {"stiffness", "damping", "natural", "units"}
        Name of the method of `SectionKind`.
    runs : int, default 1
        Number of runs.

    Returns
    -------
    ndarray, shape (runs, bends)
        The numbers, arm by arm and section by section.
    """
    parts = [part for arm in vehicle.arms for part in arm.section]
    each = [getattr(kind_of(part), what)(part, runs) for part in parts]
    return np.hstack([np.zeros((runs, 0)), *each])


def of_pairs(vehicle: Vehicle, what: Literal["stiffness", "damping"], runs: int = 1) -> Array:
    """Return the stiffness or damping matrix of the coordinates of all sections.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.
    what : {"stiffness", "damping"}
        The elastic force per coordinate, or the damping force per rate.
    runs : int, default 1
        Number of runs.

    Returns
    -------
    ndarray, shape (runs, bends, bends)
        Symmetric matrices, diagonal unless a section tapers.
    """
    own = of_coordinates(vehicle, what, runs)
    found, first = own[:, :, None] * np.eye(own.shape[1]), 0
    for part in (part for arm in vehicle.arms for part in arm.section):
        kind = kind_of(part)
        values = kind.between(part, runs)[what == "damping"]
        for pair, (j, k) in enumerate(kind.couples):
            found[:, first + j, first + k] = found[:, first + k, first + j] = values[:, pair]
        first += kind.coordinates
    return found


def arcs(*sections: int) -> tuple[tuple[SectionKind, ...], ...]:
    """Return the kinds of the sections of arms that consist of arcs.

    Parameters
    ----------
    *sections : int
        Number of arcs of each arm.

    Returns
    -------
    tuple of tuple of SectionKind
        Kinds of each arm, as in `Tree.kinds`.
    """
    return tuple((Arc(),) * count for count in sections)


__all__ = [
    "KINDS",
    "Arc",
    "SectionCode",
    "SectionKind",
    "StrainField",
    "arcs",
    "kind_of",
    "of_coordinates",
    "of_pairs",
]
