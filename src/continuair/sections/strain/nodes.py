"""Nodes of a section: the Gauss nodes of its own mass, with backbone and disks.

Sums over them replace integrals over the mass, exactly for polynomials of degree 2 m - 1 of the arc
length with m nodes, and any number of disks costs nothing in flight. The nodes are eigenvalues of
the Jacobi matrix of the measure (Golub and Welsch, Math. Comp. 23, 1969), by Lanczos's method with
full orthogonalisation. Integrals along the arm interpolate between the same nodes.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial.legendre import leggauss

from continuair.typing import Array

FINE = 48
"""Gauss nodes that stand for the backbone."""


@cache
def gauss(count: int) -> tuple[Array, Array]:
    """Return the Gauss-Legendre nodes and weights of the interval from 0 to 1."""
    nodes, weights = leggauss(count)
    return (1.0 + nodes) / 2.0, weights / 2.0


def lagrange(nodes: Array, at: Array) -> Array:
    """Return the Lagrange polynomials of nodes (..., m) at points (..., n), as (..., n, m)."""
    m = nodes.shape[-1]
    out = np.ones((*at.shape, m))
    for k in range(m):
        for j in range(m):
            if j != k:
                between = nodes[..., k] - nodes[..., j]
                out[..., k] *= (at - nodes[..., j, None]) / between[..., None]
    return out


def integration(nodes: Array) -> Array:
    """Return the integrals from 0 to each node, and to 1, of the Lagrange polynomials of nodes.

    Parameters
    ----------
    nodes : ndarray
        Of shape (..., m), from 0 to 1.

    Returns
    -------
    ndarray
        Of shape (..., m + 1, m).
    """
    points, weights = gauss(nodes.shape[-1])
    ends = np.concatenate([nodes, np.ones_like(nodes[..., :1])], axis=-1)
    inner = ends[..., None] * points
    shares = lagrange(nodes, inner.reshape(*inner.shape[:-2], -1))
    shares = shares.reshape(*inner.shape, -1)
    return ends[..., None] * (weights[:, None] * shares).sum(-2)


def gathered(
    count: int, backbone: Array, disks: Array, along: tuple[Array, Array] | None = None
) -> tuple[Array, Array]:
    """Return nodes, and masses and inertias there, of a backbone with disks.

    Parameters
    ----------
    count : int
        Number of nodes, m.
    backbone : ndarray
        Mass [kg], transverse and axial inertia [kg m²] of the whole backbone, of shape (runs, 3).
    disks : ndarray
        Place over the length, mass, transverse and axial inertia of each, of shape (runs, n, 4).
    along : tuple of ndarray, optional
        Mass and rotary inertia per length over their means at the `FINE` Gauss nodes from 0 to 1,
        of shape (runs, FINE); by default uniform.

    Returns
    -------
    nodes : ndarray
        Of shape (runs, m), from 0 to 1.
    bodies : ndarray
        Mass, transverse and axial inertia at each node, of shape (runs, m, 3).
    """
    fine, weights = gauss(FINE)
    places = np.broadcast_to(fine, (len(backbone), FINE))
    rod = weights[:, None] * backbone[:, None, :]
    if along is not None:
        masses, inertias = along
        rod = rod * np.stack([masses, inertias, inertias], axis=-1)
    x = np.concatenate([places, disks[..., 0]], axis=1)
    parts = np.concatenate([rod, disks[..., 1:]], axis=1)
    masses = parts[..., 0]
    whole = masses.sum(-1)
    diagonal, above = _jacobi(x, np.sqrt(masses / whole[:, None]), count)
    matrix = np.zeros((len(x), count, count))
    places_on = np.arange(count)
    matrix[:, places_on, places_on] = diagonal
    matrix[:, places_on[:-1], places_on[1:]] = above
    matrix[:, places_on[1:], places_on[:-1]] = above
    nodes, vectors = np.linalg.eigh(matrix)
    bodies = np.empty((len(x), count, 3))
    bodies[..., 0] = whole[:, None] * vectors[:, 0] ** 2
    shares = lagrange(nodes, x)
    for column in (1, 2):
        bodies[..., column] = (shares * parts[..., column, None]).sum(1)
    return nodes, bodies


def _jacobi(x: Array, vector: Array, count: int) -> tuple[Array, Array]:
    """Return the diagonals of the Jacobi matrices of measures at points x (runs, n)."""
    basis = [vector]
    diagonal, above = np.empty((len(x), count)), np.empty((len(x), count - 1))
    for k in range(count):
        rest = x * basis[k]
        diagonal[:, k] = (rest * basis[k]).sum(-1)
        for each in basis + basis:
            rest = rest - (rest * each).sum(-1)[:, None] * each
        if k + 1 < count:
            above[:, k] = np.sqrt((rest * rest).sum(-1))
            basis.append(rest / above[:, k, None])
    return diagonal, above
