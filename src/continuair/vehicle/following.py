"""Check whether samples of an attitude are dense enough to follow its Euler angles."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.vehicle.coordinates import continuous_euler

Array = np.ndarray

CHANGE = 1.0
"""Largest change of an angle from sample to sample at which it can be followed [rad]."""

SHARE = 0.1
"""Bound of sin²(Δ/2) / cos²θ, Δ the rotation between samples, below which no angle changes by more
than CHANGE, whatever the axis of the rotation."""

_THROUGH = 1e-6
"""Distance from pitch ±π/2 below which a rotation passes through it, up to rounding in float32
[rad]. A rotation that passes beside it keeps its triple, and changes roll and yaw by π."""


def unfollowed(attitude: Array) -> Array:
    """Return the intervals (runs, samples - 1) over which Euler angles cannot be followed.

    attitude: (runs, samples, 4). In such an interval an angle of the nearest triple changes by more
    than CHANGE, or the triple changes although the rotation passes beside pitch ±π/2. Intervals
    with NaN are not reported.
    """
    x, y, z, w = np.moveaxis(attitude, -1, 0)
    level = 1.0 - 4.0 * (w * y - x * z) ** 2
    cosine = np.einsum("ijk,ijk->ij", attitude[:, :-1], attitude[:, 1:])
    found = 1.0 - cosine**2 > SHARE * np.minimum(level[:, :-1], level[:, 1:])
    found[found] = _lost(attitude[:, :-1][found], attitude[:, 1:][found])
    return found


def _lost(before: Array, after: Array) -> Array:
    """Return the same for pairs of samples (n, 4)."""
    angles = continuous_euler(np.stack([before, after], axis=1))
    lost: Array = np.asarray((np.abs(angles[:, 1] - angles[:, 0]) > CHANGE).any(-1))
    changed = np.flatnonzero(~lost & (np.abs(angles[:, 1, 1]) > 0.5 * np.pi))
    if len(changed):
        lost[changed] = _beside(before[changed], after[changed]) > _THROUGH
    return lost


def _beside(before: Array, after: Array) -> Array:
    """Return the distance (n,) from the vertical at which x axes pass between attitudes [rad]."""
    first, last = Rotation.from_quat(before), Rotation.from_quat(after)
    axis = (last * first.inv()).as_rotvec()
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    ahead = first.apply([1.0, 0.0, 0.0])
    pole = np.zeros(ahead.shape)
    pole[:, 2] = np.sign(ahead[:, 2] + last.apply([1.0, 0.0, 0.0])[:, 2])
    return np.asarray(np.abs(((ahead - pole) * axis).sum(-1)))
