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
    if not len(apart):
        return continuous_euler(attitude)
    # Of the largest spin and interval: more parts than needed do no harm.
    x, y, z = np.moveaxis(spin, -1, 0)
    fastest = np.sqrt(np.fmax.reduce(x * x + y * y + z * z, axis=1, initial=0.0))
    turned = fastest * apart.max()
    parts = np.clip(np.ceil(turned / FOLLOWED), 1, _MOST).astype(int)
    if (parts == 1).all():
        return continuous_euler(attitude)
    found = np.empty((*attitude.shape[:-1], 3))
    for each in np.unique(parts):
        runs = parts == each
        found[runs] = _followed(attitude[runs], spin[runs], apart, int(each))
    return found


def in_body_axes(vectors: Array, attitude: Array) -> Array:
    """Vectors (..., 3) in world axes, turned back by attitudes (..., 4); NaN stays."""
    x, y, z, w = _columns(attitude)
    size = np.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / size, y / size, z / size, w / size
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    xy, xz, yz, xw, yw, zw = x * y, x * z, y * z, x * w, y * w, z * w
    a, b, c = _columns(vectors)
    turned = np.empty(vectors.shape)
    turned[..., 0] = (xx - yy - zz + ww) * a + 2.0 * (xy + zw) * b + 2.0 * (xz - yw) * c
    turned[..., 1] = 2.0 * (xy - zw) * a + (-xx + yy - zz + ww) * b + 2.0 * (yz + xw) * c
    turned[..., 2] = 2.0 * (xz + yw) * a + 2.0 * (yz - xw) * b + (-xx - yy + zz + ww) * c
    return turned


def _columns(rows: Array) -> Array:
    """The columns of rows (..., n) each by itself, which is faster to compute with."""
    return np.array(np.moveaxis(rows, -1, 0), float, order="C")


def _followed(attitude: Array, spin: Array, apart: Array, parts: int) -> Array:
    """The angles with every interval between samples in parts, which the spin turns through."""
    filled = np.empty((len(attitude), len(apart) * parts + 1, 4))
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
