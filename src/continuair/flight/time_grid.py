"""Time grids: steps that end at every sample, every input jump and every control instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from continuair.errors import InputError

MOST_STEPS = 1e7
"""Steps of one run: their inputs are sampled beforehand, and would fill the memory."""

_ROUNDING = 1e-6
"""Share of a sample that is left over, and of a step by which it may be longer, by rounding."""

_LAST_DIGITS = 1e-9
"""Share of a time by which steps stay beside a jump, as rounding may put it elsewhere."""

_SAME = 0.05 * _LAST_DIGITS
"""Share of a time within which a jump is the sample there: less than steps stay beside it."""

_WITHIN = 1e-3
"""Share of a step within which its ends may be elsewhere."""


@dataclass(frozen=True)
class Grid:
    """samples (n,) [s]; starts and steps (m,) [s]; sample_after (m,): sample a step ends at, or -1;
    opens, closes (m,): whether a step starts or ends at an input jump."""

    samples: np.ndarray
    starts: np.ndarray
    steps: np.ndarray
    sample_after: np.ndarray
    opens: np.ndarray
    closes: np.ndarray


@dataclass(frozen=True)
class Marks:
    """Times [s] that steps have to end at: samples (n,), all of them, and the jumps among them.

    Start and end of a flight are jumps, too: what an input is beyond them does not act.
    """

    samples: np.ndarray
    times: np.ndarray
    jumps: np.ndarray


def marks_of(
    duration: float,
    sample: float,
    jumps: ArrayLike = (),
    control_period: float | None = None,
    latency: float = 0.0,
    knots: ArrayLike = (),
) -> Marks:
    """The marks of a flight over [0, duration], with a sample at its end; latency: after each
    control instant, when its push acts [s]; knots: where inputs have kinks [s]."""
    # The last interval is the shorter one; what is left of rounding is none.
    count = max(1, int(np.ceil(duration / sample - _ROUNDING)))
    samples = np.append(sample * np.arange(count), duration)
    return marks_at(samples, np.append(jumps, duration), control_period, latency, knots)


def marks_at(
    samples: np.ndarray,
    jumps: ArrayLike = (),
    control_period: float | None = None,
    latency: float = 0.0,
    knots: ArrayLike = (),
) -> Marks:
    """The marks of a flight, or of a part, with samples (n,) at these times [s], first to last.

    A jump within rounding of a sample is at that sample; the first and the last one are met from
    inside.
    """
    end = float(samples[-1])
    inside = _at_samples(np.append(0.0, jumps), samples)
    inside = inside[(inside >= samples[0]) & (inside <= end)]
    times, kinks = np.union1d(samples, inside), np.array(knots, float)
    times = _merged(times, kinks[(kinks > samples[0]) & (kinks < end)])
    times = _merged(times, control_times(end, control_period, latency)[1:-1])
    return Marks(samples, times, inside)


def grid_of(marks: Marks, step: float) -> Grid:
    """The intervals between marks in equal steps of at most `step` [s]."""
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


def shared_grids(marks: Marks, steps: np.ndarray) -> list[tuple[np.ndarray, Grid]]:
    """Runs, by their indices, whose steps (runs,) [s] give them the same grid, and that grid."""
    distinct, which = np.unique(steps, return_inverse=True)
    if len(distinct) == 1:
        return [(np.arange(len(steps)), grid_of(marks, float(distinct[0])))]
    # Equal intervals differ by rounding, which must not tell grids apart.
    lengths = np.unique(np.round(np.diff(marks.times), 12))
    pieces = _pieces(lengths[None], distinct[:, None])
    first, group = np.unique(pieces, axis=0, return_index=True, return_inverse=True)[1:]
    of_run = group.ravel()[which]
    return [
        (np.flatnonzero(of_run == n), grid_of(marks, float(distinct[at])))
        for n, at in enumerate(first)
    ]


def _pieces(length: np.ndarray, step: float | np.ndarray) -> np.ndarray:
    """The number of steps in each interval [s]."""
    # Late intervals are longer than the first by rounding, and take no more steps.
    found: np.ndarray = np.maximum(1, np.ceil(length / step * (1.0 - _ROUNDING))).astype(int)
    return found


def check_steps(duration: float, finest: float) -> None:
    """Raise InputError if a flight takes more steps of a length [s] than fit into memory."""
    if duration > MOST_STEPS * finest:
        raise InputError(
            f"duration is {duration:g} s, which takes more than {MOST_STEPS:.0e} steps of "
            f"{finest:.2g} s; shorten it, give a longer step or sample, or check arm.radius, "
            "arm.length, arm.youngs_modulus, its damping and the initial rates, which make the "
            "automatic step short."
        )


def check_marks(duration: float, sample: float, period: float | None) -> None:
    """Raise InputError if a flight has more samples or control periods [s] than fit into memory."""
    finest = sample if period is None else min(sample, period)
    if duration > MOST_STEPS * finest:
        raise InputError(
            f"duration is {duration:g} s, which takes more than {MOST_STEPS:.0e} samples or "
            f"control periods of {finest:.2g} s; shorten it, or give a longer sample."
        )


def control_instants(duration: float, period: float) -> int:
    """The number of control instants in [0, duration), one per period from 0."""
    return int(np.ceil(duration / period * (1.0 - 1e-12)))


def control_times(duration: float, period: float | None, latency: float = 0.0) -> np.ndarray:
    """Start and end of a flight, and times between them at which a controller acts, one per period
    [s], or its commands do, a latency later [s]."""
    times = np.array([0.0, duration])
    if period is None:
        return times
    instants = period * np.arange(control_instants(duration, period))
    times = _merged(times, instants)
    if latency > 0.0:
        late = instants + latency
        times = _merged(times, late[late < duration * (1.0 - 1e-9)])
    return times


def call_times(duration: float, rate: float) -> np.ndarray:
    """The times from 0 on, before the end of a flight, at which a force_callback is called [s]."""
    return np.arange(max(1, int(np.ceil(duration * rate * (1.0 - 1e-9))))) / rate


def instants_at(grid: Grid, period: float, latency: float = 0.0) -> np.ndarray:
    """Which control instant (m,) starts a step, or was a latency [s] before, and -1 for none.

    Of several starts within rounding of an instant, as beside a jump, the first is its.
    """
    since = grid.starts - latency
    counts = np.maximum(np.round(since / period), -1).astype(int)
    near = np.abs(since - counts * period) < 2.0 * _LAST_DIGITS * grid.samples[-1]
    again = np.append(False, near[:-1] & (counts[1:] == counts[:-1]))
    return np.where(near & ~again, counts, -1)


def _merged(marks: np.ndarray, instants: np.ndarray) -> np.ndarray:
    """Marks with instants [s], but for those within rounding of a mark."""
    gap = np.abs(marks[_nearest(marks, instants)] - instants)
    return np.union1d(marks, instants[gap > _LAST_DIGITS * marks[-1]])


def _at_samples(jumps: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Jumps [s], of which those within rounding of one of two or more samples are at it."""
    nearest = samples[_nearest(samples, jumps)]
    same = np.abs(nearest - jumps) < _SAME * jumps
    found: np.ndarray = np.where(same, nearest, jumps)
    return found


def _nearest(marks: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Index of the mark, of two or more in order, that is nearest to each time."""
    after = np.clip(np.searchsorted(marks, times), 1, len(marks) - 1)
    before_is: np.ndarray = times - marks[after - 1] < marks[after] - times
    return after - before_is


def stage_times(grid: Grid) -> np.ndarray:
    """Start, middle and end of every step (3 m,), nudged to the step's own side of a jump."""
    start, end = grid.starts.copy(), np.append(grid.starts[1:], grid.samples[-1])
    opens, closes = grid.opens, grid.closes
    start[opens] = beside(start[opens], grid.steps[opens], np.inf)
    end[closes] = beside(end[closes], grid.steps[closes], -np.inf)
    return np.column_stack([start, grid.starts + 0.5 * grid.steps, end]).ravel()


def seen_at(samples: np.ndarray, jumps: ArrayLike) -> np.ndarray:
    """Times [s] at which samples (n,) show inputs: at a jump as the next step begins with them, at
    the end as the last step ends."""
    if len(samples) < 2:
        return samples
    steps = np.diff(samples)
    opens = np.isin(samples, _at_samples(np.asarray(jumps, float), samples))[:-1]
    begins = np.where(opens, beside(samples[:-1], steps, np.inf), samples[:-1])
    return np.append(begins, beside(samples[-1], steps[-1], -np.inf))


def beside(jumps: ArrayLike, steps: ArrayLike, side: float) -> np.ndarray:
    """Times [s] on one side, inf or -inf, of jumps, well within the steps [s] there.

    As far off as rounding may put a jump: int(t / dt) jumps a last digit beside k dt, and a sum of
    start and step ends there.
    """
    off = np.minimum(_LAST_DIGITS * np.abs(jumps), _WITHIN * np.asarray(steps))
    # Beside 0 lie numbers that are too small to be normal, of which NumPy may be set to tell.
    with np.errstate(under="ignore"):
        return np.nextafter(jumps + np.copysign(off, side), side)
