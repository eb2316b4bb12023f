"""Rotor layouts, their allocation matrices and pseudo-inverses.

Everything is computed element by element, without BLAS, so that results have the same bits on
every processor.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from continuair.typing import ArrayLike

Array = np.ndarray

LayoutName = Literal[
    "quad_x", "quad_plus", "hex_x", "hex_plus", "hex_tilted", "octo_x", "octo_plus", "coaxial_x8"
]  # fmt: skip
"""Layouts. In a "plus" layout a boom points forward; in others the first is half a pitch left."""

_BOOMS = {"quad": 4, "hex": 6, "octo": 8, "coaxial": 4}

RANK = 1e-9
"""Smallest singular value that counts towards the rank, as a share of the largest."""

# To the digits of extended precision.
_PI = "3.14159265358979323846264338327950288"

_SWEEPS = 16
# Cosine of the angle between columns that are orthogonal.
_ORTHOGONAL = 1e-16


def layout_geometry(
    name: str, lever: ArrayLike, height: ArrayLike, tilt: ArrayLike
) -> tuple[Array, Array, Array]:
    """Return positions (..., n, 3), thrust axes (..., n, 3) and spins (n,) of a layout, body axes.

    lever, height [m] and tilt [rad] (...). The tilt about each boom alternates in sign. Rotors are
    numbered counter-clockwise seen from above. The first is on the forward boom (plus) or on the
    first boom left of it, and spins counter-clockwise. The lower rotors of a coaxial layout come
    last.
    """
    kind, _, way = name.partition("_")
    booms = _BOOMS[kind]
    angle = 2.0 * np.arange(booms) + (0.0 if way == "plus" else 1.0)
    cosine, sine = _turned(angle * np.longdouble(_PI) / booms)
    out = np.stack([cosine, sine, np.zeros(booms)], axis=-1)
    side = np.where(np.arange(booms) % 2 == 0, 1.0, -1.0)
    radial, vertical = (np.asarray(each, float)[..., None, None] for each in (lever, height))
    upright, leaning = (each[..., None, None] for each in _turned(np.asarray(tilt)))
    up = np.array([0.0, 0.0, 1.0])
    positions = radial * out + vertical * up
    axes = upright * up + leaning * side[:, None] * np.cross(out, up)
    if kind == "coaxial":
        positions, axes = (np.concatenate([each, each], axis=-2) for each in (positions, axes))
        side = np.concatenate([side, -side])
    return positions, axes, side


def _turned(angle: Array) -> tuple[Array, Array]:
    """Return cosine and sine, rounded from extended precision.

    NumPy's own results differ in the last bit from processor to processor.
    """
    wide = angle.astype(np.longdouble)
    cosine, sine = (np.round(of(wide), 18).astype(float) for of in (np.cos, np.sin))
    return cosine, sine


def wrenches(positions: Array, axes: Array, spins: Array, torque_per_thrust: ArrayLike) -> Array:
    """Return the allocation matrix (..., 6, n): thrusts to force and moment about B's origin.

    Body axes. The drag torque acts against the spin: moment Σ (r × z - s c z) f.
    """
    torque = np.asarray(torque_per_thrust, float)[..., None, None] * spins[..., None]
    moments = np.cross(positions, axes) - torque * axes
    both = np.broadcast_arrays(axes, moments)
    return np.concatenate([np.swapaxes(each, -1, -2) for each in both], axis=-2)


def pseudo_inverse(matrix: Array) -> tuple[Array, Array]:
    """Return pseudo-inverses (..., n, rows) of matrices (..., rows, n), and singular values.

    The singular values (..., rows) are not sorted. One-sided Jacobi method: pairs of rows are
    rotated until all rows are orthogonal.
    """
    rows = [matrix[..., j, :] for j in range(matrix.shape[-2])]
    turns = [np.broadcast_to(unit, (*matrix.shape[:-2], len(rows))) for unit in np.eye(len(rows))]
    for _ in range(_SWEEPS):
        turned = False
        for p in range(len(rows) - 1):
            for q in range(p + 1, len(rows)):
                cosine, sine = _rotation(rows[p], rows[q])
                turned |= bool(sine.any())
                for each in (rows, turns):
                    each[p], each[q] = (
                        cosine * each[p] - sine * each[q],
                        sine * each[p] + cosine * each[q],
                    )
        if not turned:
            break
    squares = [_dot(row, row) for row in rows]
    least = RANK**2 * np.max(squares, axis=0)
    shares = [np.where(s > least, 1.0 / np.where(s > least, s, 1.0), 0.0) for s in squares]
    parts = zip(rows, turns, shares, strict=True)
    found = sum(row[..., :, None] * (share * turn)[..., None, :] for row, turn, share in parts)
    return np.asarray(found), np.sqrt(np.concatenate(squares, axis=-1))


def _rotation(a: Array, b: Array) -> tuple[Array, Array]:
    """Return cosine and sine (..., 1) of the rotation that makes two rows orthogonal."""
    aa, bb, ab = _dot(a, a), _dot(b, b), _dot(a, b)
    counts = np.abs(ab) > _ORTHOGONAL * np.sqrt(aa * bb)
    ahead = bb - aa
    root = np.sqrt(ahead * ahead + 4.0 * ab * ab)
    below = ahead + np.where(ahead < 0.0, -root, root)
    tangent = np.where(counts, 2.0 * ab / np.where(counts, below, 1.0), 0.0)
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    return cosine, cosine * tangent


def _dot(a: Array, b: Array) -> Array:
    """Return the scalar product (..., 1), summed in order."""
    found = a[..., :1] * b[..., :1]
    for i in range(1, a.shape[-1]):
        found = found + a[..., i : i + 1] * b[..., i : i + 1]
    return found
