"""Euler angles along samples that the vehicle turns between: its spin says how often."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.vehicle.coordinates import continuous_euler

Array = np.ndarray

FOLLOWED = 0.5
"""Angle between attitudes up to which the nearest Euler angles are the next ones [rad]."""

_MOST = 1000


def followed_euler(attitude: Array, spin: Array, times: Array) -> Array:
    """ZYX Euler angles (runs, samples, 3) without jumps, whole turns between samples included.

    attitude: (runs, samples, 4); spin: angular velocity (runs, samples, 3) in body axes [rad/s];
    times: (samples,) [s]. Between samples the vehicle is taken to turn at the spin of the nearer
    one.
    """
    apart = np.diff(times)
    turned = np.linalg.norm(spin, axis=-1)[:, :-1] * apart
    if not len(apart):
        return continuous_euler(attitude)
    parts = int(np.clip(np.ceil(np.nanmax(turned, initial=0.0) / FOLLOWED), 1, _MOST))
    if parts == 1:
        return continuous_euler(attitude)
    filled = np.full((len(attitude), len(apart) * parts + 1, 4), np.nan)
    filled[:, ::parts] = attitude
    for part in range(1, parts):
        nearer = slice(None, -1) if 2 * part <= parts else slice(1, None)
        time = apart * (part / parts if 2 * part <= parts else part / parts - 1.0)
        filled[:, part::parts] = _turned(attitude[:, nearer], spin[:, nearer] * time[:, None])
    return continuous_euler(filled)[:, ::parts]


def _turned(attitude: Array, angle: Array) -> Array:
    """Attitudes (..., 4) turned by rotation vectors (..., 3) in body axes; NaN stays."""
    found = np.full(attitude.shape, np.nan)
    valid = np.isfinite(attitude).all(-1) & np.isfinite(angle).all(-1)
    turn = Rotation.from_rotvec(angle[valid])
    found[valid] = (Rotation.from_quat(attitude[valid]) * turn).as_quat()
    return found
