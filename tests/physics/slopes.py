"""Slopes along logged samples."""

import numpy as np
from scipy.spatial.transform import Rotation

_WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
INSIDE = slice(4, -4)
"""The samples that have a slope."""


def slope(values: np.ndarray, interval: float) -> np.ndarray:
    """d/dt of values (samples, ...) at the samples INSIDE.

    Central differences: for a vibration of ω they err by (ω interval)⁸/630, and roundings of the
    values count 2/interval times.
    """
    windows = np.lib.stride_tricks.sliding_window_view(values, len(_WEIGHTS), axis=0)
    return np.asarray(windows @ _WEIGHTS / interval)


def matrices(quaternions: np.ndarray) -> np.ndarray:
    """Rotation matrices (samples, 3, 3)."""
    return np.asarray(Rotation.from_quat(quaternions).as_matrix())


def spin(quaternions: np.ndarray, interval: float) -> np.ndarray:
    """Angular velocity in world axes at the samples INSIDE: the vector of Ṙ Rᵀ."""
    R = matrices(quaternions)
    turning = slope(R, interval) @ np.swapaxes(R[INSIDE], 1, 2)
    skew = 0.5 * (turning - np.swapaxes(turning, 1, 2))
    return np.column_stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]])
