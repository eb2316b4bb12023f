"""Adaptive fit of a function of time by a signal, with located jumps and kinks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from continuair.signals.signal import Signal, constant, from_pieces

Array = np.ndarray

DEGREE = 9
TOLERANCE = 1e-10
"""Largest error of a fit, as a share of a component's largest value."""

SCAN = 0.25e-3
"""Spacing of the scan [s]; pulses of four times that length are detected."""

LEAST_SCAN = 64
_SHORTEST = 1e-3
"""Shortest piece, as a share of the scan's spacing; a fit that fails there marks a kink."""

_LAST_DIGITS = 1e-9
"""Relative distance from a declared jump within which the function is not evaluated: rounding in
the caller's arithmetic may shift the jump by a digit."""

_SHORT = 16.0
"""Ratio of lengths: a piece so much shorter than pieces on both sides may contain a kink."""

_MOST_CALLS = 400_000
"""Most evaluation times of a function, per second of a signal, and for shorter signals in all."""

_CHECKS = np.array([-0.83, -0.21, 0.57])
"""Positions within a piece at which a fit is compared with the function, besides the scan."""

_NODES = -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)


class UnresolvedSignal(ValueError):
    """A function of time that is not resolved within the allowed number of evaluations.

    Parameters
    ----------
    calls : int
        Allowed number of evaluation times.
    time : float
        A time at which the function is not resolved [s].
    """

    def __init__(self, calls: int, time: float) -> None:
        super().__init__(f"not resolved within {calls} calls, at t = {time:g} s")
        self.calls, self.time = calls, time


@dataclass(frozen=True, eq=False)
class _Intervals:
    """Candidate intervals for pieces, all arrays (n,).

    start, end [s]; run: index of the run; smooth: whether a search found no jump.
    """

    start: Array
    end: Array
    run: Array
    smooth: Array

    def __len__(self) -> int:
        return len(self.start)

    def where(self, chosen: Array) -> _Intervals:
        """Return a selection, by a mask or indices."""
        return _Intervals(*(each[chosen] for each in self.columns))

    def halves(self) -> _Intervals:
        """Return both halves of each interval."""
        middle = 0.5 * (self.start + self.end)
        return _joined(
            [
                _Intervals(self.start, middle, self.run, self.smooth),
                _Intervals(middle, self.end, self.run, self.smooth),
            ]
        )

    @property
    def columns(self) -> tuple[Array, Array, Array, Array]:
        return self.start, self.end, self.run, self.smooth


def _joined(parts: list[_Intervals]) -> _Intervals:
    columns = zip(*(part.columns for part in parts), strict=True)
    return _Intervals(*(np.concatenate(each) for each in columns))


@dataclass
class _Function:
    """A function of times (n,) -> (n, rows, width), and its values at the times of a scan."""

    evaluate: Callable[[Array], Array]
    duration: float
    calls: int = 0
    scale: Array = field(init=False)
    jumps: Array = field(init=False)

    @property
    def rows(self) -> int:
        """Return the number of runs, or 1 if all are equal."""
        return int(self.scanned.shape[1])

    @cached_property
    def scan(self) -> Array:
        """Return the times of the scan, jittered because equal spacing would alias."""
        count = max(LEAST_SCAN, int(np.ceil(self.duration / SCAN)))
        jitter = 0.4 * (np.random.default_rng(1).random(count) - 0.5)
        return np.asarray((np.arange(count) + 0.5 + jitter) * (self.duration / count))

    @cached_property
    def scanned(self) -> Array:
        """Return the values at the times of the scan."""
        return self(self.scan)

    @cached_property
    def moving(self) -> Array:
        """Return the indices of the components that change between the times of the scan."""
        return np.flatnonzero((self.scanned != self.scanned[:1]).any(axis=(0, 1)))

    def __call__(self, times: Array) -> Array:
        """Return values (*times.shape, rows, width)."""
        self.calls += times.size
        most = int(_MOST_CALLS * max(1.0, self.duration))
        if self.calls > most:
            raise UnresolvedSignal(most, float(times.flat[0]))
        found = np.asarray(self.evaluate(times.ravel()))
        return found.reshape(*times.shape, *found.shape[1:])


def fit(
    evaluate: Callable[[Array], Array],
    duration: float,
    *,
    jumps: Sequence[float] = (),
    alike: Sequence[slice] = (),
) -> Signal:
    """Fit a function of time by piecewise polynomials, with pieces of its own for each run.

    Parameters
    ----------
    evaluate : callable
        Function of times (n,) [s] that returns values (n, rows, width).
    duration : float
        Length of the signal, which covers [0, duration] [s].
    jumps : sequence of float
        Times of known jumps [s].
    alike : sequence of slice
        Components of one unit; those below 1e-3 of the largest are fitted less closely.

    Returns
    -------
    Signal
        The fit, with a relative error up to 1e-10 of each component's largest value.

    Raises
    ------
    UnresolvedSignal
        If the function is not resolved within the allowed number of evaluations.

    Notes
    -----
    A piece interpolates the function at Chebyshev-Lobatto nodes. It is halved if the error at a
    point of the scan, or at one of three more points, exceeds 1e-10 of the largest value. In short
    pieces whose error remains too large, differences are bisected: a jump is located to the last
    digit. A piece of 0.25 µs whose error remains too large is a kink. Jumps and kinks are
    breakpoints. The pieces of a run do not depend on the other runs.
    """
    function = _Function(evaluate, duration)
    seen = function.scanned
    rows, width = seen.shape[1:]
    ends = np.array([np.nextafter(0.0, 1.0), np.nextafter(duration, 0.0)])
    if not len(jumps) and (seen == seen[:1]).all() and (function(ends) == seen[:1]).all():
        return constant(seen[0], duration)
    function.scale = _scale_of(seen, alike or [slice(0, width)])
    edges = np.unique([0.0, *(t for t in jumps if 0.0 < t < duration), duration])
    function.jumps = edges
    known = [(float(t), float(t)) for t in edges[1:-1]]
    found = _fitted_between(function, {run: (known, []) for run in range(rows)})
    # Halving leaves ever shorter pieces around a kink. With a breakpoint there, long pieces fit on
    # both sides.
    again = {
        run: ([*known, *borders], row.gaps)
        for run, row in found.items()
        if (borders := _borders(row))
    }
    for run, row in _fitted_between(function, again).items():
        if len(row.pieces) < len(found[run].pieces):
            found[run] = row
    return from_pieces(
        [found[run].pieces for run in range(rows)],
        [sorted({*edges[1:-1], *_ends(found[run].gaps)}) for run in range(rows)],
    )


def _ends(gaps: list[_Gap]) -> list[float]:
    """Return the ends of gaps in order; adjacent gaps count as one."""
    found: list[float] = []
    for left, right in sorted(gaps):
        if found and left <= found[-1]:
            found.pop()
        found.append(right)
    return found


_Gap = tuple[float, float]
"""Last number before and first number after a jump or a kink."""


@dataclass
class _Row:
    """Pieces (start, end, coefficients) of one run in order, and gaps between some of them."""

    gaps: list[_Gap]
    pieces: list[tuple[float, float, Array]] = field(default_factory=list)


def _fitted_between(
    function: _Function, cuts: dict[int, tuple[list[_Gap], list[_Gap]]]
) -> dict[int, _Row]:
    """Fit some runs between cuts; cuts: of each run, all cuts and those found as gaps."""
    found = {run: _Row(list(gaps)) for run, (_, gaps) in cuts.items()}
    between = []
    for run, (own, _) in cuts.items():
        starts = [0.0, *(right for _, right in sorted(own))]
        stops = [*(left for left, _ in sorted(own)), function.duration]
        between += [(a, b, run) for a, b in zip(starts, stops, strict=True) if b > a]
    if not between:
        return found
    start, end, runs = (np.array(each) for each in zip(*between, strict=True))
    todo = _Intervals(start, end, runs, np.zeros(len(runs), bool))
    while len(todo):
        todo = _one_level(function, todo, found)
    for row in found.values():
        row.pieces.sort(key=lambda piece: piece[0])
    return found


def _borders(row: _Row) -> list[_Gap]:
    """Return the gaps of a run, and the ends of pieces much shorter than those on both sides."""
    starts, ends = np.array([piece[:2] for piece in row.pieces]).T
    lengths = ends - starts
    before = np.maximum.accumulate(lengths)
    after = np.maximum.accumulate(lengths[::-1])[::-1]
    # Of neighbours of one length, each may contain the kink.
    short = np.append(np.inf, lengths[:-1]) >= lengths
    short &= np.append(lengths[1:], np.inf) >= lengths
    short &= (_SHORT * lengths < before) & (_SHORT * lengths < after)
    # Pieces beside a gap are short because of it.
    known = np.array(row.gaps).ravel()
    short &= ~np.isin(starts, known) & ~np.isin(ends, known)
    times = np.unique(np.append(starts[short], ends[short]))
    return [*row.gaps, *((t, t) for t in times.tolist())]


def _scale_of(seen: Array, alike: Sequence[slice]) -> Array:
    """Return the largest values (rows, width), which scale errors."""
    own = np.abs(seen).max(axis=0)
    scale = own.copy()
    for where in alike:
        largest = own[:, where].max(axis=1, keepdims=True, initial=0.0)
        scale[:, where] = np.maximum(own[:, where], 1e-3 * largest)
    return np.where(scale == 0.0, 1.0, scale)


def _one_level(function: _Function, todo: _Intervals, found: dict[int, _Row]) -> _Intervals:
    """Fit all intervals at once; store good fits as pieces, and return the remaining intervals."""
    values, powers = _fitted(function, todo)
    misses = _misses(function, todo, powers)
    spacing = function.duration / len(function.scan)
    length = todo.end - todo.start
    kink = misses & (length <= _SHORTEST * spacing)
    looked_at = misses & ~kink & (length <= 2.0 * spacing) & ~todo.smooth
    for at in np.flatnonzero(~misses):
        own = found[int(todo.run[at])]
        own.pieces.append((float(todo.start[at]), float(todo.end[at]), powers[at]))
    for at in np.flatnonzero(kink):
        found[int(todo.run[at])].gaps.append((float(todo.start[at]), float(todo.end[at])))
    left = [todo.where(misses & ~kink & ~looked_at).halves()]
    for at in np.flatnonzero(looked_at):
        one = todo.where(np.array([at]))
        run = int(todo.run[at])
        jump = _jump(function, one, values[at, [0, -1]])
        if jump is None:
            left.append(_Intervals(one.start, one.end, one.run, np.array([True])).halves())
            continue
        found[run].gaps.append(jump)
        sides = np.array([[todo.start[at], jump[0]], [jump[1], todo.end[at]]])
        start, end = sides[sides[:, 1] > sides[:, 0]].T
        left.append(_Intervals(start, end, np.full(len(start), run), np.zeros(len(start), bool)))
    return _joined(left)


def _fitted(function: _Function, of: _Intervals) -> tuple[Array, Array]:
    """Return values at the nodes (n, nodes, width) of intervals, and interpolating coefficients.

    The coefficients have shape (n, width, terms).
    """
    ends, which = np.unique(np.stack([of.start, of.end], axis=1), axis=0, return_inverse=True)
    which = which.ravel()
    middle, half = ends.mean(axis=1)[:, None], 0.5 * np.diff(ends, axis=1)
    times = middle + half * _NODES
    # At known jumps, the function is evaluated on the interval's side.
    at_jump = np.isin(ends, function.jumps)
    off = np.where(at_jump, np.minimum(_LAST_DIGITS * np.abs(ends), 1e-3 * half), 0.0)
    start, end = ends[:, 0] + off[:, 0], ends[:, 1] - off[:, 1]
    times[:, 0] = np.where(at_jump[:, 0], np.nextafter(start, np.inf), start)
    times[:, -1] = np.where(at_jump[:, 1], np.nextafter(end, -np.inf), end)
    own = at_jump.any(axis=1, keepdims=True)
    places = np.where(own, (times - middle) / half, _NODES)
    values = function(times)[which, :, of.run if function.rows > 1 else 0]
    return values, _through(values, places[which])


def _through(values: Array, places: Array) -> Array:
    """Return coefficients (intervals, width, terms) of interpolating polynomials.

    values: (intervals, nodes, width) at places (intervals, nodes). The highest power comes first;
    algorithm of Björck and Pereyra (1970). It works element by element, because the rounding of
    matrix products depends on their size and on the processor: a run has the same signal alone, in
    a batch and on any machine.
    """
    found, x = np.moveaxis(values, 1, 0).copy(), places.T[..., None]
    for k in range(DEGREE):
        found[k + 1 :] = (found[k + 1 :] - found[k:-1]) / (x[k + 1 :] - x[: DEGREE - k])
    for k in reversed(range(DEGREE)):
        found[k:-1] -= x[k] * found[k + 1 :]
    return np.moveaxis(found[::-1], 0, -1)


def _misses(function: _Function, of: _Intervals, powers: Array) -> Array:
    """Return whether fits (n, width, terms) exceed the tolerance in their intervals (n,)."""
    middle, half = 0.5 * (of.start + of.end), 0.5 * (of.end - of.start)
    run = of.run if function.rows > 1 else np.zeros(len(of), int)
    allowed = TOLERANCE * function.scale[run]
    times, which = np.unique(middle[:, None] + half[:, None] * _CHECKS, return_inverse=True)
    asked = function(times)[which.reshape(-1, len(_CHECKS)), run[:, None]]
    # Components that are constant in the scan must be constant in every fit.
    moving = function.moving
    bends = np.abs(powers[..., :-1]).max(axis=-1) > allowed
    missed = np.delete(bends, moving, axis=1).any(axis=1)
    for u, values in zip(_CHECKS, np.moveaxis(asked, 1, 0), strict=True):
        missed |= (np.abs(_evaluated(powers, u) - values) > allowed).any(axis=-1)
    # Compare the others with the scan, only where those three points fit.
    powers, allowed = powers[:, moving], allowed[:, moving]
    left = np.flatnonzero(~missed)
    first, last = np.searchsorted(function.scan, np.stack([of.start[left], of.end[left]]))
    for one, a, b in zip(left, first, last, strict=True):
        u = ((function.scan[a:b] - middle[one]) / half[one])[:, None]
        off = np.abs(_evaluated(powers[one], u) - function.scanned[a:b, run[one], moving])
        missed[one] = (off > allowed[one]).any()
    return missed


def _evaluated(powers: Array, u: float | Array) -> Array:
    """Evaluate polynomials (..., terms) at a position within their pieces."""
    found = powers[..., 0]
    for term in range(1, powers.shape[-1]):
        found = found * u + powers[..., term]
    return found


def _jump(function: _Function, of: _Intervals, ends: Array) -> tuple[float, float] | None:
    """Return the adjacent numbers between which a run jumps in one interval, or None.

    ends: values (2, width) at the interval's ends.
    """
    a, b = float(of.start[0]), float(of.end[0])
    run = int(of.run[0]) if function.rows > 1 else 0
    scale = function.scale[run]
    before, after = ends / scale
    first = np.abs(after - before).max()
    if first == 0.0:
        return None
    for level in range(70):
        middle = 0.5 * (a + b)
        if middle in (a, b):
            break
        value = function(np.array([middle]))[0, run] / scale
        if np.abs(value - before).max() > np.abs(after - value).max():
            b, after = middle, value
        else:
            a, before = middle, value
        if level == 12 and np.abs(after - before).max() < 0.05 * first:
            return None
    # If the ends differ by rounding alone, rounding was bisected.
    return (a, b) if np.abs(after - before).max() > TOLERANCE else None
