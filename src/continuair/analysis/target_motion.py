"""How fast targets move: the norms that Assumption 3 bounds, of velocity, acceleration and jerk."""

from __future__ import annotations

import numpy as np

from continuair.scenario.paths import Path
from continuair.scenario.scenarios import Scenario

Array = np.ndarray

_PER_PATH, _MOST, _AT_ONCE = 20_000, 1_000_000, 100_000
"""Times at which a path is looked at within its duration, at most in all, and at once."""

_FINER, _GROWN = 4, 1.1
"""How many times as many are asked in doubt, and the growth of what these do not tell either."""

_UNEVEN = 200.0
"""Mean changes of a difference, from one to the next, that its largest value may have by rounding;
one jump among all of them is thousands."""


def norms_at(scenario: Scenario, time: Array) -> Array:
    """Norms (targets, 3, n) of velocity, acceleration and jerk of the targets at times (n,) [s]."""
    found = []
    for target in scenario.targets:
        beside = target.path.duration / _PER_PATH
        fore, back = np.minimum(time + beside, scenario.duration), np.maximum(time - beside, 0.0)
        change = target.path(fore)[2] - target.path(back)[2]
        jerk = change / (fore - back)[:, None]
        found.append([_length(each) for each in (*target.path(time)[1:], jerk)])
    return np.array(found)


def largest_norms(scenario: Scenario) -> Array:
    """The largest (targets, 3) over the scenario, L_1, L_2 and L_3 of Assumption 3; SI units.

    inf for those that grow with the number of times that are looked at, as a jerk does where an
    acceleration jumps, or where a path turns within too short a time. The rounding of a path from a
    function adds to the jerk of slow ones.
    """
    return np.array([_largest(target.path, scenario.duration) for target in scenario.targets])


def _largest(path: Path, end: float) -> Array:
    count = int(np.clip(_PER_PATH * end / path.duration, _PER_PATH, _MOST))
    (found, _), (finer, rounding) = (_seen(path, end, each) for each in (count, _FINER * count))
    return np.where(finer > _GROWN * found + rounding, np.inf, found)


def _seen(path: Path, end: float, count: int) -> tuple[Array, Array]:
    """The largest norms (3,) at so many times, those of differences as means between them, and how
    much of each may be rounding, as of a path from a function: what is all over it, no jump."""
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
    return np.asarray(np.linalg.norm(vectors, axis=1))
