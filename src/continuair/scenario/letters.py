"""The letters M, R, A, L as strokes in a box of height 1, each drawn without lifting the pen."""

from __future__ import annotations

import numpy as np

from continuair.errors import InputError, shown

GAP = 0.25
"""Space between the letters of a word, in heights."""

_STRAIGHT = {
    "M": [(0.0, 0.0), (0.0, 1.0), (0.4, 0.35), (0.8, 1.0), (0.8, 0.0)],
    "A": [(0.0, 0.0), (0.35, 1.0), (0.7, 0.0), (0.56, 0.4), (0.14, 0.4)],
    "L": [(0.0, 1.0), (0.0, 0.0), (0.6, 0.0)],
}

LETTERS = ("M", "R", "A", "L")
"""The letters that can be written."""


def strokes(text: str, corners_per_arc: int) -> np.ndarray:
    """Corners (n, 2) of a word's strokes, in heights; raises InputError for other letters."""
    if not isinstance(text, str) or not text or any(c.upper() not in LETTERS for c in text):
        raise InputError(f"text is {shown(text)}; use the letters {', '.join(LETTERS)}.")
    written, edge = [], 0.0
    for name in text.upper():
        corners = _r(corners_per_arc) if name == "R" else np.array(_STRAIGHT[name])
        written.append(corners + [edge, 0.0])
        edge += corners[:, 0].max() + GAP
    return np.concatenate(written)


def _r(corners_per_arc: int) -> np.ndarray:
    """A straight stem, a bowl that is half a circle, and an inclined leg."""
    angle = np.linspace(np.pi / 2, -np.pi / 2, corners_per_arc)
    bowl = np.column_stack([0.4 + 0.25 * np.cos(angle), 0.75 + 0.25 * np.sin(angle)])
    return np.vstack([[(0.0, 0.0), (0.0, 1.0)], bowl, [(0.25, 0.5), (0.65, 0.0)]])
