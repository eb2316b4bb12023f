"""The letters M, R, A and L as single strokes in a box of height 1."""

from __future__ import annotations

import numpy as np

from continuair.errors import InputError, shown
from continuair.typing import Array

GAP = 0.25
"""Space between the letters of a word, in letter heights."""

_STRAIGHT = {
    "M": [(0.0, 0.0), (0.0, 1.0), (0.4, 0.35), (0.8, 1.0), (0.8, 0.0)],
    "A": [(0.0, 0.0), (0.35, 1.0), (0.7, 0.0), (0.56, 0.4), (0.14, 0.4)],
    "L": [(0.0, 1.0), (0.0, 0.0), (0.6, 0.0)],
}

LETTERS = ("M", "R", "A", "L")
"""Available letters."""


def strokes(text: str, corners_per_arc: int) -> Array:
    """Return the corners of a word's strokes.

    Parameters
    ----------
    text : str
        One or more of the letters M, R, A and L, in either case.
    corners_per_arc : int
        Corners of the polyline that replaces the arc of an R.

    Returns
    -------
    ndarray, shape (n, 2)
        Corners in letter heights, in drawing order. The word starts at the origin and runs along x.

    Raises
    ------
    InputError
        If `text` is empty or has another letter.
    """
    if not isinstance(text, str) or not text or any(c.upper() not in LETTERS for c in text):
        raise InputError("text", f"is {shown(text)}", f"use the letters {', '.join(LETTERS)}")
    written, edge = [], 0.0
    for name in text.upper():
        corners = _r(corners_per_arc) if name == "R" else np.array(_STRAIGHT[name])
        written.append(corners + [edge, 0.0])
        edge += corners[:, 0].max() + GAP
    return np.concatenate(written)


def _r(corners_per_arc: int) -> Array:
    """Return a straight stem, a semicircular bowl and an inclined leg."""
    angle = np.linspace(np.pi / 2, -np.pi / 2, corners_per_arc)
    bowl = np.column_stack([0.4 + 0.25 * np.cos(angle), 0.75 + 0.25 * np.sin(angle)])
    return np.vstack([[(0.0, 0.0), (0.0, 1.0)], bowl, [(0.25, 0.5), (0.65, 0.0)]])
