"""Time grids: steps that end at every sample, input jump and controller update."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from continuair.errors import InputError
from continuair.typing import Array, ArrayLike

MOST_STEPS = 1e7
"""Most steps of one run, whose inputs are sampled beforehand and must fit into memory."""

_ROUNDING = 1e-6
"""Fraction of a sample that may be left over, and of a step that may be exceeded, by rounding."""

_LAST_DIGITS = 1e-9
"""Relative distance of steps from a jump, as rounding may move it."""

_SAME = 0.05 * _LAST_DIGITS
"""Relative distance within which a jump is at a sample: less than that of steps from a jump."""

_WITHIN = 1e-3
"""Fraction of a step by which its ends may move."""


@dataclass(frozen=True)
class Grid:
    """A time grid.

    samples (n,) [s]; starts and steps (m,) [s]; sample_after (m,): the sample at the end of a step,
    or -1; opens, closes (m,): whether a step starts or ends at an input jump.
    """

    samples: Array
    starts: Array
    steps: Array
    sample_after: NDArray[np.int32]
    opens: NDArray[np.bool_]
    closes: NDArray[np.bool_]


@dataclass(frozen=True)
class Marks:
    """Times [s] at which steps must end: samples (n,), all times, and the jumps among them.

    Start and end of a flight are jumps, too: inputs beyond them do not act.
    """

    samples: Array
    times: Array
    jumps: Array


def marks_of(
    duration: float,
    sample: float,
    jumps: ArrayLike = (),
    control_period: float | None = None,
    latency: float = 0.0,
    knots: ArrayLike = (),
) -> Marks:
    """Return the breakpoints of a flight over [0, duration], with a sample at its end.

    latency: time from a controller update to its command [s]; knots: kinks of inputs [s].
    """
    # The last interval may be shorter; a remainder of rounding is ignored.
    count = max(1, int(np.ceil(duration / sample - _ROUNDING)))
    samples = np.append(sample * np.arange(count), duration)
    return marks_at(samples, np.append(jumps, duration), control_period, latency, knots)


def marks_at(
    samples: Array,
    jumps: ArrayLike = (),
    control_period: float | None = None,
    latency: float = 0.0,
    knots: ArrayLike = (),
) -> Marks:
    """Return the breakpoints of a flight, or a part of it, with samples (n,) at these times [s].

    A jump within rounding of a sample is at that sample; the first and the last sample are
    approached from inside.
    """
    end = float(samples[-1])
    inside = _at_samples(np.append(0.0, jumps), samples)
    inside = inside[(inside >= samples[0]) & (inside <= end)]
    times, kinks = np.union1d(samples, inside), np.array(knots, float)
    times = _merged(times, kinks[(kinks > samples[0]) & (kinks < end)])
    times = _merged(times, control_times(end, control_period, latency)[1:-1])
    return Marks(samples, times, inside)


def grid_of(marks: Marks, step: float) -> Grid:
    """Return the intervals between breakpoints in equal steps of at most `step` [s]."""
    times, samples = marks.times, marks.samples
    length = np.diff(times)
    pieces = _pieces(length, step)
    last = np.cumsum(pieces) - 1
    within = np.arange(pieces.sum()) - np.repeat(last - pieces + 1, pieces)
    steps = np.repeat(length / pieces, pieces)
    sample_after = np.full(len(steps), -1, np.int32)
    is_sample = np.isin(times[1:], samples)
    sample_after[last[is_sample]] = np.searchsorted(samples, times[1:])[is_sample]
    opens, closes = np.zeros(len(steps), bool), np.zeros(len(steps), bool)
    at_jump = np.isin(times, marks.jumps)
    opens[(last - pieces + 1)[at_jump[:-1]]] = True
    closes[last[at_jump[1:]]] = True
    starts = np.repeat(times[:-1], pieces) + within * steps
    return Grid(samples, starts, steps, sample_after, opens, closes)


def shared_grids(marks: Marks, steps: Array) -> list[tuple[NDArray[np.intp], Grid]]:
    """Return groups of runs, by index, whose steps (runs,) [s] give one grid, and that grid."""
    distinct, which = np.unique(steps, return_inverse=True)
    if len(distinct) == 1:
        return [(np.arange(len(steps)), grid_of(marks, float(distinct[0])))]
    # Equal intervals differ by rounding, which must not distinguish grids.
    lengths = np.unique(np.round(np.diff(marks.times), 12))
    pieces = _pieces(lengths[None], distinct[:, None])
    first, group = np.unique(pieces, axis=0, return_index=True, return_inverse=True)[1:]
    of_run = group.ravel()[which]
    return [
        (np.flatnonzero(of_run == n), grid_of(marks, float(distinct[at])))
        for n, at in enumerate(first)
    ]


def _pieces(length: Array, step: float | Array) -> NDArray[np.intp]:
    """Return the number of steps in each interval [s]."""
    # Late intervals may be longer than the first by rounding, without more steps.
    return np.maximum(1, np.ceil(length / step * (1.0 - _ROUNDING))).astype(np.intp)


def check_steps(duration: float, finest: float) -> None:
    """Raise InputError if a flight has more steps of a length [s] than fit into memory."""
    if duration > MOST_STEPS * finest:
        raise InputError(
            "duration",
            f"is {duration:g} s, more than {MOST_STEPS:.0e} steps of {finest:.2g} s",
            "shorten it, give a longer step, or check the arm's stiffness and damping",
        )


def check_marks(duration: float, sample: float, period: float | None) -> None:
    """Raise InputError if a flight has more samples or control periods [s] than fit into memory."""
    finest = sample if period is None else min(sample, period)
    if duration > MOST_STEPS * finest:
        raise InputError(
            "duration",
            (
                f"is {duration:g} s, more than {MOST_STEPS:.0e} samples or control periods "
                f"of {finest:.2g} s"
            ),
            "shorten it, or give a longer sample",
        )


def control_instants(duration: float, period: float) -> int:
    """Return the number of controller updates in [0, duration), one per period from 0."""
    return int(np.ceil(duration / period * (1.0 - 1e-12)))


def control_times(duration: float, period: float | None, latency: float = 0.0) -> Array:
    """Return the start and end of a flight, and the times of controller updates between them [s].

    One update per period; with a latency [s], also the times at which commands act.
    """
    times = np.array([0.0, duration])
    if period is None:
        return times
    instants = np.asarray(period * np.arange(control_instants(duration, period)), float)
    times = _merged(times, instants)
    if latency > 0.0:
        late = instants + latency
        times = _merged(times, late[late < duration * (1.0 - 1e-9)])
    return times


def call_times(duration: float, rate: float) -> Array:
    """Return the times of a flight, from 0, at which a force_callback is called [s]."""
    return np.asarray(np.arange(max(1, int(np.ceil(duration * rate * (1.0 - 1e-9))))) / rate)


def instants_at(grid: Grid, period: float, latency: float = 0.0) -> NDArray[np.intp]:
    """Return the controller update (m,) at the start of a step, or a latency [s] before; -1 for
    none.

    Of several starts within rounding of an update, as beside a jump, the first one counts.
    """
    since = grid.starts - latency
    counts = np.maximum(np.round(since / period), -1).astype(int)
    near = np.abs(since - counts * period) < 2.0 * _LAST_DIGITS * grid.samples[-1]
    again = np.append(False, near[:-1] & (counts[1:] == counts[:-1]))
    return np.where(near & ~again, counts, -1)


def _merged(marks: Array, instants: Array) -> Array:
    """Return breakpoints with further times [s], except those within rounding of a breakpoint."""
    gap = np.abs(marks[_nearest(marks, instants)] - instants)
    return np.union1d(marks, instants[gap > _LAST_DIGITS * marks[-1]])


def _at_samples(jumps: Array, samples: Array) -> Array:
    """Return jumps [s], moved to a sample if within rounding of it."""
    nearest = samples[_nearest(samples, jumps)]
    same = np.abs(nearest - jumps) < _SAME * jumps
    return np.where(same, nearest, jumps)


def _nearest(marks: Array, times: Array) -> NDArray[np.intp]:
    """Return the index of the breakpoint, of two or more in order, nearest to each time."""
    after = np.clip(np.searchsorted(marks, times), 1, len(marks) - 1)
    before_is = times - marks[after - 1] < marks[after] - times
    return np.asarray(after - before_is)


def stage_times(grid: Grid) -> Array:
    """Return start, middle and end of every step (3 m,), kept on the step's own side of a jump."""
    start, end = grid.starts.copy(), np.append(grid.starts[1:], grid.samples[-1])
    opens, closes = grid.opens, grid.closes
    start[opens] = beside(start[opens], grid.steps[opens], np.inf)
    end[closes] = beside(end[closes], grid.steps[closes], -np.inf)
    return np.column_stack([start, grid.starts + 0.5 * grid.steps, end]).ravel()


def seen_at(samples: Array, jumps: ArrayLike) -> Array:
    """Return the times [s] at which samples (n,) show inputs.

    At a jump after it, and at the end of the flight before it.
    """
    if len(samples) < 2:
        return samples
    steps = np.diff(samples)
    opens = np.isin(samples, _at_samples(np.asarray(jumps, float), samples))[:-1]
    begins = np.where(opens, beside(samples[:-1], steps, np.inf), samples[:-1])
    return np.append(begins, beside(samples[-1], steps[-1], -np.inf))


def beside(jumps: ArrayLike, steps: ArrayLike, side: float) -> Array:
    """Return times [s] on one side, inf or -inf, of jumps, well within the steps [s] there.

    Outside the rounding error of a jump: int(t / dt) jumps a last digit beside k dt, and a sum of
    start and step ends there.
    """
    off = np.minimum(_LAST_DIGITS * np.abs(jumps), _WITHIN * np.asarray(steps))
    # Numbers beside 0 are subnormal, which NumPy may be configured to report.
    with np.errstate(under="ignore"):
        return np.nextafter(jumps + np.copysign(off, side), side)
