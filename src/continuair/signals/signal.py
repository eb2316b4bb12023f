"""Signals: piecewise polynomials of time, one for each run or one for all."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from continuair.typing import Array, ArrayLike

Side = Literal["right", "left"]
"""One-sided limit at a jump."""


@dataclass(frozen=True, eq=False)
class Signal:
    """Values over time, with one row for each run or one row for all.

    Parameters
    ----------
    first : ndarray of int, shape (rows + 1,)
        Row r consists of the pieces ``first[r]`` to ``first[r + 1]``, in order of time.
    edges : ndarray, shape (pieces, 2)
        Start and end of each piece [s].
    coefficients : ndarray, shape (pieces, width, terms)
        Coefficients of powers of u, the highest first. u is -1 at the start of a piece, 1 at its
        end.
    breaks : tuple of ndarray, one per row
        Breakpoints [s]: jumps and kinks, at which integration steps must end.
    """

    first: npt.NDArray[np.int64]
    edges: Array
    coefficients: Array
    breaks: tuple[Array, ...]

    @property
    def rows(self) -> int:
        """Return the number of rows: the number of runs, or 1 for one signal for all."""
        return len(self.first) - 1

    @property
    def width(self) -> int:
        """Return the number of components."""
        return self.coefficients.shape[1]

    @property
    def is_constant(self) -> bool:
        """Return whether the values are the same at all times."""
        return len(self.edges) == self.rows and self.coefficients.shape[2] == 1

    def __call__(self, times: ArrayLike, side: Side = "right") -> Array:
        """Return the values at some times.

        Parameters
        ----------
        times : array_like, shape (n,)
            Times [s].
        side : {"right", "left"}, default "right"
            One-sided limit that is returned at a jump.

        Returns
        -------
        ndarray, shape (n, rows, width)
            The values.
        """
        times = np.atleast_1d(np.asarray(times, float))
        out = np.empty((len(times), self.rows, self.width))
        for row in range(self.rows):
            pieces = slice(self.first[row], self.first[row + 1])
            out[:, row] = self._of_row(pieces, times, side)
        return out

    def _of_row(self, pieces: slice, times: Array, side: Side) -> Array:
        start, end = self.edges[pieces].T
        at = np.clip(
            np.searchsorted(start, times, "right" if side == "right" else "left") - 1, 0, None
        )
        u = 2.0 * (times - start[at]) / (end[at] - start[at]) - 1.0
        powers = self.coefficients[pieces][at]
        found = powers[..., 0]
        for term in range(1, powers.shape[-1]):
            found = found * u[:, None] + powers[..., term]
        return found

    def scaled(self, factor: float) -> Signal:
        """Return the signal times a factor.

        Parameters
        ----------
        factor : float
            Factor of all values.

        Returns
        -------
        Signal
            The scaled signal.
        """
        return replace(self, coefficients=factor * self.coefficients)

    def of_runs(self, runs: npt.NDArray[np.intp]) -> Signal:
        """Return the signal of some runs.

        Parameters
        ----------
        runs : ndarray of int, shape (n,)
            Indices of the runs.

        Returns
        -------
        Signal
            Signal of n rows; a signal of one row is returned unchanged.
        """
        if self.rows == 1:
            return self
        counts = np.diff(self.first)[runs]
        first = np.append(0, np.cumsum(counts))
        which = np.repeat(self.first[runs] - first[:-1], counts) + np.arange(first[-1])
        breaks = tuple(self.breaks[run] for run in runs)
        return Signal(first, self.edges[which], self.coefficients[which], breaks)


def constant(values: ArrayLike, duration: float) -> Signal:
    """Return a constant signal.

    Parameters
    ----------
    values : array_like, shape (width,) or (rows, width)
        The values.
    duration : float
        Length of the signal [s].

    Returns
    -------
    Signal
        One constant piece per row.
    """
    rows = np.atleast_2d(np.asarray(values, float))
    edges = np.broadcast_to([0.0, duration], (len(rows), 2))
    first, none = np.arange(len(rows) + 1), np.zeros(0)
    return Signal(first, edges, rows[..., None], (none,) * len(rows))


def sampled(samples: ArrayLike, step: float, duration: float) -> Signal:
    """Return a signal that interpolates equidistant samples linearly.

    Parameters
    ----------
    samples : array_like, shape (rows, n, width)
        Values at 0, step, 2 step and so on, at least up to the duration.
    step : float
        Time between samples [s].
    duration : float
        Length of the signal [s].

    Returns
    -------
    Signal
        The signal. Samples are not breakpoints: an integration step may pass over one.
    """
    values = np.asarray(samples, float)
    pieces = min(values.shape[1] - 1, max(1, int(np.ceil(duration / step * (1.0 - 1e-12)))))
    times = step * np.arange(pieces + 1)
    edges = np.stack([times[:-1], times[1:]], axis=1)
    before, after = values[:, :pieces], values[:, 1 : pieces + 1]
    slopes = np.stack([0.5 * (after - before), 0.5 * (after + before)], axis=-1)
    rows, width = len(values), values.shape[-1]
    return Signal(
        pieces * np.arange(rows + 1),
        np.tile(edges, (rows, 1)),
        slopes.reshape(rows * pieces, width, 2),
        (np.zeros(0),) * rows,
    )


def from_pieces(rows: list[list[tuple[float, float, Array]]], breaks: list[list[float]]) -> Signal:
    """Return a signal of given pieces.

    Parameters
    ----------
    rows : list of list of tuple
        Pieces (start [s], end [s], coefficients) of each row, in order of time. The coefficients
        (width, terms) are those of `Signal`.
    breaks : list of list of float
        Breakpoints of each row [s].

    Returns
    -------
    Signal
        The signal.
    """
    first = np.append(0, np.cumsum([len(pieces) for pieces in rows]))
    edges = np.array([[a, b] for pieces in rows for a, b, _ in pieces])
    coefficients = np.array([of for pieces in rows for _, _, of in pieces])
    return Signal(first, edges, coefficients, tuple(np.array(own, float) for own in breaks))
