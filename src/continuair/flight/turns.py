"""Euler angles along samples that the vehicle turns between: its spin says how often."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.vehicle.coordinates import continuous_euler
from continuair.vehicle.following import CHANGE, SHARE, unfollowed

Array = np.ndarray

FOLLOWED = 0.5
"""Angle between attitudes up to which the nearest Euler angles are the next ones [rad]."""

_MOST = 1000
_NO_DIGITS = 1e15


def followed_euler(attitude: Array, spin: Array, times: Array) -> tuple[Array, float]:
    """ZYX Euler angles (runs, samples, 3) without jumps, whole turns between samples included.

    attitude: (runs, samples, 4); spin: angular velocity (runs, samples, 3) in body axes [rad/s];
    times: (samples,) [s]. Between samples the vehicle is taken to turn at the spin of the nearer
    one. Also returns the first of the times between which that loses the angles, or inf.
    """
    apart = np.diff(times)
    if not len(apart):
        return continuous_euler(attitude), np.inf
    # Of the largest spin and interval: more parts than needed do no harm.
    x, y, z = np.moveaxis(spin, -1, 0)
    with np.errstate(over="ignore"):
        fastest = np.sqrt(np.fmax.reduce(x * x + y * y + z * z, axis=1, initial=0.0))
    turned = fastest * apart.max()
    parts = np.clip(np.ceil(turned / FOLLOWED), 1, _MOST).astype(int)
    if (parts == 1).all():
        found = continuous_euler(attitude)
        return found, _lost_from(attitude, found, turned, times, 1)
    found, lost = np.empty((*attitude.shape[:-1], 3)), np.inf
    for each in np.unique(parts):
        runs = parts == each
        filled = _filled(attitude[runs], spin[runs], apart, int(each))
        angles = continuous_euler(filled)
        found[runs] = angles[:, ::each]
        lost = min(lost, _lost_from(filled, angles, turned[runs], times, int(each)))
    return found, lost


def _lost_from(attitude: Array, angles: Array, turned: Array, times: Array, parts: int) -> float:
    """The first of the times (samples,) after which angles are lost, or inf.

    attitude, angles: of every part of the intervals between samples; turned: most that each run
    turns by in one (runs,) [rad].
    """
    level = 0.5 * np.pi - np.fmax.reduce(np.abs(angles[..., 1]), axis=1, initial=0.0)
    near = turned > parts * SHARE * level
    if not near.any():
        return np.inf
    attitude, angles = attitude[near], angles[near, ::parts]
    lost = unfollowed(attitude).reshape(len(angles), -1, parts).any(-1)
    if parts > 1:
        # A spin that changes within an interval misleads, but the samples alone may agree with it.
        turns = (np.abs(np.diff(angles, axis=1)) > CHANGE).any(-1)
        lost &= turns | unfollowed(attitude[:, ::parts])
    lost = lost.any(axis=0)
    return float(times[np.argmax(lost)]) if lost.any() else np.inf


def on_triple(euler: Array, roll: Array) -> Array:
    """Euler angles (runs, samples, 3) on the triple of a roll (runs, samples), within a turn.

    Each attitude has two, (φ, θ, ψ) and (φ + π, π - θ, ψ + π), of which a flight follows one from
    its start on, step by step; near a quarter turn of pitch samples alone may take the other.
    """
    other = np.cos(euler[..., 0] - roll) < 0.0
    runs = other.any(axis=1)
    if runs.any():
        # The others keep their bits.
        euler[runs] = _changed(euler[runs], other[runs])
    return euler


def _changed(euler: Array, other: Array) -> Array:
    """Euler angles (runs, samples, 3) on the other triple where that is told, without jumps."""
    steps = np.diff(euler, axis=1)
    changed = other[:, 1:] != other[:, :-1]
    start = euler[:, :1].copy()
    start[other[:, 0]] += np.array([np.pi, 0.0, np.pi])
    start[..., ::2] -= 2.0 * np.pi * np.round(start[..., ::2] / (2.0 * np.pi))
    for angle in (0, 2):
        steps[changed, angle] -= np.copysign(np.pi, steps[changed, angle])
    found = np.concatenate([start, start + np.cumsum(steps, axis=1)], axis=1)
    found[..., 1] = np.unwrap(np.where(other, np.pi - euler[..., 1], euler[..., 1]), axis=1)
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


def _filled(attitude: Array, spin: Array, apart: Array, parts: int) -> Array:
    """The attitudes with every interval between samples in parts, which the spin turns through."""
    filled = np.empty((len(attitude), len(apart) * parts + 1, 4))
    filled[:, ::parts] = attitude
    for part in range(1, parts):
        nearer = slice(None, -1) if 2 * part <= parts else slice(1, None)
        time = apart * (part / parts if 2 * part <= parts else part / parts - 1.0)
        filled[:, part::parts] = _turned(attitude[:, nearer], spin[:, nearer] * time[:, None])
    return filled


def _turned(attitude: Array, angle: Array) -> Array:
    """Attitudes (..., 4) turned by rotation vectors (..., 3) in body axes; NaN stays."""
    found = np.full(attitude.shape, np.nan)
    # A larger angle has no digits left that tell where it ends.
    valid = np.isfinite(attitude).all(-1) & (np.abs(angle) < _NO_DIGITS).all(-1)
    turn = Rotation.from_rotvec(angle[valid])
    found[valid] = (Rotation.from_quat(attitude[valid]) * turn).as_quat()
    return found
