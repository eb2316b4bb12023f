"""What a fitted flight leaves over of a recording, and whether that is noise."""

from __future__ import annotations

import numpy as np
from scipy.signal import correlate
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from continuair.analysis.shares import percent
from continuair.identification.recording import Recording

Array = np.ndarray

MEMORY = 0.2
"""Share of the rows within which what goes on from row to row is taken to end."""

EXPLAINED = 1e-3
"""Share of the recorded motion that may be left over without a word: of noise-free flights, what
their files round off."""

CHANCE = 5.0
"""Deviations of a correlation between rows beyond which it is no chance."""

UNLIKELY = 1e-6
"""Chance of all correlations together below which they are none."""

FEW = 25
"""Rows, of fewer of which correlations tell nothing."""


def of_what_is_left(left: Array, recording: Recording) -> tuple[str, ...]:
    """A sentence where what is left over (rows, measured) of a part of the motion goes on from row
    to row, as noise does not."""
    if len(left) < FEW:
        return (
            f"{len(left)} rows are too few to tell what is left over from noise, which standard "
            f"errors take it for; record {FEW} or more.",
        )
    turns = Rotation.from_quat(recording.attitude)
    parts = {
        "position": (left[:, :3], recording.position),
        "attitude": (left[:, 3:6], (turns.mean().inv() * turns).as_rotvec()),
        "bends": (left[:, 6:], recording.bend),
    }
    doubts = []
    for name, (rest, measured) in parts.items():
        if not rest.shape[1]:
            continue  # bends of a vehicle without arms
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
    together = np.abs(later) / size.clip(1e-300)
    return (
        float(np.sqrt(np.mean(together.max(axis=0) * size))) if _no_chance(together, rest) else 0.0
    )


def _no_chance(together: Array, rest: Array) -> bool:
    """Whether correlations (lags, columns) of rows (rows, columns) are beyond those of noise: one
    by itself, which are 0 to one over the root of the rows, or all of them (Ljung and Box 1978)."""
    rows = len(rest)
    left = rows - np.arange(1, len(together) + 1)
    sums = rows * (rows + 2) * np.sum(together**2 / left[:, None])
    alone = bool((together > CHANCE / np.sqrt(rows)).any())
    return alone or bool(chi2.sf(sums, together.size) < UNLIKELY)


def autocovariance(rest: Array) -> Array:
    """Mean products (lags, columns) of rows (rows, columns) with those a lag later, to MEMORY."""
    rows = len(rest)
    lags = slice(rows - 1, rows + int(MEMORY * rows))
    found = [correlate(column, column, method="fft")[lags] for column in rest.T]
    return np.transpose(found) / rows
