"""How sure a fit is of its fields, and what its data cannot tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import matmul_toeplitz

from continuair.analysis.shares import percent
from continuair.identification.leftover import autocovariance
from continuair.identification.problem import GROUPS, Problem

Array = np.ndarray

NULL = 1e-6
"""Singular values below this share of the largest count as 0: differences do not resolve them."""

SILENT = 1e-8
"""A field that moves no measurement by this [m, rad, 1/m] per factor e has no effect."""

VAGUE = 0.3
"""A standard error above this share of a value is warned about."""


def confidence(
    problem: Problem, where: Array, deviations: Array, left: Array
) -> tuple[Array, float, tuple[str, ...]]:
    """Standard errors (fields,) on the fields' scales, condition, and what is in doubt.

    left: what is left over (rows, measured), of which deviations are those of GROUPS.
    """
    J, edge = problem.fine_jacobian(where, np.ones(len(GROUPS))), problem.at_edge(where)
    silent = np.abs(J).max(0) < SILENT
    scale = problem.of_columns(deviations)
    J = J / np.tile(scale, len(J) // problem.measured)[:, None]
    size = np.where(silent, 1.0, np.linalg.norm(J, axis=0))
    U, singular, V = np.linalg.svd(J / size, full_matrices=False)
    null = singular < NULL * singular[0]
    lost = silent | _mixed(V[null], size, problem.fields)
    count = problem.fields
    inverse = (V.T[:count] * np.where(null, 0.0, 1.0 / singular.clip(1e-300))) @ U.T
    freedom = 1.0 - len(where) / left.size
    errors = spread(inverse.reshape(count, *left.shape), left / scale, freedom)
    errors = np.where(lost[:count], np.inf, errors / size[:count])
    shares = errors * problem.chosen.relative(where[:count])
    names = problem.chosen.names
    doubts = (*_of_fields(names, silent, edge, lost), *_of_vague(names, shares))
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    return errors, np.inf if silent.any() else condition, doubts


def _mixed(null: Array, size: Array, fields: int) -> Array:
    """Which unknowns (unknowns,) share in combinations (n, unknowns) that move nothing: by what
    they are of the columns of norm 1, and fields as well by what they are of the largest share."""
    found = np.sum(null**2, 0) > 1e-4
    for combination in null:
        if (combination[:fields] ** 2 > 1e-4).any():
            shares = np.abs(combination / size)[:fields]
            found[:fields] |= shares > 0.01 * shares.max()
    return np.asarray(found)


def spread(inverse: Array, left: Array, freedom: float) -> Array:
    """Standard errors (fields,) by what fields make of errors of measurements (fields, rows,
    measured), and what is left over of these (rows, measured), in its deviations.

    The larger one of what independent rows give, and of what rows give that go on as they do in
    each column (Morelli and Klein 1995, doi:10.2514/6.1995-3499), in lags that count ever less.
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


def _of_fields(names: Sequence[str], silent: Array, edge: Array, lost: Array) -> list[str]:
    """What is in doubt of fields that have no effect, no room, or none of their own."""
    doubts = [
        f"the flight does not depend on {name} near the fit; leave it out of --fit."
        for name, quiet in zip(names, silent, strict=False)
        if quiet
    ]
    doubts += [
        f"{name} lies at the edge of what a vehicle can have, or can fly with, which may have held "
        "it there: read it and its standard error with care, or leave it out of --fit."
        for name, held in zip(names, edge, strict=False)
        if held
    ]
    mixed = [name for name, gone, quiet in zip(names, lost, silent, strict=False)
             if gone and not quiet]  # fmt: skip
    if mixed:
        doubts.append(
            f"the data cannot tell {' and '.join(mixed)} apart: another combination of them flies "
            "the same; fit fewer of them and measure the others."
        )
    return doubts


def _of_vague(names: Sequence[str], shares: Array) -> list[str]:
    """What is in doubt of fields whose standard errors are large shares of them."""
    return [
        f"the data hardly determine {name}: its standard error is {percent(share)} of it; "
        "leave it out of --fit, or record a flight that excites it."
        for name, share in zip(names, shares, strict=True)
        if VAGUE < share < np.inf
    ]
