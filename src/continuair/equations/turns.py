"""Rotation matrices of angles, which may be complex, and of quaternions."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np

from continuair.typing import ArrayLike

Array: TypeAlias = np.ndarray
"""Numbers: float64, or complex128 where the arguments are complex."""

Angle: TypeAlias = complex | Array
"""A number or numbers, real or complex."""

TipFrame: TypeAlias = Literal["untwisted", "frenet"]
"""Convention of a section's frames."""


def about_x(angle: Angle) -> Array:
    """Return rotations (..., 3, 3) by angles (...) [rad] about x."""
    s, c, nil, one = _turn(angle)
    return by_rows([one, nil, nil], [nil, c, -s], [nil, s, c])


def about_y(angle: Angle) -> Array:
    """Return rotations (..., 3, 3) by angles (...) [rad] about y."""
    s, c, nil, one = _turn(angle)
    return by_rows([c, nil, s], [nil, one, nil], [-s, nil, c])


def about_z(angle: Angle) -> Array:
    """Return rotations (..., 3, 3) by angles (...) [rad] about z."""
    s, c, nil, one = _turn(angle)
    return by_rows([c, -s, nil], [s, c, nil], [nil, nil, one])


def of_quaternion(quaternion: ArrayLike) -> Array:
    """Return rotations (..., 3, 3) of quaternions (..., 4), x y z w, of any length above 0."""
    given = np.asarray(quaternion, float)
    x, y, z, w = np.moveaxis(given / np.linalg.norm(given, axis=-1, keepdims=True), -1, 0)
    return by_rows(
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    )


def euler_angles(rotation: ArrayLike) -> Array:
    """Return the ZYX Euler angles of rotation matrices.

    Parameters
    ----------
    rotation : array_like (..., 3, 3)
        Rotation matrices, R = R_z(ψ) R_y(θ) R_x(φ).

    Returns
    -------
    array (..., 3)
        Angles φ, θ, ψ [rad], with θ within ±π/2. At θ = ±π/2 roll and yaw are not unique; one
        solution is returned.
    """
    R = np.asarray(rotation, float)
    roll = np.arctan2(R[..., 2, 1], R[..., 2, 2])
    pitch = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 2, 1], R[..., 2, 2]))
    # R R_x(-φ) = R_z R_y, whose second column is (-sin ψ, cos ψ, 0) whatever the pitch.
    across = np.cos(roll)[..., None] * R[..., 1] - np.sin(roll)[..., None] * R[..., 2]
    # A sum with 0 makes 0 of -0.
    return 0.0 + np.stack([roll, pitch, np.arctan2(-across[..., 0], across[..., 1])], axis=-1)


def by_rows(*rows: list[Array]) -> Array:
    """Return matrices (..., 3, 3) from rows of entries (...)."""
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _turn(angle: Angle) -> tuple[Any, Any, Any, Any]:
    nil = 0.0 * angle
    return np.sin(angle), np.cos(angle), nil, 1.0 + nil
