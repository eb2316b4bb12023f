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


def euler_angles(rotation: Any) -> Array:
    """φ, θ, ψ (..., 3) [rad] of matrices (..., 3, 3), R = R_z(ψ) R_y(θ) R_x(φ), θ within ±π/2.

    Upright, where roll and yaw are one turn, they are any two that make it.
    """
    R = np.asarray(rotation, float)
    roll = np.arctan2(R[..., 2, 1], R[..., 2, 2])
    pitch = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 2, 1], R[..., 2, 2]))
    # R R_x(-φ) = R_z R_y, whose second column is (-sin ψ, cos ψ, 0) whatever the pitch.
    across = np.cos(roll)[..., None] * R[..., 1] - np.sin(roll)[..., None] * R[..., 2]
    # A sum with 0 makes 0 of -0.
    return 0.0 + np.stack([roll, pitch, np.arctan2(-across[..., 0], across[..., 1])], axis=-1)


def by_rows(*rows: list[Any]) -> Array:
    """Matrices (..., 3, 3) of rows of entries (...)."""
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _turn(angle: Any) -> tuple[Any, Any, Any, Any]:
    nil = 0.0 * angle
    return np.sin(angle), np.cos(angle), nil, 1.0 + nil
