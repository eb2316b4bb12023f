"""Residuals of a fit, and whether they are noise."""

from __future__ import annotations

import numpy as np
from scipy.signal import correlate
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from continuair.analysis.shares import percent
from continuair.identification.measurements import Measured
from continuair.identification.recording import Recording
from continuair.typing import Array

MEMORY = 0.2
"""Largest lag of autocorrelations, as a share of the rows."""

EXPLAINED = 1e-3
"""Share of the recorded motion that residuals may reach without a warning, as rounding in files
does."""

CHANCE = 5.0
"""Standard deviations of a correlation between rows beyond which it is significant."""

UNLIKELY = 1e-6
"""Probability of all correlations together below which they are significant."""

FEW = 25
"""Fewest rows for significant correlations."""


def of_what_is_left(left: Array, recording: Recording) -> tuple[str, ...]:
    """Return a sentence for each part of the motion whose residuals (rows, width) are
    correlated."""
    if len(left) < FEW:
        return (
            f"{len(left)} rows are too few to tell residuals from noise, which standard errors "
            f"assume; record {FEW} or more.",
        )
    measured, doubts = Measured(recording), []
    for group in measured.groups:
        moved = np.sqrt(np.mean(_motion(recording, group.name).var(axis=0))).clip(1e-12)
        missed = _missed(left[:, measured.of[group.name]]) / moved
        if missed > EXPLAINED:
            doubts.append(
                f"the fitted flight misses {percent(missed)} of the motion of the {group.motion}, "
                "beyond noise, so estimates are biased; check inputs and test, or fit more fields."
            )
    return tuple(doubts)


def _motion(recording: Recording, name: str) -> Array:
    """Return what was measured (rows, columns), of attitudes their rotation vectors."""
    found: Array = getattr(recording, name)
    if name != "attitude":
        return found
    turns = Rotation.from_quat(found)
    return np.asarray((turns.mean().inv() * turns).as_rotvec())


def _missed(rest: Array) -> float:
    """Return the size of residuals (rows, columns) beyond noise; 0 if all may be noise.

    Noise is independent between rows: the largest correlation with earlier rows is the share of the
    rest.
    """
    size, *later = autocovariance(rest)
    together = np.abs(later) / size.clip(1e-300)
    return (
        float(np.sqrt(np.mean(together.max(axis=0) * size))) if _no_chance(together, rest) else 0.0
    )


def _no_chance(together: Array, rest: Array) -> bool:
    """Return whether correlations (lags, columns) of residuals (rows, columns) exceed those of
    noise.

    A single one, of standard deviation 1 / √rows, or all together (Ljung and Box 1978).
    """
    rows = len(rest)
    left = rows - np.arange(1, len(together) + 1)
    sums = rows * (rows + 2) * np.sum(together**2 / left[:, None])
    alone = bool((together > CHANCE / np.sqrt(rows)).any())
    return alone or bool(chi2.sf(sums, together.size) < UNLIKELY)


def autocovariance(rest: Array) -> Array:
    """Return mean products (lags, columns) of rows (rows, columns) at lags up to MEMORY."""
    rows = len(rest)
    lags = slice(rows - 1, rows + int(MEMORY * rows))
    found = [correlate(column, column, method="fft")[lags] for column in rest.T]
    return np.transpose(found) / rows
