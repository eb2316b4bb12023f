"""How far the sections of a vehicle can be bent to stay: just below a full circle."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.errors import InputError, shown
from continuair.vehicle.vehicle import Vehicle

DIFFERENCE = 2e-3
"""Of central differences about a bend [1/m]."""

_ROOM = 2.5 * DIFFERENCE
"""What a bend leaves below a full circle [1/m], so that its differences are still inside."""


def largest_bends(vehicle: Vehicle) -> np.ndarray:
    """The bend that each section (sections,) is given at most [1/m]."""
    sections = (section for arm in vehicle.arms for section in arm.section)
    return np.array([2.0 * np.pi / section.length - _ROOM for section in sections])


def check_bend(name: str, value: Any, kappas: np.ndarray, vehicle: Vehicle) -> None:
    """Raise InputError unless the bends of all sections [1/m] leave room below a full circle."""
    sections = (section for arm in vehicle.arms for section in arm.section)
    for kappa, largest, section in zip(kappas, largest_bends(vehicle), sections, strict=True):
        if kappa > largest:
            raise InputError(
                f"{name} is {shown(value)}, which bends a section of {section.length:g} m to "
                f"{kappa:g} 1/m; give a bend of at most {largest:.4g} 1/m, just below a full "
                "circle."
            )
