"""Natural frequencies and fastest rates of arms, from unit moments on their bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from continuair.engine.engine import Drive, Engine, Start
from continuair.sections import of_coordinates, of_pairs
from continuair.typing import Array, ArrayLike
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL

# Configurations computed at once, which limits the memory of large batches.
_AT_ONCE = 1024


def bend_compliance(engine: Engine, q: ArrayLike) -> Array:
    """Return the bend block of M⁻¹, (runs, bends, bends) [1/(kg m⁴)], at rest in the configurations
    q.

    It is the acceleration of the bend under a unit bend moment: for an engine of `coupled` on the
    free base, for one of `independent` on a clamped one.
    """
    return _compliance(engine, np.atleast_2d(q)[None])[0]


def fastest_frequency(engine: Engine, q: ArrayLike) -> Array:
    """Return ω_max (runs,) [rad/s] of the pencil (K, M) at q: the largest √eig([M⁻¹]_bend K)."""
    return np.sqrt(_largest(_symmetric(engine, bend_compliance(engine, q))))


def fastest_rate(engine: Engine, q: ArrayLike) -> Array:
    """Return the largest |λ| (runs,) [1/s] of the bends at q with damping, base free or clamped.

    With one section |λ| is ω of its stiffest mode, λ² + 2 γ λ + ω² = 0, if it oscillates, and the
    decay rate γ + √(γ² - ω²) if it is overdamped. q: of the runs, or (configurations, runs,
    coordinates): the largest of all configurations of a run.
    """
    rows = np.atleast_2d(np.asarray(q))
    compliance = _compliance(engine, rows.reshape(-1, *rows.shape[-2:]))
    stiffness, damping = _of_bends(engine)
    rates = _fastest(_symmetric(engine, compliance), damping / stiffness)
    largest: Array = np.fmax.reduce(rates)
    return largest


def first_frequency(engine: Engine, q: ArrayLike) -> Array:
    """Return ω (runs,) [rad/s] of the first undamped mode, of the fastest arm in its faster plane.

    0 without arms; q as for `fastest_rate`.
    """
    if not engine.layout.bends:
        return np.zeros(len(engine.plants))
    rows = np.atleast_2d(np.asarray(q))
    compliance = _compliance(engine, rows.reshape(-1, *rows.shape[-2:]))
    squares, found = _symmetric(engine, compliance), []
    for of_arm in engine.layout.of_arm:
        found.append(_eigenvalues(squares[..., of_arm, of_arm])[..., 1])
    largest: Array = np.fmax.reduce(np.sqrt(np.max(found, axis=0)))
    return largest


def _fastest(squares: Array, share: Array) -> Array:
    """Return the largest |λ| (..., runs) of bends, from √K [M⁻¹] √K (..., runs, bends, bends).

    share: D over K of each bend (runs or 1, bends).
    """
    if not (share == share[:, :1]).all():
        return _largest_of_pencil(squares, share)
    # Stiffness-proportional damping keeps the modes decoupled.
    largest = _largest(squares)
    decay, frequency = 0.5 * share[:, 0] * largest, np.sqrt(largest)
    over = np.sqrt(np.maximum(decay**2 - frequency**2, 0.0))
    return np.where(decay > frequency, decay + over, frequency)


def _largest_of_pencil(squares: Array, share: Array) -> Array:
    """Return the largest |λ| of λ² + S diag(share) λ + S, with S (..., bends, bends)."""
    n = squares.shape[-1]
    known = np.asarray(np.isfinite(squares).all((-1, -2)))
    filled = np.where(known[..., None, None], squares, 0.0)
    companion = np.zeros((*squares.shape[:-2], 2 * n, 2 * n))
    companion[..., :n, n:] = np.eye(n)
    companion[..., n:, :n] = -filled
    companion[..., n:, n:] = -filled * share[:, None, :]
    found = np.abs(np.linalg.eigvals(companion)).max(axis=-1)
    return np.asarray(np.where(known, found, np.nan))


def _of_bends(engine: Engine) -> tuple[Array, Array]:
    """Return stiffness and damping of each coordinate (runs, bends), of a bend [N m³, N m³ s]."""
    runs = len(engine.plants)
    stiffness = of_coordinates(engine.vehicle, "stiffness", runs)
    return stiffness, of_coordinates(engine.vehicle, "damping", runs)


def _symmetric(engine: Engine, compliance: Array) -> Array:
    """Return √K [M⁻¹]_bend √K (..., bends, bends) [1/s²], symmetric; its eigenvalues are ω².

    With elastic forces between coordinates √K is a triangular factor of K. Damping over stiffness
    is the same for all coordinates that they couple, so that it commutes with the factor.
    """
    found: Array
    if engine.tree.couples:
        root = np.linalg.cholesky(of_pairs(engine.vehicle, "stiffness", len(engine.plants)))
        found = root.swapaxes(-1, -2) @ compliance @ root
    else:
        root = np.sqrt(_of_bends(engine)[0])
        found = root[:, :, None] * compliance * root[:, None, :]
    return 0.5 * (found + found.swapaxes(-1, -2))


def _compliance(engine: Engine, q: Array) -> Array:
    """Return bend blocks (configurations, runs, bends, bends) of `bend_compliance`.

    q: (configurations, runs or 1, coordinates).
    """
    flat, plants = q.reshape(-1, q.shape[-1]), len(engine.plants)
    layout = engine.layout
    states = state_from_paper(flat, np.zeros(flat.shape), layout)
    angles = branches_of(flat, layout)
    runs = max(q.shape[1], plants)
    if not engine.layout.bends:
        return np.zeros((len(q), runs, 0, 0))
    states, angles = (
        np.broadcast_to(each.reshape(*q.shape[:-1], -1), (len(q), runs, each.shape[-1]))
        for each in (states, angles)
    )
    blocks = [slice(first, first + _AT_ONCE) for first in range(0, runs, _AT_ONCE)]
    return np.concatenate(
        [_block(engine, states[:, at], angles[:, at], np.arange(runs)[at]) for at in blocks],
        axis=1,
    )


def _block(engine: Engine, states: Array, angles: Array, runs: NDArray[np.intp]) -> Array:
    """Return `_compliance` of some runs in one launch, which costs more than a few runs do.

    states: (configurations, runs, state); angles: their branch angles.
    """
    layout, shape = engine.layout, angles.shape[:2]
    moments = np.vstack([np.zeros(layout.bends), np.eye(layout.bends)])
    # Unit moments would be lost in the rounding of a stiff, bent arm's accelerations.
    size, _ = _of_bends(engine)
    size = size[np.minimum(runs, len(size) - 1)]
    inputs = np.zeros((len(moments), *shape, layout.inputs))
    inputs[..., layout.bend_moment] = moments[:, None, None] * size
    many = len(moments) * shape[0] * shape[1]
    start = Start(
        *(
            np.broadcast_to(each, (len(moments), *each.shape)).reshape(many, -1)
            for each in (states, angles)
        )
    )
    acting = Drive(inputs.reshape(1, many, -1), False, GENERAL, 0.0)
    rates = engine.derivative(start, acting, np.resize(runs, many))[:, layout.bend_rate]
    free, *loaded = rates.reshape(len(moments), *shape, layout.bends)
    return np.stack([rate - free for rate in loaded], axis=-1) / size[:, None]


def _largest(squares: Array) -> Array:
    """Return the largest eigenvalues (...), 0 without bends; NaN beyond a full circle."""
    if not squares.shape[-1]:
        return np.zeros(squares.shape[:-2])
    return _eigenvalues(squares)[..., -1]


def _eigenvalues(squares: Array) -> Array:
    """Return eigenvalues (..., bends), ascending; NaN beyond a full circle."""
    known = np.asarray(np.isfinite(squares).all((-1, -2)))
    filled = np.where(known[..., None, None], squares, 0.0)
    return np.asarray(np.where(known[..., None], np.linalg.eigvalsh(filled), np.nan))
