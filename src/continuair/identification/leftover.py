"""What a fitted flight leaves over of a recording, and whether that is noise."""

from __future__ import annotations

import numpy as np
from scipy.signal import correlate
from scipy.spatial.transform import Rotation

from continuair.identification.recording import Recording

Array = np.ndarray

MEMORY = 0.2
"""Share of the rows within which what goes on from row to row is taken to end."""

EXPLAINED = 1e-3
"""Share of the recorded motion that may be left over without a word: of noise-free flights, what
their files round off."""

CHANCE = 5.0
"""Deviations of a correlation between rows beyond which it is no chance."""

_SURELY = 0.75
"""Correlation that is no chance of few rows either."""


def of_what_is_left(left: Array, recording: Recording) -> tuple[str, ...]:
    """A sentence where what is left over (rows, measured) of a part of the motion goes on from row
    to row, as noise does not."""
    turns = Rotation.from_quat(recording.attitude)
    parts = {
        "position": (left[:, :3], recording.position),
        "attitude": (left[:, 3:6], (turns.mean().inv() * turns).as_rotvec()),
        "bends": (left[:, 6:], recording.bend),
    }
    doubts = []
    for name, (rest, measured) in parts.items():
        moved = np.sqrt(np.mean(measured.var(axis=0))).clip(1e-12)
        missed = _missed(rest) / moved
        if missed > EXPLAINED:
            doubts.append(
                f"the fitted flight misses {percent(missed)} of the recorded motion of the "
                f"{name}, and not by noise: estimates may be off by more than their standard "
                "errors; look for inputs that are missing, another test, or fields that should be "
                "fitted too."
            )
    return tuple(doubts)


def _missed(rest: Array) -> float:
    """Size of what is left over (rows, columns) but for noise; 0 where it may all be noise.

    Noise is another one in every row, and what is no noise goes on, or comes again: the largest
    correlation with earlier rows is its share.
    """
    size, *later = autocovariance(rest)
    share = np.abs(later).max(axis=0, initial=0.0) / size.clip(1e-300)
    # That of noise is 0 to one over the root of the rows.
    chance = min(CHANCE / np.sqrt(len(rest)), _SURELY)
    return float(np.sqrt(np.mean(share * size))) if (share > chance).any() else 0.0


def autocovariance(rest: Array) -> Array:
    """Mean products (lags, columns) of rows (rows, columns) with those a lag later, to MEMORY."""
    rows = len(rest)
    lags = slice(rows - 1, rows + int(MEMORY * rows))
    found = [correlate(column, column, method="fft")[lags] for column in rest.T]
    return np.transpose(found) / rows


def percent(share: float) -> str:
    """A share in words."""
    return f"{100.0 * share:.2g} %" if share < 10.0 else "more than 1000 %"
