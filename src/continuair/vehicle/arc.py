"""The coordinates of an arc: its bend vector k, and the paper's κ and ψa, which are polar to it.

An arc is a section of constant curvature, the kind of section of the paper. Arrays hold the
coordinates of sections one after the other, arm by arm, each arm from its base out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

AXES = ("x", "y")
"""Axes of a bend vector, those of the section's base."""

POLAR = ("kappa", "psi_a")
"""Names of the paper's coordinates of an arc."""

COORDINATES = len(AXES)
"""The number of an arc's coordinates."""

_UAV = 6
"""The number of the paper's coordinates of the UAV, which precede those of the sections."""


def bend_vectors(coordinates: Any) -> np.ndarray:
    """Return the bend vectors (..., sections, 2) of coordinates (..., 2 sections)."""
    found = np.asarray(coordinates)
    return found.reshape(*found.shape[:-1], found.shape[-1] // COORDINATES, COORDINATES)


def coordinates_of(vectors: Any) -> np.ndarray:
    """Return the coordinates (..., 2 sections) of bend vectors (..., sections, 2)."""
    found = np.asarray(vectors)
    return found.reshape(*found.shape[:-2], COORDINATES * found.shape[-2])


def polar_of(q: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return κ and ψa (..., sections) of the paper's coordinates q, or their rates; both views."""
    of_sections = bend_vectors(np.asarray(q)[..., _UAV:])
    return of_sections[..., 0], of_sections[..., 1]


def angles_of_branch(branch: Any) -> np.ndarray:
    """Return ψa (..., sections) of the columns (κ, ψa) of a log row; a view."""
    return bend_vectors(branch)[..., 1]


def followed_polar(branch: Any, bends: Any) -> np.ndarray:
    """Return columns (κ, ψa) of log rows, κ as long as the bends (..., 2 sections) of these rows
    are: a kernel's sum of two products is rounded by how it was compiled."""
    found = np.array(bend_vectors(branch))
    x, y = np.moveaxis(bend_vectors(bends), -1, 0)
    found[..., 0] = np.copysign(np.hypot(x, y), found[..., 0])
    return coordinates_of(found)


def sections_of(q: Any) -> int:
    """Return the number of sections that the paper's coordinates q (..., coordinates) are of."""
    return (np.shape(q)[-1] - _UAV) // COORDINATES


def section_of(coordinate: int) -> int:
    """Return the section that a coordinate belongs to, by its index among those of all."""
    return coordinate // COORDINATES


def from_polar(kappa: Any, psi: Any) -> np.ndarray:
    """Return bend vectors (..., 2) of κ and ψa."""
    return np.asarray(kappa)[..., None] * np.stack([np.cos(psi), np.sin(psi)], axis=-1)
