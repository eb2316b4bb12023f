"""Limit up to which an error stays within a tolerance: a scan, refined where it leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from continuair.typing import Array


@dataclass(frozen=True)
class Limit:
    """Limit of an error, with all places and errors (n,) that were computed.

    last: the last place before the first error beyond the tolerance; NaN if the first one is
    beyond, inf if none is.
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
    """Return, by name, where errors (n,) over places (n,) above 0 first exceed a tolerance.

    finer: returns the errors of one name at `count` more places, between the last within and the
    first beyond. NaN counts as beyond.
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
    """Return the index of the first error beyond the tolerance, or the number of errors."""
    within = errors <= tolerance
    return len(within) if within.all() else int(np.argmin(within))
