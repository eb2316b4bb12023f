"""Samples of topics, each at its own times, brought to one even grid of times."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from continuair.errors import InputError
from continuair.interfaces.log_topics import Topic
from continuair.vehicle.coordinates import unflipped

Array = np.ndarray

_WIDEST_GAP = 5.0
"""Time between samples, over the usual one, from which they have a gap."""

_NEAREST = 0.25
"""Time between samples, over the usual one, below which no spline goes through them."""

_FASTER = 1.02
"""Rate over that of a measurement, at most: clocks are not exact."""

_ROUNDING = 1e-6
"""Remainder of a period, or a second, that is rounding alone."""

_UNIT_NORM_TOLERANCE = 0.02


@dataclass(frozen=True)
class Signal:
    """Values (n, width) of a topic at times (n,) [s], which ascend; period: the usual time between
    samples [s]."""

    topic: Topic
    time: Array
    values: Array
    period: float

    def at(self, times: Array) -> Array:
        """Return values on a cubic spline through the samples, as arms swing within a few of them.

        Interpolation is linear where samples are so close that their noise makes a steep slope.
        """
        near = np.diff(self.time).min() < _NEAREST * self.period
        order = 1 if near else min(3, len(self.time) - 1)
        return np.asarray(make_interp_spline(self.time, self.values, k=order)(times))

    def turned_at(self, times: Array) -> Array:
        """Return the unit quaternions (n, 4), interpolated as by `at`."""
        between = replace(self, values=unflipped(self.values)).at(times)
        return np.asarray(between / np.linalg.norm(between, axis=1, keepdims=True))

    def mapped(self, function: Callable[[Array], Array]) -> Signal:
        """Return the signal of what a function makes of its values (n, width)."""
        return replace(self, values=function(self.values))

    def mean_from(self, times: Array) -> Array:
        """Return means (n, width) of held values from each time to the next, with equal impulse.

        The last is the value held at the last time.
        """
        lasting = np.diff(self.time)[:, None] * self.values[:-1]
        summed = np.vstack([np.zeros(self.values.shape[1]), np.cumsum(lasting, 0)])
        beyond = np.append(self.time, max(times[-1], self.time[-1]) + self.period)
        summed = np.vstack([summed, summed[-1] + (beyond[-1] - self.time[-1]) * self.values[-1]])
        at_edges = np.stack([np.interp(times, beyond, column) for column in summed.T], -1)
        held = self.values[np.searchsorted(self.time, times[-1], side="right") - 1]
        return np.vstack([np.diff(at_edges, axis=0) / np.diff(times)[:, None], held])


def signal(topic: Topic, time: Array, values: Array) -> Signal:
    """Return samples in the order of their times (n,) [s], without repeated ones."""
    time, first = np.unique(np.asarray(time, float), return_index=True)
    if len(time) < 2:
        raise InputError(
            f"topic {topic}", f"holds {len(time)} samples", "give a topic that was recorded"
        )
    period = float(np.median(np.diff(time)))
    return Signal(topic, time, np.asarray(values, float)[first], period)


def aligned(
    signals: Mapping[str, Signal],
    held: Iterable[str],
    rate: float | None,
    window: tuple[float, float] | None,
) -> tuple[Array, dict[str, Signal]]:
    """Return uniform times (n,) [s] in a window, or common to all signals, and the signals there.

    held: roles of signals whose last value stays valid. rate: in Hz, by default that of the slowest
    of the others. Raises InputError where signals do not cover the window, have a gap, or are not
    finite in it.
    """
    measured = [each for role, each in signals.items() if role not in held]
    first, last = _span(signals, held)
    if window is not None:
        if window[0] < first - _ROUNDING or window[1] > last + _ROUNDING:
            raise InputError(
                "window",
                (
                    f"is {window[0]:g} to {window[1]:g} s, but all topics are there from "
                    f"{first:.6g} to {last:.6g} s"
                ),
                "choose a part of that",
            )
        first, last = max(window[0], first), min(window[1], last)
    period = _row_period(rate, measured)
    count = int((last - first) / period + _ROUNDING) + 1
    times = np.minimum(first + period * np.arange(count), last)
    return times, {role: _within(each, first, last) for role, each in signals.items()}


def _row_period(rate: float | None, measured: Iterable[Signal]) -> float:
    """Return the time between rows [s].

    Raises InputError for rows between which something was not measured. A fit would take
    interpolated values for measurements.
    """
    slowest = max(measured, key=lambda each: each.period)
    if rate is None:
        return slowest.period
    if rate * slowest.period > _FASTER:
        raise InputError(
            "rate",
            f"is {rate:g} Hz, but {slowest.topic} was measured at {1.0 / slowest.period:.4g} Hz",
            "give at most that",
        )
    return 1.0 / rate


def _span(signals: Mapping[str, Signal], held: Iterable[str]) -> tuple[float, float]:
    """Return the times between which all signals exist [s], or raise InputError."""
    starts = {float(each.time[0]): each for each in signals.values()}
    ends = {
        float(each.time[-1]) + (each.period if role in held else 0.0): each
        for role, each in signals.items()
    }
    first, last = max(starts), min(ends)
    if not last > first:
        raise InputError(
            str(starts[first].topic),
            f"starts at {first:.6g} s, after the end of {ends[last].topic} at {last:.6g} s",
            "record them together, with stamps of one clock",
        )
    return first, last


def _within(found: Signal, first: float, last: float) -> Signal:
    """Return the samples around two times [s]; InputError for a gap or a non-finite value."""
    near = slice(
        max(int(np.searchsorted(found.time, first, side="right")) - 1, 0),
        int(np.searchsorted(found.time, last)) + 1,
    )
    time, values = found.time[near], found.values[near]
    wrong = np.flatnonzero(~np.isfinite(values).all(1))
    if wrong.size:
        raise InputError(
            str(found.topic),
            f"is no finite number at {time[wrong[0]]:.6g} s",
            "choose a window without it",
        )
    gaps = np.flatnonzero(np.diff(time) > _WIDEST_GAP * found.period)
    if gaps.size:
        at = gaps[0]
        raise InputError(
            str(found.topic),
            (
                f"has a gap of {time[at + 1] - time[at]:.3g} s at {time[at]:.6g} s, where "
                f"its samples are {found.period:.3g} s apart"
            ),
            "choose a window without it",
        )
    return Signal(found.topic, time, values, found.period)


def check_unit(found: Signal) -> None:
    """Raise InputError unless the values are unit quaternions."""
    norm = np.linalg.norm(found.values, axis=1)
    wrong = np.flatnonzero(~(np.abs(norm - 1.0) <= _UNIT_NORM_TOLERANCE))
    if wrong.size:
        raise InputError(
            str(found.topic),
            f"has norm {norm[wrong[0]]:.4g} at {found.time[wrong[0]]:.6g} s",
            "give unit quaternions",
        )
