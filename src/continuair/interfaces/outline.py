"""What a vehicle looks like where only its masses and lengths are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from continuair.vehicle.section import Section
from continuair.vehicle.uav import Uav

_SLENDER = 0.01
"""Radius over length of a backbone that has none."""

_FLAT = 1e-3
"""Thinnest side of a box over its longest."""


@dataclass(frozen=True)
class Box:
    """Half sides (3,) [m], and axes (3, 3) to the body's."""

    half: np.ndarray
    axes: np.ndarray


def equal_box(uav: Uav) -> Box:
    """The box about B's origin with the mass and inertia of the UAV."""
    moments, axes = np.linalg.eigh(np.asarray(uav.inertia))
    squares = 1.5 / uav.mass * (moments.sum() - 2.0 * moments)
    half = np.sqrt(np.maximum(squares, 0.0))
    axes = axes * np.linalg.det(axes)
    return Box(np.maximum(half, _FLAT * half.max()), axes)


def radius_of(section: Section) -> float:
    """The radius of a backbone [m]."""
    return section.given_radius or _SLENDER * section.length
