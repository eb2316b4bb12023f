"""Covariance matrix adaptation, the local search for objectives that are rough at small scales.

(μ/μ_w, λ)-CMA-ES with its usual constants: Hansen, "The CMA Evolution Strategy: A Tutorial", 2016.
Every generation is one batch.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Array = np.ndarray


def adapt(
    cost: Callable[[Array], Array],
    start: Array,
    *,
    spread: float,
    population: int,
    generations: int,
    seed: int,
) -> None:
    """Minimise cost (runs,) of rows (runs, n) in the unit cube, from `start` (n,) outwards.

    spread: standard deviation of the first generation. The caller keeps what it likes of the rows
    that `cost` is asked for; points outside are moved to the cube's faces.
    """
    n, rng = len(start), np.random.default_rng(seed)
    weights = _weights(population // 2)
    effective = 1.0 / np.sum(weights**2)
    c_sigma, damp, c_path, c_one, c_rank = _rates(n, effective)
    usual = np.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n**2))
    mean, sigma = start.copy(), spread
    covariance, path, path_sigma = np.eye(n), np.zeros(n), np.zeros(n)
    for generation in range(1, generations + 1):
        root, inverse = _symmetric_roots(covariance)
        steps = rng.normal(size=(population, n)) @ root
        rows = np.clip(mean + sigma * steps, 0.0, 1.0)
        steps = (rows - mean) / sigma
        best = steps[np.argsort(cost(rows), kind="stable")[: len(weights)]]
        moved = weights @ best
        mean = mean + sigma * moved
        path_sigma *= 1.0 - c_sigma
        path_sigma += np.sqrt(c_sigma * (2.0 - c_sigma) * effective) * (inverse @ moved)
        length = np.linalg.norm(path_sigma) / np.sqrt(1.0 - (1.0 - c_sigma) ** (2 * generation))
        short = length < (1.4 + 2.0 / (n + 1.0)) * usual
        path = (1.0 - c_path) * path + short * np.sqrt(c_path * (2.0 - c_path) * effective) * moved
        covariance = (
            (1.0 - c_one - c_rank) * covariance
            + c_one * np.outer(path, path)
            + c_rank * np.einsum("i,ij,ik->jk", weights, best, best)
        )
        sigma *= float(np.exp(c_sigma / damp * (np.linalg.norm(path_sigma) / usual - 1.0)))


def _weights(parents: int) -> Array:
    """Weights (parents,) of the best rows of a generation, the best one first."""
    weights = np.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    return weights / weights.sum()


def _rates(n: int, effective: float) -> tuple[float, float, float, float, float]:
    """c_σ, d_σ, c_c, c_1 and c_μ of n parameters, of μ_eff effective parents."""
    c_sigma = (effective + 2.0) / (n + effective + 5.0)
    damp = 1.0 + 2.0 * max(0.0, np.sqrt((effective - 1.0) / (n + 1.0)) - 1.0) + c_sigma
    c_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n)
    c_one = 2.0 / ((n + 1.3) ** 2 + effective)
    c_rank = min(
        1.0 - c_one, 2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0) ** 2 + effective)
    )
    return c_sigma, damp, c_path, c_one, c_rank


def _symmetric_roots(covariance: Array) -> tuple[Array, Array]:
    """C^(1/2) and C^(-1/2), which do not depend on the signs and order of the axes of C."""
    scales, axes = np.linalg.eigh(covariance)
    scales = np.sqrt(np.maximum(scales, 1e-20))
    return (axes * scales) @ axes.T, (axes / scales) @ axes.T
