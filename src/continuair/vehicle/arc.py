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


def polar_of(q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return views of κ and ψa (..., sections) in the paper's coordinates q, or in their rates."""
    of_sections = bend_vectors(np.asarray(q)[..., _UAV:])
    return of_sections[..., 0], of_sections[..., 1]


def sections_of(q: ArrayLike) -> int:
    """Return the number of sections in the paper's coordinates q (..., coordinates)."""
    return (np.shape(q)[-1] - _UAV) // COORDINATES
