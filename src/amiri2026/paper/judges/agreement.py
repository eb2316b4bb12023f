"""How formulas are compared: at random states, by slopes and by series."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from amiri2026.extremes import largest
from amiri2026.paper.evidence import Evidence
from amiri2026.verdicts import Judgement, or_misprint

Array = np.ndarray

Series = Callable[[Any], Any]
"""An analytic function of one complex number."""

Judge = Callable[[Evidence], Judgement]

STATES, SEED = 100, 0

AGREES = 1e-9
"""Relative difference below which two formulas are one."""

SLOPES_AGREE = 1e-6
"""Relative difference below which a formula is the slope that differences give."""

_TIME_STEP = 1e-5
_POINTS, _LOWEST, _HIGHEST = 32, -4, 8


def as_formula(judge: Judge) -> Judge:
    """Return the judge of a formula, which holds for every vehicle or is a misprint."""

    def judged(evidence: Evidence) -> Judgement:
        return or_misprint(judge(evidence), "the formula or value that it is compared with")

    return judged


def random_states(length: float, count: int = STATES) -> list[tuple[Array, Array]]:
    """Return pairs (q, q̇) of the paper's coordinates, for an arm of a length [m].

    |κ| l from 0.1 to 3 in both signs, |θ| <= 1.2: in arm lengths and radians they are the same for
    every arm, so that no formula holds of one length alone.
    """
    rng = np.random.default_rng(SEED)
    angles = rng.uniform(-np.pi, np.pi, (count, 4))
    q = np.empty((count, 8))
    q[:, :3] = rng.uniform(-2.0, 2.0, (count, 3))
    q[:, 3], q[:, 5], q[:, 7] = angles[:, :3].T
    q[:, 4] = angles[:, 3] * (1.2 / np.pi)
    q[:, 6] = rng.uniform(0.1, 3.0, count) * rng.choice([-1.0, 1.0], count)
    units = natural_units(length)
    return list(zip(units * q, units * rng.normal(size=(count, 8)), strict=True))


def natural_units(length: float) -> Array:
    """Return factors from coordinates (8,) in arm lengths and radians to m, rad and 1/m."""
    return np.array([length] * 3 + [1.0] * 3 + [1.0 / length, 1.0])


def apart(found: Any, right: Any) -> float:
    """Return the norm of the difference of two arrays over that of the right one."""
    difference = np.linalg.norm(np.asarray(found) - right)
    return float(difference / np.linalg.norm(right))


def largest_gap(differences: Iterable[float], least: float) -> float:
    """Return the largest difference, NaN if one is; `least` if only rounding is below."""
    return largest([least, *differences])


def rate(function: Callable[[Array], Array], q: Array, qd: Array) -> Array:
    """Return derivative of a function of q in time, by central differences: good to 1e-9 or so."""
    ahead, behind = function(q + _TIME_STEP * qd), function(q - _TIME_STEP * qd)
    return (ahead - behind) / (2.0 * _TIME_STEP)


def partial(function: Callable[[Array], Array], q: Array, index: int) -> Array:
    """Return the partial derivative of an analytic function of q, by an exact complex step."""
    shifted = q.astype(complex)
    shifted[index] += 1e-30j
    return np.imag(function(shifted)) / 1e-30


def spin_of(matrix: Array) -> Array:
    """Return vector (3,) of a matrix' skew part: of Ṙ Rᵀ, the angular velocity in outer axes."""
    part = 0.5 * (matrix - matrix.T)
    return np.array([part[2, 1], part[0, 2], part[1, 0]])


def powers(function: Series, radius: float) -> dict[int, Array]:
    """Return terms c_k radius^k of a function's Laurent series at 0, by k from -4 to 8.

    By Cauchy's integral on a circle of that radius, inside which only 0 may be singular. No point
    of it is real or imaginary.
    """
    turns = np.exp(1j * np.pi * (2 * np.arange(_POINTS) + 1) / _POINTS)
    values = np.array([function(radius * turn) for turn in turns])
    return {k: np.tensordot(turns**-k, values, 1) / _POINTS for k in range(_LOWEST, _HIGHEST + 1)}


def lowest_powers(function: Series, radius: float) -> Array:
    """Return the lowest power in the series of each component; NaN for one that is zero."""
    terms = powers(function, radius)
    sizes = np.abs([terms[k] for k in sorted(terms)])
    # Rounding leaves 1e-14 of the largest term in those that vanish.
    present = sizes > AGREES * sizes.max(axis=0)
    return np.where(present.any(axis=0), present.argmax(axis=0) + _LOWEST, np.nan)
