"""Standard errors of fitted fields, their correlation, and warnings of undetermined fields."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matmul_toeplitz

from continuair.analysis.shares import percent
from continuair.identification.leftover import autocovariance
from continuair.identification.problem import Problem
from continuair.typing import Array

NULL = 1e-6
"""Relative size of singular values that count as 0, below the accuracy of differences."""

VAGUE = 0.3
"""Relative standard error above which a field is reported."""


def confidence(
    problem: Problem, where: Array, deviations: Array, left: Array
) -> tuple[Array, Array, float, tuple[str, ...]]:
    """Return standard errors (fields,) on the fields' scales, the correlation (fields, fields) of
    the estimates for independent rows, the condition, and warnings.

    left: residuals (rows, width), whose standard deviations by group are `deviations`.
    """
    J, edge = problem.fine_jacobian(where, problem.plain), problem.at_edge(where)
    silent, count = problem.silent(J, problem.plain), problem.fields
    # The initial state may have parts without effect, where the pose was not measured.
    kept = ~silent | (np.arange(len(where)) < count)
    J, silent, edge = J[:, kept], silent[kept], edge[kept]
    scale = problem.measured.of_columns(deviations)
    J = J / np.tile(scale, len(J) // len(scale))[:, None]
    size = np.where(silent, 1.0, np.linalg.norm(J, axis=0))
    U, singular, V = np.linalg.svd(J / size, full_matrices=False)
    null = singular < NULL * singular[0]
    lost = silent | _mixed(V[null], size, problem.fields)
    inverse = (V.T[:count] * np.where(null, 0.0, 1.0 / singular.clip(1e-300))) @ U.T
    freedom = 1.0 - problem.estimated / left.size
    errors = spread(inverse.reshape(count, *left.shape), left / scale, freedom)
    errors = np.where(lost[:count], np.inf, errors / size[:count])
    shared = inverse @ inverse.T
    alone = np.sqrt(np.diag(shared))
    # Columns have norm 1, which does not change a correlation.
    correlation = np.divide(shared, np.outer(alone, alone), out=np.eye(count),
                            where=np.outer(alone, alone) > 0.0)  # fmt: skip
    shares = errors * problem.chosen.relative(where[:count])
    names = problem.chosen.names
    doubts = (*_of_fields(names, silent, edge, lost), *_of_vague(names, shares))
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    return errors, correlation, np.inf if silent.any() else condition, doubts


def _mixed(null: Array, size: Array, fields: int) -> NDArray[np.bool_]:
    """Return which unknowns (unknowns,) take part in combinations (n, unknowns) without effect.

    By their share in columns of norm 1; fields also by their share of the largest one.
    """
    found = np.sum(null**2, 0) > 1e-4
    for combination in null:
        if (combination[:fields] ** 2 > 1e-4).any():
            shares = np.abs(combination / size)[:fields]
            found[:fields] |= shares > 0.01 * shares.max()
    return np.asarray(found)


def spread(inverse: Array, left: Array, freedom: float) -> Array:
    """Return standard errors (fields,) for residuals (rows, measured).

    inverse: change of fields per measurement (fields, rows, measured); residuals are over their
    standard deviations. The larger value of two: for independent rows, and for rows with the
    autocorrelation of each column (Morelli and Klein 1995, doi:10.2514/6.1995-3499), with
    decreasing weights of lags.
    """
    shared = np.zeros_like(left)
    lags = autocovariance(left)
    shared[: len(lags)] = lags * np.linspace(1.0, 0.0, len(lags), endpoint=False)[:, None]
    found = [
        np.einsum("fr,rf->f", inverse[..., k], matmul_toeplitz(column, inverse[..., k].T))
        for k, column in enumerate(shared.T / freedom)
    ]
    alone = np.sum(inverse**2, axis=(1, 2))
    errors: Array = np.sqrt(np.maximum(np.sum(found, axis=0), alone))
    return errors


def _of_fields(
    names: Sequence[str],
    silent: NDArray[np.bool_],
    edge: NDArray[np.bool_],
    lost: NDArray[np.bool_],
) -> list[str]:
    """Return warnings of fields that have no effect, are at a limit, or are not independent."""
    doubts = [
        f"the flight does not depend on {name} near the fit; omit it from --fit."
        for name, quiet in zip(names, silent, strict=False)
        if quiet
    ]
    doubts += [
        f"{name} lies at the edge of the valid range, which may limit it; do not trust its value "
        "and standard error, or omit it from --fit."
        for name, held in zip(names, edge, strict=False)
        if held
    ]
    mixed = [name for name, gone, quiet in zip(names, lost, silent, strict=False)
             if gone and not quiet]  # fmt: skip
    if mixed:
        doubts.append(
            f"the data cannot tell {' and '.join(mixed)} apart, as other combinations give the "
            "same flight; fit fewer, and measure the others."
        )
    return doubts


def _of_vague(names: Sequence[str], shares: Array) -> list[str]:
    """Return warnings of fields with large relative standard errors."""
    return [
        f"the data hardly determine {name}: its standard error is {percent(share)}; "
        "omit it from --fit, or record a flight that excites it."
        for name, share in zip(names, shares, strict=True)
        if VAGUE < share < np.inf
    ]
