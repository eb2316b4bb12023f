"""ZYX Euler angles near pitch ±π/2, where roll and yaw turn about the same axis."""

from __future__ import annotations

import numpy as np

Array = np.ndarray

POLE = 1e-9
"""|cos θ| below which roll and yaw are not told apart: there any split of them describes the
attitude, and their rates keep no digits."""

_NEAR = 1e-3
"""Distance from pitch ±π/2 within which the usual formulas lose digits, more of a quaternion that
is not quite of length 1 [rad]."""


def mend_near_poles(angles: Array, attitude: Array) -> None:
    """Put precise angles (runs, samples, 3) in place near pitch ±π/2; attitude: (..., 4).

    At the pole itself the roll is that of the sample before, or of the first one beside it, or 0,
    and the yaw what remains.
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
    """The triples (..., 3) of the same attitudes at pitch ±π/2 with another roll (...)."""
    up = np.sign(angles[..., 1])
    yaw = angles[..., 2] + up * (roll - angles[..., 0])
    yaw = yaw - 2.0 * np.pi * np.round(yaw / (2.0 * np.pi))
    return np.stack([roll, angles[..., 1], yaw], -1)


def _precise(attitude: Array) -> tuple[Array, Array]:
    """Angles (n, 3) by half sums and differences of roll and yaw, and cos θ (n,).

    Of the two, only the one that a pole leaves free is ill-conditioned there.
    """
    x, y, z, w = np.moveaxis(attitude, -1, 0)
    less, more = np.arctan2(x - z, w + y), np.arctan2(x + z, w - y)
    far, close = np.hypot(x - z, w + y), np.hypot(x + z, w - y)
    pitch = 2.0 * np.arctan2(far, close) - 0.5 * np.pi
    angles = np.stack([more + less, pitch, more - less], -1)
    angles[:, ::2] -= 2.0 * np.pi * np.round(angles[:, ::2] / (2.0 * np.pi))
    return angles, far * close / (x * x + y * y + z * z + w * w)


def _roll_beside(roll: Array, free: Array) -> Array:
    """For each free sample of (runs, samples), the roll of the last that is not, or the first."""
    at = np.where(free, 0, np.arange(free.shape[1]))
    at = np.maximum(np.maximum.accumulate(at, axis=1), np.argmin(free, axis=1)[:, None])
    held = np.take_along_axis(roll, at, axis=1)
    held[free.all(axis=1)] = 0.0
    return np.asarray(held[free])
