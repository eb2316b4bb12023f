"""Largest and least values of flights: NaN if any of them is NaN.

Python's own functions skip a NaN or stop at it, by its position. With flights that ended early they
would describe the others alone.
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
