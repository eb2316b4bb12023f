"""Outlines of a vehicle of which only masses and lengths are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.vehicle.disk import Disk
from continuair.vehicle.rotors import Rotors
from continuair.vehicle.section import Section

_SLENDER = 0.01
"""Radius over length of a backbone that has none."""

_FLAT = 1e-3
"""Thinnest side of a box over its longest."""


@dataclass(frozen=True)
class Box:
    """Half sides (3,) [m], and their attitude in the body (4,) x y z w."""

    half: np.ndarray
    attitude: np.ndarray


def equal_box(mass: float, inertia: Any) -> Box:
    """Return the box about a centre of mass with this mass [kg] and inertia (3, 3) [kg m²]."""
    moments, axes = np.linalg.eigh(np.asarray(inertia))
    half = np.sqrt(np.maximum(1.5 / mass * (moments.sum() - 2.0 * moments), 0.0))
    turn = Rotation.from_matrix(axes * np.linalg.det(axes))
    return Box(np.maximum(half, _FLAT * max(half.max(), _FLAT)), turn.as_quat())


def radius_of(section: Section) -> float:
    """Return the radius of a backbone [m], the mean of a tapered one."""
    none = section.given_radius is None
    return _SLENDER * section.length if none else float(section.mean_radius)


def disk_radius(disk: Disk, section: Section) -> float:
    """Return the radius of a disk of even mass with this axial inertia [m]."""
    if disk.mass and disk.axial_inertia:
        return float(np.sqrt(2.0 * disk.axial_inertia / disk.mass))
    return 3.0 * radius_of(section)


def rotor_radius(rotors: Rotors) -> float:
    """Return the radius of a rotor's disk [m], by default the largest that its neighbours allow."""
    if rotors.radius is not None:
        return float(rotors.radius)
    across = rotors.hubs[:, :2]
    apart = np.linalg.norm(across[:, None] - across, axis=-1)
    # Coaxial rotors are no neighbours.
    return float(0.45 * apart[apart > 0.01 * apart.max()].min(initial=apart.max()))


def pointing(vectors: np.ndarray) -> np.ndarray:
    """Return the smallest rotations of z to vectors (n, 3), as quaternions (n, 4) x y z w."""
    x, y, z = (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).T
    # Half-way between z and the vector; straight down, half a turn about x.
    found = np.column_stack([-y, x, np.zeros(len(x)), 1.0 + z])
    found[z < -1.0 + 1e-9] = [1.0, 0.0, 0.0, 0.0]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))
