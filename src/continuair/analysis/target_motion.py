"""Norms of a target's velocity, acceleration and jerk, which Assumption 3 bounds."""

from __future__ import annotations

import numpy as np

from continuair.scenario.paths import Path
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array

_PER_PATH, _MOST, _AT_ONCE = 20_000, 1_000_000, 100_000
"""Samples of a path within its duration, the most in all, and the most at once."""

_FINER, _GROWN = 4, 1.1
"""Factor of the finer sampling, and growth of a norm that shows that it is unbounded."""

_UNEVEN = 200.0
"""Largest ratio of a difference to the mean change between differences that rounding causes; a
single jump gives thousands."""


def norms_at(scenario: Scenario, time: Array) -> Array:
    """Return norms (targets, 3, n) of velocity, acceleration and jerk of targets at times [s]."""
    found = []
    for target in scenario.targets:
        beside = target.path.duration / _PER_PATH
        fore, back = np.minimum(time + beside, scenario.duration), np.maximum(time - beside, 0.0)
        change = target.path(fore)[2] - target.path(back)[2]
        jerk = change / (fore - back)[:, None]
        found.append([_length(each) for each in (*target.path(time)[1:], jerk)])
    return np.array(found)


def largest_norms(scenario: Scenario) -> Array:
    """Return the largest norms (targets, 3) over the scenario, L_1, L_2 and L_3 of Assumption 3;
    SI.

    inf for those that grow with finer sampling, such as a jerk where the acceleration jumps, or
    where a path turns within too short a time. The rounding of a path from a function adds to the
    jerk of slow paths.
    """
    return np.array([_largest(target.path, scenario.duration) for target in scenario.targets])


def _largest(path: Path, end: float) -> Array:
    """Return the largest norms (3,) of a path, inf for those that grow with finer sampling."""
    count = int(np.clip(_PER_PATH * end / path.duration, _PER_PATH, _MOST))
    (found, _), (finer, rounding) = (_seen(path, end, each) for each in (count, _FINER * count))
    return np.where(finer > _GROWN * found + rounding, np.inf, found)


def _seen(path: Path, end: float, count: int) -> tuple[Array, Array]:
    """Return the largest norms (3,) at `count` times, and how much of each may be rounding.

    Norms of differences are means over an interval. Rounding, as of a path from a function, is
    spread over all samples, unlike a jump.
    """
    found, uneven, step = np.zeros(3), np.zeros(3), end / count
    for first in range(0, count, _AT_ONCE):
        times = step * np.arange(first, min(first + _AT_ONCE, count) + 1)
        _, velocity, acceleration = path(times)
        rate, jerk = (np.diff(each, axis=0) / step for each in (velocity, acceleration))
        of_path = _length(velocity).max(), max(_length(acceleration).max(), _length(rate).max())
        found = np.maximum(found, [*of_path, _length(jerk).max()])
        bends = (_length(np.diff(each, axis=0)) for each in (rate, jerk))
        uneven += [0.0, *(each.sum() for each in bends)]
    return found, _UNEVEN * uneven / count


def _length(vectors: Array) -> Array:
    """Return the norms (n,) of vectors (n, 3)."""
    return np.asarray(np.linalg.norm(vectors, axis=1))
