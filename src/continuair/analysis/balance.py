"""Stable equilibrium reached downhill from the origin, for forces that have a potential."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from continuair.typing import Array

Slope = Callable[[Array], Array]
Shares = Callable[[Array], Array]

_STEPS = 500
_DIFFERENCE, _LONGEST, _PUSH, _BALANCED = 1e-5, 0.1, 1e-2, 1e-10
"""Central difference, longest step, perturbation of an unstable equilibrium, and zero gradient, as
fractions of the largest coordinates."""
_FLATTEST = 1e-3
"""Least curvature used in a Newton step; that of the springs is 1."""
_NEUTRAL = 1e-6
"""Curvature that counts as zero, for springs of 1: an upright arm that buckles may fall to any
side."""
_FALLS = 0.9
"""Largest slope at the end of a step, as a fraction of the first slope, with the opposite sign."""


def balance(slope: Slope, largest: Array, shares: Shares) -> Array | None:
    """Return the equilibrium (n,) reached downhill from 0, or None.

    slope: gradients (m, n) of the potential at places (m, n), springs of stiffness 1 included;
    largest: upper limit (n,) of each coordinate alone; shares: of what is admissible, which a place
    uses, each below 1. An unstable equilibrium, such
    as an upright arm, is left to both sides along its most unstable axis; of the two equilibria,
    the one nearer to 0 is returned.
    """
    size = len(largest)
    ways = [np.zeros(size)]
    for _ in range(1 + size):
        ends = [end for way in ways if (end := _downhill(slope, way, largest, shares)) is not None]
        for end in sorted(ends, key=lambda end: np.round(np.linalg.norm(end / largest.max()), 6)):
            curvatures, axes = np.linalg.eigh(curvature(slope, end, largest))
            if curvatures[0] > -_NEUTRAL:
                return end
            tip_over = _PUSH * largest.min() * _steepest(curvatures, axes)
            ways = [end + tip_over, end - tip_over]
    return None


def _steepest(curvatures: Array, axes: Array) -> Array:
    """Return the axis (n,) of least curvature.

    Of equal curvatures, whose axes are arbitrary, the axis that the first coordinate has most of.
    """
    least = axes[:, curvatures < curvatures[0] + _NEUTRAL]
    shares = least @ least.T
    axis = shares[np.argmax(np.round(np.diag(shares), 6))]
    return np.asarray(axis / np.linalg.norm(axis))


def _downhill(slope: Slope, x: Array, largest: Array, shares: Shares) -> Array | None:
    """Return where the gradient vanishes, downhill from x, or None.

    Newton steps with absolute curvatures, which reach a saddle only from its ridge.
    """
    for _ in range(_STEPS):
        (steep,) = slope(x[None])
        curvatures, axes = np.linalg.eigh(curvature(slope, x, largest))
        step = -axes @ (axes.T @ steep / np.maximum(np.abs(curvatures), _FLATTEST))
        if np.abs(steep).max() < _BALANCED * largest.min():
            # A last Newton step for full precision.
            return np.asarray(x + step)
        step *= min(1.0, _LONGEST / max(float(shares(step).max()), 1e-300))
        while not _leads_down(slope, x, step, steep, shares):
            step = step / 2.0
            if np.abs(step).max() < _BALANCED * largest.min():
                return None
        x = x + step
    return None


def _leads_down(
    slope: Slope,
    x: Array,
    step: Array,
    steep: Array,
    shares: Shares,
) -> bool:
    """Return whether a step stays within limits, and its slope does not reverse too far."""
    if not (shares(x + step) < 1.0).all():
        return False
    (after,) = slope((x + step)[None])
    return bool(after @ step <= -_FALLS * (steep @ step))


def curvature(slope: Slope, x: Array, largest: Array) -> Array:
    """Return the symmetric part of the Hessian (n, n); largest: of each coordinate."""
    h = _DIFFERENCE * largest
    aside = np.diag(h)
    ahead, behind = np.split(slope(np.vstack([x + aside, x - aside])), 2)
    found = (ahead - behind) / (2.0 * h[:, None])
    return np.asarray((found + found.T) / 2.0)
