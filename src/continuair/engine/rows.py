"""Rows of runs: adjacent indices, and samples of a log that a run has not reached."""

from __future__ import annotations

import numpy as np

from continuair.kernels.step import OK

Array = np.ndarray


def adjacent(rows: Array) -> Array | slice:
    """Return indices (n,) as a slice, which needs no copy, if they are consecutive."""
    first, last = int(rows[0]), int(rows[-1])
    beside = len(rows) == last - first + 1 and bool((np.diff(rows) == 1).all())
    return slice(first, last + 1) if beside else rows


def forget_unreached(rows: Array, status: Array, last_step: Array, sample_after: Array) -> None:
    """Set rows (runs, samples, columns) to NaN that runs with an early stop have not reached.

    status, last_step: (runs,), of the roll-out; sample_after: (steps,), as in a Grid.
    """
    reached = 1 + np.append(0, np.cumsum(sample_after >= 0))
    for run in np.flatnonzero(status != OK):
        rows[run, reached[last_step[run]] :] = np.nan
