"""Our axes and those of aviation: north-east-down (NED) for the world, front-right-down for bodies.

Ours are x forward, y left, z up for a body, and with x to the north y is west in the world. A half
turn about x leads from each to the other, and back.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown

Array = np.ndarray

_SIGNS = np.array([1.0, -1.0, -1.0])


def to_ned(vectors: Any) -> Array:
    """Return vectors in world axes, (..., 3), or wrenches (..., 6), in NED.

    They may be positions, velocities or forces; units stay. Raises InputError for another shape.
    """
    return _turned("vectors", vectors)


def from_ned(vectors: Any) -> Array:
    """Return vectors or wrenches in world axes from NED, the inverse of `to_ned`."""
    return _turned("vectors", vectors)


def to_frd(vectors: Any) -> Array:
    """Return vectors in body axes, (..., 3), or wrenches (..., 6), in FRD.

    They may be angular rates, moments or forces; units stay. Raises InputError for another shape.
    """
    return _turned("vectors", vectors)


def from_frd(vectors: Any) -> Array:
    """Return vectors or wrenches in body axes from FRD, the inverse of `to_frd`."""
    return _turned("vectors", vectors)


def attitude_to_ned(attitude: Any, *, scalar_first: bool = False) -> Array:
    """Return attitudes FRD to NED of attitudes body to world, (..., 4) x y z w.

    scalar_first: returns w x y z, as PX4 has it. Raises InputError for another shape.
    """
    x, y, z, w = _quaternions(attitude)
    return np.stack([w, x, -y, -z] if scalar_first else [x, -y, -z, w], axis=-1)


def attitude_from_ned(attitude: Any, *, scalar_first: bool = False) -> Array:
    """Return attitudes body to world, (..., 4) x y z w, of attitudes FRD to NED.

    scalar_first: those given are w x y z. Raises InputError for another shape.
    """
    a, b, c, d = _quaternions(attitude)
    x, y, z, w = (b, c, d, a) if scalar_first else (a, b, c, d)
    return np.stack([x, -y, -z, w], axis=-1)


def _turned(name: str, vectors: Any) -> Array:
    found = _numbers(name, vectors, (3, 6))
    return found * np.resize(_SIGNS, found.shape[-1])


def _quaternions(attitude: Any) -> Array:
    return np.moveaxis(_numbers("attitude", attitude, (4,)), -1, 0)


def _numbers(name: str, value: Any, widths: tuple[int, ...]) -> Array:
    """Return numbers, NaN among them as after the end of a flight, with a last axis of a width."""
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.ndim == 0 or found.shape[-1] not in widths or not checks.means_numbers(value):
        wanted = " or ".join(map(str, widths))
        raise InputError(
            name,
            f"is {shown(value)}",
            f"give rows of {wanted} numbers, none of them masked, a truth value or with a unit",
        )
    return found
