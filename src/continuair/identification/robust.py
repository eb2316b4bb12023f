"""Robust least squares: the loss, and the covariance of what it estimates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from continuair.typing import Array

LINEAR = 2.0
"""Residual, over the spread, beyond which the loss grows linearly."""

_CORRELATED = 2.6
"""Correlation of neighbours over its standard error above which they are dependent, at 0.5 %."""

_ALONE = 1e-6
"""Least share of the information on a combination of unknowns outside every group."""

_PART = 1e-4


def loss(r: Array) -> Array:
    """Return the loss of residuals over their spread, SciPy's "soft_l1" times 2."""
    found: Array = 2.0 * LINEAR**2 * (np.sqrt(1.0 + (r / LINEAR) ** 2) - 1.0)
    return found


def are_independent(rest: Array, measured: Array) -> bool:
    """Return whether neighbours along every axis but the first and the last are uncorrelated.

    Parameters
    ----------
    rest : ndarray, shape (groups, ..., 3)
        What a fit leaves over.
    measured : ndarray, shape (groups, ..., 3)
        What was measured, NaN where nothing was.

    Returns
    -------
    bool
        Whether the correlation of neighbours, in samples and in markers, is within 2.6 of its
        standard errors.
    """
    known = np.where(np.isfinite(measured), rest, np.nan)
    power = np.nanmean(known**2)
    for axis in range(1, known.ndim - 1):
        each = np.moveaxis(known, axis, 0)
        products = each[1:] * each[:-1]
        count = np.isfinite(products).sum()
        if count and abs(np.nanmean(products)) * np.sqrt(count) > _CORRELATED * power:
            return False
    return True


def covariance(
    residuals: Array, slopes: Array, groups: NDArray[np.intp], independent: bool
) -> tuple[Array, float]:
    """Return the covariance of unknowns at the minimum of the loss, and its degrees of freedom.

    Parameters
    ----------
    residuals : ndarray, shape (n,)
        Residuals over their spread; 0 where nothing was measured.
    slopes : ndarray, shape (n, unknowns)
        Their derivatives, of full rank.
    groups : ndarray, shape (n,)
        Group of each residual, from 0.
    independent : bool
        Whether residuals are independent of each other. Else those of different groups are.

    Returns
    -------
    covariance : ndarray, shape (unknowns, unknowns)
        NaN for an unknown that one group alone determines, unless residuals are independent.
    degrees_of_freedom : float
        Of Student's t for an estimate over its standard error.

    Notes
    -----
    Independent: that of an M-estimator (Huber 1981, chapter 7). Else: that of a jackknife over the
    groups, of which each is left out in turn, by one Newton step (CR3; Bell and McCaffrey 2002),
    with one degree of freedom less than there are groups.
    """
    weight = 1.0 / np.sqrt(1.0 + (residuals / LINEAR) ** 2)
    scores, curved = weight * residuals, slopes * (weight**3)[:, None]
    inverse = np.linalg.pinv(curved.T @ slopes, hermitian=True)
    count, unknowns = int(np.count_nonzero(residuals)), slopes.shape[1]
    if independent:
        freedom = max(count - unknowns, 1)
        variance = float(scores @ scores) / freedom
        return variance * inverse @ (slopes.T @ slopes) @ inverse, float(freedom)
    many, lost = int(groups[-1]) + 1, np.full(unknowns, groups[-1] < 1)
    moves = np.zeros((many, unknowns))
    for group in range(many):
        own = groups == group
        share = np.eye(unknowns) - curved[own].T @ slopes[own] @ inverse
        U, outside, V = np.linalg.svd(share)
        alone = outside < _ALONE
        lost |= (V[alone] ** 2).sum(axis=0) > _PART
        outside[alone] = np.inf
        moves[group] = inverse @ (V.T / outside) @ (U.T @ (slopes[own].T @ scores[own]))
    found = moves.T @ moves * (many - 1) / many
    found[lost] = found[:, lost] = np.nan
    return found, float(max(many - 1, 1))
