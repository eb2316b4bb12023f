"""Stable equilibria of clamped arms under gravity and tensions, by Newton's method in rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from continuair.analysis.clamped import ClampedArm, Rows
from continuair.typing import Array

_Energy: TypeAlias = Callable[[Array, Rows], tuple[Array, Array]]

PARTS = (2, 8, 32)
"""Numbers of equal parts in which the loads are applied, each tried where the one before fails."""

_MOST = 40
"""Most steps of Newton's method per part."""

_DIFFERENCE = 1e-4
"""Step of central differences of the gradient, in natural units."""

_LONGEST = 0.5
"""Longest step, in natural units: 1 is a turn of 1 rad over a section, or a stretch of 1."""

_REST = 1e-9
"""Length of the last step, in natural units."""

_WIDEST = 4.0 * np.pi
"""Sum of the absolute coefficients in natural units beyond which a row is given up."""


def equilibria(arm: ClampedArm, run: Rows, tensions: Array, gravity: Array) -> Array:
    """Return coordinates at which arms rest, on the branch that starts without any load.

    Parameters
    ----------
    arm : ClampedArm
        The arm over runs.
    run : ndarray, shape (rows,)
        The run of each row.
    tensions : ndarray, shape (rows, tendons)
        Tensions [N].
    gravity : ndarray, shape (rows, 3)
        Acceleration of gravity in axes of the arm's base [m/s²].

    Returns
    -------
    ndarray, shape (rows, coordinates)
        The coordinates; nan where no stable equilibrium is found.
    """
    found = np.full((len(run), arm.coordinates), np.nan)
    left = np.arange(len(run))
    for parts in PARTS:
        q = np.zeros((len(left), arm.coordinates))
        for part in range(1, parts + 1):
            share, kept = part / parts, ~np.isnan(q[:, 0])
            at = left[kept]
            q[kept] = _rest(arm, run[at], share * tensions[at], share * gravity[at], q[kept])
        done = ~np.isnan(q[:, 0])
        found[left[done]] = q[done]
        left = left[~done]
        if not len(left):
            break
    return found


def _rest(arm: ClampedArm, run: Rows, tensions: Array, gravity: Array, q: Array) -> Array:
    """Return the minimum of the energy next to q (rows, coordinates), nan where none is found."""
    unit, found = arm.natural(run), np.full(q.shape, np.nan)
    # Divided by the root of the stiffness, all springs are 1: stretch is far stiffer than bends.
    soft = 1.0 / np.sqrt(np.einsum("rjj->rj", arm.stiffness)[run] * unit**2)
    x, rows = q / unit, np.arange(len(q))
    for _ in range(_MOST):
        if not len(rows):
            break

        def energy(at: Array, of: Rows) -> tuple[Array, Array]:
            value, slope = arm.energy(at * unit[of], run[of], tensions[of], gravity[of])
            return value, slope * unit[of]

        value, slope = energy(x, rows)
        own = soft[rows]
        hessian = own[:, :, None] * _hessian(energy, x, rows) * own[:, None, :]
        curvature, axes = np.linalg.eigh(np.asarray(hessian, float))
        along = np.einsum("rij,ri->rj", axes, own * slope)
        least = 1e-6 * np.abs(curvature).max(-1, keepdims=True)
        # Downhill, where the energy has no minimum, too.
        step = -own * np.einsum("rij,rj->ri", axes, along / np.maximum(np.abs(curvature), least))
        size = np.abs(step).max(-1, keepdims=True)
        done = (size[:, 0] < _REST) & (curvature[:, 0] > least[:, 0])
        found[rows[done]] = (x + step)[done] * unit[rows[done]]
        step = step * np.minimum(1.0, _LONGEST / np.maximum(size, 1e-300))
        x = np.asarray(x + _descending(energy, x, step, rows, value, (slope * step).sum(-1)))
        kept = ~done & (np.abs(x).sum(-1) < _WIDEST * len(arm.sections)) & np.isfinite(x).all(-1)
        x, rows = x[kept], rows[kept]
    return found


def _descending(
    energy: _Energy, x: Array, step: Array, rows: Rows, before: Array, falls: Array
) -> Array:
    """Return steps (rows, coordinates), halved until the energy falls."""
    out = step.copy()
    for _ in range(30):
        value, _ = energy(x + out, rows)
        # Near rest the fall is lost in the rounding of the energy.
        wrong = ~(value <= before + 1e-4 * falls + 1e-13 * np.abs(before) + 1e-18)
        if not wrong.any():
            break
        out[wrong] *= 0.5
        falls = np.where(wrong, 0.5 * falls, falls)
    return out


def _hessian(energy: _Energy, x: Array, rows: Rows) -> Array:
    """Return second derivatives (rows, coordinates, coordinates) by central differences."""
    n = x.shape[1]
    aside = _DIFFERENCE * np.concatenate([np.eye(n), -np.eye(n)])
    many = (x[:, None] + aside).reshape(-1, n)
    _, slopes = energy(many, np.repeat(rows, 2 * n))
    ahead, behind = np.moveaxis(slopes.reshape(len(x), 2, n, n), 1, 0)
    found = (ahead - behind) / (2.0 * _DIFFERENCE)
    return np.asarray(0.5 * (found + found.swapaxes(-1, -2)))
