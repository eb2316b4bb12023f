"""Coordinates of an arc: its bend vector k, and the paper's polar coordinates κ and ψa.

An arc is a section of constant curvature, as in the paper. Arrays hold the coordinates of all
sections in order, arm by arm, each arm from its base to its tip.
"""

from __future__ import annotations

import numpy as np

from continuair.typing import ArrayLike

AXES = ("x", "y")
"""Axes of a bend vector, in the frame of the section's base."""

POLAR = ("kappa", "psi_a")
"""Names of the paper's coordinates of an arc."""

COORDINATES = len(AXES)
"""The number of an arc's coordinates."""

_UAV = 6
"""The number of the paper's coordinates of the UAV, which precede those of the sections."""


def bend_vectors(coordinates: ArrayLike) -> np.ndarray:
    """Return the bend vectors (..., sections, 2) of coordinates (..., 2 sections)."""
    found = np.asarray(coordinates)
    return found.reshape(*found.shape[:-1], found.shape[-1] // COORDINATES, COORDINATES)


def coordinates_of(vectors: ArrayLike) -> np.ndarray:
    """Return the coordinates (..., 2 sections) of bend vectors (..., sections, 2)."""
    found = np.asarray(vectors)
    return found.reshape(*found.shape[:-2], COORDINATES * found.shape[-2])


def polar_of(q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return views of κ and ψa (..., sections) in the paper's coordinates q, or in their rates."""
    of_sections = bend_vectors(np.asarray(q)[..., _UAV:])
    return of_sections[..., 0], of_sections[..., 1]


def angles_of_branch(branch: ArrayLike) -> np.ndarray:
    """Return a view of ψa (..., sections) in the columns (κ, ψa) of log rows."""
    return bend_vectors(branch)[..., 1]


def followed_polar(branch: ArrayLike, bends: ArrayLike) -> np.ndarray:
    """Return columns (κ, ψa) of log rows, with |κ| computed from the bends (..., 2 sections).

    The kernel's own κ is a sum of two products, whose rounding depends on how it was compiled.
    """
    found = np.array(bend_vectors(branch))
    x, y = np.moveaxis(bend_vectors(bends), -1, 0)
    found[..., 0] = np.copysign(np.hypot(x, y), found[..., 0])
    return coordinates_of(found)


def sections_of(q: ArrayLike) -> int:
    """Return the number of sections in the paper's coordinates q (..., coordinates)."""
    return (np.shape(q)[-1] - _UAV) // COORDINATES


def section_of(coordinate: int) -> int:
    """Return the section that a coordinate belongs to, by its index among all coordinates."""
    return coordinate // COORDINATES


def from_polar(kappa: ArrayLike, psi: ArrayLike) -> np.ndarray:
    """Return bend vectors (..., 2) of κ and ψa."""
    return np.asarray(kappa)[..., None] * np.stack([np.cos(psi), np.sin(psi)], axis=-1)
