"""Variance-based sensitivity indices of an output, from samples of a box.

The variance of a function of independent inputs splits into parts of inputs alone and together
(I. M. Sobol, 2001). For a polynomial chaos expansion in products of Legendre polynomials that are
orthonormal over the box, these parts are sums of squared coefficients (B. Sudret, 2008).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from continuair.typing import Array

_ORDER = 4
"""Total degree of the expansion; a smaller sample gets a smaller one."""
_SAMPLES_PER_TERM = 3
_FOLDS = 5


@dataclass(frozen=True)
class Importance:
    """Sensitivity indices.

    first, total (inputs,): share of the expansion's variance due to an input alone, and with its
    interactions; explained: share of the samples' variance that the expansion predicts in
    cross-validation.
    """

    first: Array
    total: Array
    explained: float


def importance(inputs: Array, output: Array) -> Importance:
    """Return the indices of an output (samples,) over inputs (samples, n), scaled to [0, 1]."""
    order = _order(len(output), inputs.shape[1])
    degrees = _degrees(inputs.shape[1], order)
    terms = _terms(inputs, degrees)
    centred = output - output.mean()
    coefficients, explained = _fitted(terms, centred)
    share = coefficients**2 * (degrees.sum(1) > 0)
    variance = share.sum() or 1.0
    used = degrees > 0
    alone = used & (used.sum(1) == 1)[:, None]
    return Importance(share @ alone / variance, share @ used / variance, explained)


def _order(samples: int, inputs: int) -> int:
    """Return the largest total degree with enough samples per term."""
    for order in range(_ORDER, 1, -1):
        if _SAMPLES_PER_TERM * len(_degrees(inputs, order)) <= samples:
            return order
    return 1


def _degrees(inputs: int, order: int) -> NDArray[np.intp]:
    """Return the degrees (terms, inputs) of all products up to a total degree."""
    rows = []
    for total in range(order + 1):
        for chosen in combinations_with_replacement(range(inputs), total):
            rows.append(np.bincount(np.array(chosen, int), minlength=inputs))
    return np.array(rows)


def _terms(inputs: Array, degrees: NDArray[np.intp]) -> Array:
    """Return products (samples, terms) of Legendre polynomials, orthonormal over the box."""
    top = int(degrees.max())
    single = np.polynomial.legendre.legvander(2.0 * inputs - 1.0, top)
    single = single * np.sqrt(2.0 * np.arange(top + 1) + 1.0)
    found = np.ones((len(inputs), len(degrees)))
    for column in range(inputs.shape[1]):
        found *= single[:, column, degrees[:, column]]
    return found


def _fitted(terms: Array, output: Array) -> tuple[Array, float]:
    """Return least-squares coefficients, and the cross-validated share of variance predicted."""
    # Terms orthonormal over the box give well-conditioned normal equations.
    fold = np.arange(len(output)) % _FOLDS
    parts = [(terms[fold == k], output[fold == k]) for k in range(_FOLDS)]
    products = np.array([part.T @ part for part, _ in parts])
    sides = np.array([part.T @ values for part, values in parts])
    whole, side = products.sum(0), sides.sum(0)
    left = 0.0
    for k, (part, values) in enumerate(parts):
        seen = _solve(whole - products[k], side - sides[k])
        left += float(np.sum((values - part @ seen) ** 2))
    power = float(np.sum(output**2))
    return _solve(whole, side), 1.0 - left / power if power else 1.0


def _solve(matrix: Array, side: Array) -> Array:
    """Return the least-squares solution of a symmetric system."""
    return np.asarray(np.linalg.lstsq(matrix, side, rcond=1e-10)[0], float)
