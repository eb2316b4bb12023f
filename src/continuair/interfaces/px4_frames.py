"""From PX4's axes to ours: NED world to east, north, up; FRD body to forward, left, up."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

Array = np.ndarray

_TO_ENU = Rotation.from_matrix([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
_TO_FLU = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))


def from_ned(vectors: Array) -> Array:
    """Vectors (n, 3) in NED axes, in east, north, up."""
    return np.asarray(vectors[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0]))


def from_frd(vectors: Array) -> Array:
    """Vectors (n, 3) in FRD axes, in forward, left, up."""
    return np.asarray(vectors * np.array([1.0, -1.0, -1.0]))


def attitude_from_px4(quaternions: Array) -> Array:
    """FRD to NED, (n, 4) with the scalar first, as body to world in our axes, x y z w."""
    turned = _TO_ENU * Rotation.from_quat(quaternions, scalar_first=True) * _TO_FLU
    return np.asarray(turned.as_quat())
