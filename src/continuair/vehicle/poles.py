"""ZYX Euler angles near pitch ±π/2, where roll and yaw rotate about the same axis."""

from __future__ import annotations

import numpy as np

Array = np.ndarray

POLE = 1e-9
"""|cos θ| below which roll and yaw cannot be separated: any split describes the attitude, and their
rates keep no significant digits."""

_NEAR = 1e-3
"""Distance from pitch ±π/2 within which the usual formulas lose digits, more so for a quaternion
whose norm is not exactly 1 [rad]."""


def mend_near_poles(angles: Array, attitude: Array) -> None:
    """Replace angles (runs, samples, 3) near pitch ±π/2 by precise ones, in place.

    attitude: (runs, samples, 4). At the pole the roll is that of the previous sample off the pole,
    else that of the first one, else 0. The yaw is the remainder.
    """
    near = np.abs(angles[..., 1]) > 0.5 * np.pi - _NEAR
    runs = np.flatnonzero(near.any(axis=1))
    if not len(runs):
        return
    some, near = angles[runs], near[runs]
    precise, apart = _precise(attitude[runs][near])
    some[near] = precise
    free = np.zeros(near.shape, bool)
    free[near] = apart < POLE
    some[free] = with_roll(some[free], _roll_beside(some[..., 0], free))
    angles[runs] = some


def with_roll(angles: Array, roll: Array) -> Array:
    """Return triples (..., 3) of the same attitudes at pitch ±π/2 with another roll (...)."""
    up = np.sign(angles[..., 1])
    yaw = angles[..., 2] + up * (roll - angles[..., 0])
    yaw = yaw - 2.0 * np.pi * np.round(yaw / (2.0 * np.pi))
    return np.stack([roll, angles[..., 1], yaw], -1)


def _precise(attitude: Array) -> tuple[Array, Array]:
    """Return angles (n, 3), from half sums and differences of roll and yaw, and cos θ (n,).

    At a pole only one of sum and difference is ill-conditioned, the one that is arbitrary there.
    """
    x, y, z, w = np.moveaxis(attitude, -1, 0)
    less, more = np.arctan2(x - z, w + y), np.arctan2(x + z, w - y)
    far, close = np.hypot(x - z, w + y), np.hypot(x + z, w - y)
    pitch = 2.0 * np.arctan2(far, close) - 0.5 * np.pi
    angles = np.stack([more + less, pitch, more - less], -1)
    angles[:, ::2] -= 2.0 * np.pi * np.round(angles[:, ::2] / (2.0 * np.pi))
    return angles, far * close / (x * x + y * y + z * z + w * w)


def _roll_beside(roll: Array, free: Array) -> Array:
    """Return for each free sample of (runs, samples) the roll of the last, or first, other one."""
    at = np.where(free, 0, np.arange(free.shape[1]))
    at = np.maximum(np.maximum.accumulate(at, axis=1), np.argmin(free, axis=1)[:, None])
    held = np.take_along_axis(roll, at, axis=1)
    held[free.all(axis=1)] = 0.0
    return np.asarray(held[free])
