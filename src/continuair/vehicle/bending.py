"""Largest admissible bends of the sections of a vehicle: just below a full circle."""

from __future__ import annotations

import numpy as np

from continuair.errors import InputError, shown
from continuair.vehicle.vehicle import Vehicle

DIFFERENCE = 2e-3
"""Step of central differences about a bend [1/m]."""

_ROOM = 2.5 * DIFFERENCE
"""Margin below a full circle [1/m], which keeps central differences inside the range."""


def largest_bends(vehicle: Vehicle) -> np.ndarray:
    """Return the largest bend of each section (sections,) [1/m]."""
    sections = (section for arm in vehicle.arms for section in arm.section)
    return np.array([2.0 * np.pi / section.length - _ROOM for section in sections])


def check_bend(name: str, value: object, kappas: np.ndarray, vehicle: Vehicle) -> None:
    """Raise InputError if a bend of a section [1/m] exceeds `largest_bends`."""
    sections = (section for arm in vehicle.arms for section in arm.section)
    for kappa, largest, section in zip(kappas, largest_bends(vehicle), sections, strict=True):
        if kappa > largest:
            raise InputError(
                name,
                (
                    f"is {shown(value)}, which bends a section of {section.length:g} m to "
                    f"{kappa:g} 1/m"
                ),
                f"give at most {largest:.4g} 1/m, just below a full circle",
            )
