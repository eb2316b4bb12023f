"""What a vehicle looks like where only its masses and lengths are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.vehicle.disk import Disk
from continuair.vehicle.rotors import Rotors
from continuair.vehicle.section import Section

_SLENDER = 0.01
"""Radius over length of a backbone that has none."""

_FLAT = 1e-3
"""Thinnest side of a box over its longest."""


@dataclass(frozen=True)
class Box:
    """Half sides (3,) [m], and axes (3, 3) to the body's."""

    half: np.ndarray
    axes: np.ndarray


def equal_box(mass: float, inertia: Any) -> Box:
    """The box about a centre of mass with this mass [kg] and inertia (3, 3) [kg m²]."""
    moments, axes = np.linalg.eigh(np.asarray(inertia))
    half = np.sqrt(np.maximum(1.5 / mass * (moments.sum() - 2.0 * moments), 0.0))
    return Box(np.maximum(half, _FLAT * max(half.max(), _FLAT)), axes * np.linalg.det(axes))


def radius_of(section: Section) -> float:
    """The radius of a backbone [m]."""
    return section.given_radius or _SLENDER * section.length


def disk_radius(disk: Disk, section: Section) -> float:
    """The radius of a disk of even mass with this axial inertia [m]."""
    if disk.mass and disk.axial_inertia:
        return float(np.sqrt(2.0 * disk.axial_inertia / disk.mass))
    return 3.0 * radius_of(section)


def rotor_radius(rotors: Rotors) -> float:
    """The radius of a rotor's disk [m]; without one as large as its neighbours let it be."""
    if rotors.radius is not None:
        return float(rotors.radius)
    apart = np.linalg.norm(rotors.hubs[:, None] - rotors.hubs, axis=-1)
    return float(0.45 * apart[apart > 0.0].min())
