"""Strokes of the letters of the closed-loop task."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from continuair.scenario import strokes

_CHORDS = 48
"""Chords of an arc, of less than 4° each."""

_CHORD, _TURN = 0.05, np.radians(10.0)
"""Lengths [heights] and turns [rad] below these are those of a chord of an arc."""

_LEVEL = np.radians(1.0)
"""Directions this close to an axis are along it [rad]."""


def kinds_of_stroke(letters: Iterable[str]) -> dict[str, float]:
    """Return shares of the length that are straight along an axis, inclined, and curved."""
    length = {"straight along an axis": 0.0, "inclined": 0.0, "curved": 0.0}
    for letter in letters:
        sides = np.diff(strokes(letter, _CHORDS), axis=0)
        long, angle = np.linalg.norm(sides, axis=1), np.arctan2(sides[:, 1], sides[:, 0])
        turn = np.abs((np.diff(angle) + np.pi) % (2 * np.pi) - np.pi)
        gentle = (turn > 0.0) & (turn < _TURN)
        curved = (np.append(gentle, False) | np.append(False, gentle)) & (long < _CHORD)
        along = np.abs(np.sin(2.0 * angle)) < np.sin(2.0 * _LEVEL)
        for kind, part in zip(length, (~curved & along, ~curved & ~along, curved), strict=True):
            length[kind] += float(long[part].sum())
    total = sum(length.values())
    return {kind: part / total for kind, part in length.items()}
