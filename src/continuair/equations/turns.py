"""Rotation matrices of angles, which may be complex, and of quaternions."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]


def about_x(angle: Any) -> Array:
    """(..., 3, 3) of angles (...) [rad] about x."""
    s, c, nil, one = _turn(angle)
    return by_rows([one, nil, nil], [nil, c, -s], [nil, s, c])


def about_y(angle: Any) -> Array:
    """(..., 3, 3) of angles (...) [rad] about y."""
    s, c, nil, one = _turn(angle)
    return by_rows([c, nil, s], [nil, one, nil], [-s, nil, c])


def about_z(angle: Any) -> Array:
    """(..., 3, 3) of angles (...) [rad] about z."""
    s, c, nil, one = _turn(angle)
    return by_rows([c, -s, nil], [s, c, nil], [nil, nil, one])


def of_quaternion(quaternion: Any) -> Array:
    """(..., 3, 3) of quaternions (..., 4), x y z w, of any length above 0."""
    given = np.asarray(quaternion, float)
    x, y, z, w = np.moveaxis(given / np.linalg.norm(given, axis=-1, keepdims=True), -1, 0)
    return by_rows(
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    )


def by_rows(*rows: list[Any]) -> Array:
    """Matrices (..., 3, 3) of rows of entries (...)."""
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _turn(angle: Any) -> tuple[Any, Any, Any, Any]:
    nil = 0.0 * angle
    return np.sin(angle), np.cos(angle), nil, 1.0 + nil
