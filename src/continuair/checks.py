"""Arguments of the library, validated once at the border: a sentence that names what to give."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.errors import InputError, shown

Array = NDArray[np.float64]


def is_number(value: object) -> bool:
    """Tell whether a value is one finite number; an array or a truth value is none."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def finite_array(value: object) -> Array | None:
    """Return finite numbers as a new array, and None for anything else."""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        return None
    if given.dtype.kind not in "iuf" or not np.isfinite(given).all():
        return None
    return np.array(given, dtype=np.float64)


def positive(name: str, value: Any, otherwise: str = "") -> float:
    """Return a finite number above 0; `otherwise` tells what else may be given."""
    if not is_number(value) or not value > 0:
        raise InputError(f"{name} is {shown(value)}; give a finite number above 0{otherwise}.")
    return float(value)


def gravity(value: Any) -> float:
    """Return the magnitude of gravity [m/s²]."""
    if not is_number(value) or value < 0:
        problem = f"gravity is {shown(value)}, but must be a finite number, 0 or more"
        raise InputError(f"{problem}; give its magnitude [m/s²].")
    return float(value)


def choice(name: str, value: Any, valid: Sequence[str]) -> str:
    """Return a name that must be one of the valid ones."""
    if not isinstance(value, str) or value not in valid:
        raise InputError(f"{name} is {shown(value)}; use one of {', '.join(valid)}.")
    return value


def row(name: str, value: Any, width: int) -> Array:
    """Return `width` numbers, or one number for all of them, as an array (width,)."""
    found = finite_array(value)
    if found is None or found.shape not in ((), (width,)):
        numbers = "a finite number" if width == 1 else f"{width} finite numbers"
        raise InputError(f"{name} is {shown(value)}; give {numbers}.")
    return np.broadcast_to(found, width).copy()


def rows(name: str, value: Any, width: int) -> Array:
    """Return (n, width) numbers from n rows, one row, or one number for a whole row."""
    found = finite_array(value)
    if found is not None and found.ndim == 0:
        found = np.full(width, found)
    if found is None or found.ndim > 2 or found.shape[-1] != width or not found.size:
        raise InputError(
            f"{name} is {shown(value)}; give {width} finite numbers, or one or more rows of them."
        )
    return np.atleast_2d(found)


def whole(name: str, value: Any, least: int = 1) -> int:
    """Return a whole number of at least `least`."""
    number = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not number or value < least:
        raise InputError(f"{name} is {shown(value)}; give a whole number, {least} or more.")
    return int(value)
