"""A rod whose strain varies along it, in the axes of its base, below which it hangs.

The strain of a cross-section is its turning κ(s) [1/m] and its advance ε(s) [-] per length, in its
own axes: frames R and points p follow R' = R [κ]×, p' = R ε. Each component is a sum of shifted
Legendre polynomials. Integrated by products of exponentials of SE(3), with the Magnus expansion of
fourth order on a fine grid.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from continuair.equations.turns import Array
from continuair.typing import ArrayLike
from continuair.vehicle.strain import Orders

PIECES = 64
"""Pieces of a section between points that are asked for, whose error is some 1e-9 of its length."""

CONSTANT_PIECES = 8
"""Pieces of a section whose strain is constant: their exponentials are exact, up to 1 rad each."""

_GAUSS = np.sqrt(3.0) / 6.0
"""Distance of the two Gauss nodes from the middle of a piece, over its length."""


def strain_of(orders: Orders, coordinates: ArrayLike, share: float) -> tuple[Array, Array]:
    """Return the strain of a cross-section in its axes.

    Parameters
    ----------
    orders : Orders
        Orders of the polynomials.
    coordinates : array_like (..., n)
        Coordinates of the section [1/m; stretch and shear: -].
    share : float
        Arc length over the length of the section, 0 to 1.

    Returns
    -------
    turning : array (..., 3)
        Turning κ [1/m]: (b_y, -b_x, 0) of a bend (b_x, b_y), and -τ about z of a twist τ.
    advance : array (..., 3)
        Advance ε [-]: (0, 0, -1) without stretch and shear.
    """
    q = np.asarray(coordinates)
    values = np.zeros((6, *q.shape[:-1]), q.dtype)
    for index, (component, order) in enumerate(orders.coordinates):
        values[component] += q[..., index] * legendre.Legendre.basis(order)(2.0 * share - 1.0)
    bend_x, bend_y, twist, stretch, shear_x, shear_y = values
    turning = np.stack([bend_y, -bend_x, -twist], axis=-1)
    return turning, np.stack([shear_x, shear_y, -(1.0 + stretch)], axis=-1)


def rod_curve(
    orders: Orders, length: float, coordinates: ArrayLike, s: ArrayLike, pieces: int | None = None
) -> tuple[Array, Array]:
    """Return points and frames along a section.

    Parameters
    ----------
    orders : Orders
        Orders of the polynomials.
    length : float
        Length of the section [m].
    coordinates : array_like (..., n)
        Coordinates of the section [1/m; stretch and shear: -].
    s : array_like (m,)
        Ascending arc lengths from the base [m].
    pieces : int, optional
        Number of pieces per length. Default: PIECES, or CONSTANT_PIECES for a constant strain.

    Returns
    -------
    points : array (..., m, 3)
        Points from the base [m].
    frames : array (..., m, 3, 3)
        Axes of the cross-sections, with -z along the rod where there is no shear.
    """
    wanted, q = np.asarray(s, float), np.asarray(coordinates)
    points = np.empty((*q.shape[:-1], len(wanted), 3), q.dtype)
    frames = np.empty((*points.shape, 3), q.dtype)
    point, frame = np.zeros(points.shape[:-2] + (3,), q.dtype), np.zeros(points.shape[:-2] + (3, 3))
    frame[..., :, :] = np.eye(3)
    if pieces is None:
        pieces = PIECES if max(orders.counts) > 1 else CONSTANT_PIECES
    at = 0.0
    for index, end in enumerate(wanted):
        count = int(np.ceil(pieces * (end - at) / length))
        for piece in range(count):
            step = (end - at) / count
            moved, turned = _piece(orders, q, at + piece * step, step, length)
            point = point + np.einsum("...ij,...j->...i", frame, moved)
            frame = frame @ turned
        points[..., index, :], frames[..., index, :, :], at = point, frame, end
    return points, frames


def _piece(
    orders: Orders, q: Array, start: float, step: float, length: float
) -> tuple[Array, Array]:
    """Return the motion (..., 3) and turn (..., 3, 3) of a piece, by Magnus' fourth order."""
    middle = start + 0.5 * step
    nodes = (middle - _GAUSS * step) / length, (middle + _GAUSS * step) / length
    (turning, advance), (turning_2, advance_2) = (strain_of(orders, q, node) for node in nodes)
    # Frames are multiplied from the right, which turns the sign of the commutator.
    share = 0.5 * _GAUSS * step**2
    turn = 0.5 * step * (turning + turning_2) + share * np.cross(turning, turning_2)
    crossed = np.cross(turning, advance_2) - np.cross(turning_2, advance)
    return _exponential(turn, 0.5 * step * (advance + advance_2) + share * crossed)


def _exponential(turn: Array, move: Array) -> tuple[Array, Array]:
    """Return translation and rotation of exp of a small twist, of which `turn` is below 1 rad."""
    square = (turn * turn).sum(-1)[..., None]
    sine, cosine, shift = _series(square, 1), _series(square, 2), _series(square, 3)
    across = np.cross(turn, move)
    place = move + cosine * across + shift * np.cross(turn, across)
    crossed = np.zeros((*turn.shape, 3), turn.dtype)
    x, y, z = turn[..., 0], turn[..., 1], turn[..., 2]
    crossed[..., 0, 1], crossed[..., 0, 2], crossed[..., 1, 2] = -z, y, -x
    crossed[..., 1, 0], crossed[..., 2, 0], crossed[..., 2, 1] = z, -y, x
    rotation = np.eye(3) + sine[..., None] * crossed + cosine[..., None] * (crossed @ crossed)
    return place, rotation


def _series(square: Array, first: int) -> Array:
    """Return Σ (-x²)^k / (2k + first)!: sin x/x, (1 - cos x)/x² and (x - sin x)/x³ for 1, 2, 3."""
    found, factor = np.zeros_like(square), 1.0
    for number in range(1, first + 1):
        factor /= number
    term = np.full_like(square, factor)
    for k in range(9):
        found = found + term
        term = -term * square / ((2 * k + first + 1) * (2 * k + first + 2))
    return found
