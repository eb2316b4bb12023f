"""The stable balance that lies downhill from rest, of forces that come from a potential."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from continuair.vehicle.arc import COORDINATES, bend_vectors

Slope = Callable[[np.ndarray], np.ndarray]

_STEPS = 500
_DIFFERENCE, _LONGEST, _PUSH, _BALANCED = 1e-5, 0.1, 1e-2, 1e-10
"""Of central differences, of a step, of what tips a balance over, and of a slope that is none, in
shares of the largest coordinates."""
_FLATTEST = 1e-3
"""Least curvature that a step reckons with; that of the springs is 1."""
_NEUTRAL = 1e-6
"""Curvature, of springs of 1, that is none, as around the balances of an arm that buckles upright:
it may fall to any side."""
_FALLS = 0.9
"""Share of a step's first slope that its last may have, with the other sign: not uphill again."""


def balance(slope: Slope, largest: np.ndarray) -> np.ndarray | None:
    """Where pairs of coordinates (2 n,) come to rest downhill from 0, or None.

    slope: those (m, 2 n) of the potential at places (m, 2 n), springs of 1 among it; largest: what
    the lengths of the pairs (n,) stay below. From a balance that is not stable, as of an arm that
    stands upright, it goes on to both sides, where it falls most; the nearer to 0 counts.
    """
    size = COORDINATES * len(largest)
    ways = [np.zeros(size)]
    for _ in range(1 + size):
        ends = [end for way in ways if (end := _downhill(slope, way, largest)) is not None]
        for end in sorted(ends, key=lambda end: np.round(np.linalg.norm(end / largest.max()), 6)):
            curvatures, axes = np.linalg.eigh(_curvature(slope, end, largest))
            if curvatures[0] > -_NEUTRAL:
                return end
            tip_over = _PUSH * largest.min() * _steepest(curvatures, axes)
            ways = [end + tip_over, end - tip_over]
    return None


def _steepest(curvatures: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """The axis (2 n,) of the least curvature: of equal ones, what the first coordinate has most of
    them, as their own axes are of any direction."""
    least = axes[:, curvatures < curvatures[0] + _NEUTRAL]
    shares = least @ least.T
    axis = shares[np.argmax(np.round(np.diag(shares), 6))]
    return np.asarray(axis / np.linalg.norm(axis))


def _downhill(slope: Slope, x: np.ndarray, largest: np.ndarray) -> np.ndarray | None:
    """Where there is no slope, downhill from x by Newton's steps with curvatures taken positive,
    which lead to no saddle but from its ridge; or None."""
    for _ in range(_STEPS):
        (steep,) = slope(x[None])
        curvatures, axes = np.linalg.eigh(_curvature(slope, x, largest))
        step = -axes @ (axes.T @ steep / np.maximum(np.abs(curvatures), _FLATTEST))
        if np.abs(steep).max() < _BALANCED * largest.min():
            # The last digits.
            return np.asarray(x + step)
        step *= min(1.0, _LONGEST * float(np.min(largest / np.maximum(_sizes(step), 1e-300))))
        while not _leads_down(slope, x, step, steep, largest):
            step = step / 2.0
            if np.abs(step).max() < _BALANCED * largest.min():
                return None
        x = x + step
    return None


def _leads_down(
    slope: Slope, x: np.ndarray, step: np.ndarray, steep: np.ndarray, largest: np.ndarray
) -> bool:
    """Whether a step stays inside, and is not too long by the slope at its end."""
    if not (_sizes(x + step) < largest).all():
        return False
    (after,) = slope((x + step)[None])
    return bool(after @ step <= -_FALLS * (steep @ step))


def _curvature(slope: Slope, x: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """The symmetric part of the slopes' slopes (2 n, 2 n)."""
    h = _DIFFERENCE * np.repeat(largest, COORDINATES)
    aside = np.diag(h)
    ahead, behind = np.split(slope(np.vstack([x + aside, x - aside])), 2)
    found = (ahead - behind) / (2.0 * h[:, None])
    return np.asarray((found + found.T) / 2.0)


def _sizes(x: np.ndarray) -> np.ndarray:
    """Lengths (n,) of pairs."""
    return np.asarray(np.linalg.norm(bend_vectors(x), axis=-1))
