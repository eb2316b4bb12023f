"""Up to where an error stays within a tolerance: a scan, and finer steps about where it leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Limit:
    """Up to where an error is tolerable, with all places and errors (n,) that were tried.

    last: the last place before the first beyond the tolerance; NaN if the first one tried is beyond
    it already, inf if none is.
    """

    last: float
    places: Array
    errors: Array


def find_limits(
    places: Array,
    errors: Mapping[str, Array],
    tolerance: float,
    finer: Callable[[Array, str], Array],
    count: int,
) -> dict[str, Limit]:
    """Return by name where errors (n,) over places (n,) above 0 first leave a tolerance.

    finer: returns the errors of one name at `count` more places, between the last within and the
    first beyond. An error that is NaN is beyond.
    """
    limits = {}
    for name, found in errors.items():
        at, first = places, _first_beyond(found, tolerance)
        if 0 < first < len(at):
            between = np.geomspace(at[first - 1], at[first], count + 2)[1:-1]
            at = np.insert(at, first, between)
            found = np.insert(found, first, finer(between, name))
            first = _first_beyond(found, tolerance)
        ends = np.concatenate([[np.nan], at[:-1], [np.inf]])
        limits[name] = Limit(float(ends[first]), at, found)
    return limits


def _first_beyond(errors: Array, tolerance: float) -> int:
    """Index of the first error that is not within, the number of errors if all are."""
    within = errors <= tolerance
    return len(within) if within.all() else int(np.argmin(within))
