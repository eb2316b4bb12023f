"""Largest and least of what flights give: none where one of them gives none.

Python's own pass over a NaN, or stop at it, by its place: of flights that ended early they would
tell of the others alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np


def largest(values: Iterable[float]) -> float:
    """Return the largest of values; NaN where one is."""
    return float(np.max(list(values)))


def least(values: Iterable[float]) -> float:
    """Return the least of values; NaN where one is."""
    return float(np.min(list(values)))


def largest_of(found: Mapping[str, float]) -> str:
    """Return the name of the largest value; of the first that is NaN, if there is one."""
    return list(found)[int(np.argmax(list(found.values())))]
