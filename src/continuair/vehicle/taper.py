"""Round rods whose radius changes linearly along them: means over the length, and stiffnesses.

With the radius r(s), mass and axial stiffness per length go with r², the bending and twisting
stiffness and the rotary inertia with r⁴.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any

import numpy as np
from numpy.polynomial import legendre
from pydantic import BeforeValidator

from continuair.typing import Array
from continuair.vehicle.fields import finite

AREA, MOMENT = 2, 4
"""Powers of the radius in the area and in the second moment of area."""

_NODES = 8
"""Gauss nodes, exact for r⁴ times the square of a polynomial of order 5."""


def _radius(value: object) -> float | tuple[float, float]:
    given = value.tolist() if isinstance(value, np.ndarray) else value
    several = isinstance(given, (list, tuple))
    both = list(given) if isinstance(given, (list, tuple)) else [given]
    try:
        radii = [finite(each) for each in both]
    except ValueError:
        radii = []
    if len(radii) != 1 + several or not all(each > 0.0 for each in radii):
        raise ValueError("must be a finite number above 0, or 2 of them, at the base and the tip")
    return (radii[0], radii[1]) if several else radii[0]


Radius = Annotated[float | tuple[float, float], BeforeValidator(_radius)]
"""One radius, or those at the base and at the tip; the type of a field."""


def ends(radius: Any) -> tuple[Any, Any] | None:
    """Return the radii at base and tip of a tapered rod, or None for one radius.

    Parameters
    ----------
    radius : float, tuple of float, or ndarray of shape (runs,) or (runs, 2), or None
        The value of a field `radius`.

    Returns
    -------
    tuple, or None
        Two numbers, or two arrays (runs,).
    """
    if isinstance(radius, np.ndarray):
        return (radius[:, 0], radius[:, 1]) if radius.ndim == 2 else None
    return radius if isinstance(radius, tuple) else None


def mean_power(radii: tuple[Any, Any], power: int) -> Any:
    """Return the mean of r to a power over the length, from products and sums only."""
    base, tip = radii
    whole: Any = 0.0
    for k in range(power + 1):
        part: Any = 1.0
        for each in [base] * (power - k) + [tip] * k:
            part = part * each
        whole = whole + part
    return whole / (power + 1)


def share_of_mean(radii: tuple[Any, Any], power: int, shares: Array) -> Array:
    """Return r to a power over its mean (..., n), at shares (n,) of the length."""
    base, tip = (np.asarray(each, float)[..., None] for each in radii)
    found: Array = (base + (tip - base) * shares) ** power
    return found / np.asarray(mean_power(radii, power))[..., None]


@cache
def _polynomials(count: int) -> tuple[Array, Array]:
    """Return Gauss nodes from 0 to 1, and w P_p P_q there (n, count, count)."""
    nodes, weights = legendre.leggauss(_NODES)
    values = np.stack([legendre.Legendre.basis(p)(nodes) for p in range(count)], axis=1)
    return (1.0 + nodes) / 2.0, weights[:, None, None] / 2.0 * values[:, :, None] * values[:, None]


def coupled(radii: tuple[Any, Any], power: int, count: int) -> Array:
    """Return ∫ P_p P_q r^power / mean (..., count, count) over the length, as a part of it.

    P: shifted Legendre polynomials. For equal radii it is diagonal, 1/(2 p + 1).
    """
    shares, squares = _polynomials(count)
    return np.asarray(np.einsum("...n,npq->...pq", share_of_mean(radii, power, shares), squares))
