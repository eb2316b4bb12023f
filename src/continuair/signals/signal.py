"""A signal: a piecewise polynomial of time, of each run or one for all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Signal:
    """Values over time, each run's own or one row for all.

    Attributes
    ----------
    first : ndarray of int, shape (rows + 1,)
        The pieces of row r are first[r] to first[r + 1], in order of time.
    edges : ndarray, shape (pieces, 2)
        Start and end of each piece [s].
    coefficients : ndarray, shape (pieces, width, terms)
        Of powers of u, from -1 at the start of a piece to 1 at its end, the highest first.
    breaks : tuple of ndarray, one per row
        Times inside the signal at which integration steps have to end [s]: jumps and kinks.
    """

    first: Array
    edges: Array
    coefficients: Array
    breaks: tuple[Array, ...]

    @property
    def rows(self) -> int:
        """The number of runs with a signal of their own, or 1."""
        return len(self.first) - 1

    @property
    def width(self) -> int:
        """The number of values at a time."""
        return self.coefficients.shape[1]

    @property
    def is_constant(self) -> bool:
        """Whether the values are the same at all times."""
        return len(self.edges) == self.rows and self.coefficients.shape[2] == 1

    def __call__(self, times: ArrayLike, side: str = "right") -> Array:
        """Return the values at some times.

        Parameters
        ----------
        times : array_like, shape (n,)
            Times [s].
        side : {"right", "left"}
            The limit that is returned at a jump.

        Returns
        -------
        ndarray, shape (n, rows, width)
        """
        times = np.atleast_1d(np.asarray(times, float))
        out = np.empty((len(times), self.rows, self.width))
        for row in range(self.rows):
            pieces = slice(self.first[row], self.first[row + 1])
            out[:, row] = self._of_row(pieces, times, side)
        return out

    def _of_row(self, pieces: slice, times: Array, side: str) -> Array:
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
        """Return the signal times a factor."""
        return replace(self, coefficients=factor * self.coefficients)

    def of_runs(self, runs: Array) -> Signal:
        """Return the signal of some runs, by their indices; one row serves all."""
        if self.rows == 1:
            return self
        counts = np.diff(self.first)[runs]
        first = np.append(0, np.cumsum(counts))
        which = np.repeat(self.first[runs] - first[:-1], counts) + np.arange(first[-1])
        breaks = tuple(self.breaks[run] for run in runs)
        return Signal(first, self.edges[which], self.coefficients[which], breaks)


def constant(values: ArrayLike, duration: float) -> Signal:
    """Return a signal of constant values, shape (width,) or (rows, width), over a duration [s]."""
    rows = np.atleast_2d(np.asarray(values, float))
    edges = np.broadcast_to([0.0, duration], (len(rows), 2))
    first, none = np.arange(len(rows) + 1), np.zeros(0)
    return Signal(first, edges, rows[..., None], (none,) * len(rows))


def sampled(knots: ArrayLike, step: float, duration: float) -> Signal:
    """Return values at knots that are a time step apart [s], straight between them.

    Parameters
    ----------
    knots : array_like, shape (rows, n, width)
        Values at 0, step, 2 step and so on; at least until the duration.
    step : float
        Time between knots [s].
    duration : float
        Length of the signal [s]; steps may pass over knots, but no farther than one at a time.
    """
    knots = np.asarray(knots, float)
    pieces = min(knots.shape[1] - 1, max(1, int(np.ceil(duration / step * (1.0 - 1e-12)))))
    times = step * np.arange(pieces + 1)
    edges = np.stack([times[:-1], times[1:]], axis=1)
    before, after = knots[:, :pieces], knots[:, 1 : pieces + 1]
    slopes = np.stack([0.5 * (after - before), 0.5 * (after + before)], axis=-1)
    rows, width = len(knots), knots.shape[-1]
    return Signal(
        pieces * np.arange(rows + 1),
        np.tile(edges, (rows, 1)),
        slopes.reshape(rows * pieces, width, 2),
        (np.zeros(0),) * rows,
    )


def from_pieces(rows: list[list[tuple[float, float, Array]]], breaks: list[list[float]]) -> Signal:
    """Return a signal of pieces (start, end, coefficients (width, terms)) of each row, in order."""
    first = np.append(0, np.cumsum([len(pieces) for pieces in rows]))
    edges = np.array([[a, b] for pieces in rows for a, b, _ in pieces])
    coefficients = np.array([of for pieces in rows for _, _, of in pieces])
    return Signal(first, edges, coefficients, tuple(np.array(own, float) for own in breaks))
