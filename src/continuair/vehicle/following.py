"""Whether samples of an attitude follow its Euler angles from one to the next."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.vehicle.coordinates import continuous_euler

Array = np.ndarray

CHANGE = 1.0
"""Change of an angle from sample to sample up to which it is followed [rad]."""

SHARE = 0.1
"""sin²(Δ/2) of the turn Δ between samples, as a share of cos²θ, up to which no angle changes by
more than CHANGE, whichever way the attitude turned."""

_THROUGH = 1e-6
"""Distance from pitch ±π/2 that rounding, of float32 too, leaves of a turn right through it; a turn
that passes beside it keeps its triple, and swings roll and yaw by half a turn [rad]."""


def unfollowed(attitude: Array) -> Array:
    """Which intervals (runs, samples - 1) between samples (runs, samples, 4) lose the angles.

    On the triple nearest to the sample before, an angle changes by more than CHANGE; or the samples
    change triple, but pass pitch ±π/2 on one side. Those that hold a NaN lose nothing.
    """
    x, y, z, w = np.moveaxis(attitude, -1, 0)
    level = 1.0 - 4.0 * (w * y - x * z) ** 2
    cosine = np.einsum("ijk,ijk->ij", attitude[:, :-1], attitude[:, 1:])
    found = 1.0 - cosine**2 > SHARE * np.minimum(level[:, :-1], level[:, 1:])
    found[found] = _lost(attitude[:, :-1][found], attitude[:, 1:][found])
    return found


def _lost(before: Array, after: Array) -> Array:
    """As `unfollowed`, of pairs of samples (n, 4) each."""
    angles = continuous_euler(np.stack([before, after], axis=1))
    lost = (np.abs(angles[:, 1] - angles[:, 0]) > CHANGE).any(-1)
    changed = np.flatnonzero(~lost & (np.abs(angles[:, 1, 1]) > 0.5 * np.pi))
    if len(changed):
        lost[changed] = _beside(before[changed], after[changed]) > _THROUGH
    return np.asarray(lost)


def _beside(before: Array, after: Array) -> Array:
    """How far (n,) from the vertical the x axes of turns between attitudes (n, 4) pass [rad]."""
    first, last = Rotation.from_quat(before), Rotation.from_quat(after)
    axis = (last * first.inv()).as_rotvec()
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    ahead = first.apply([1.0, 0.0, 0.0])
    pole = np.zeros(ahead.shape)
    pole[:, 2] = np.sign(ahead[:, 2] + last.apply([1.0, 0.0, 0.0])[:, 2])
    return np.asarray(np.abs(((ahead - pole) * axis).sum(-1)))
