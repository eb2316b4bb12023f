"""Vectors and matrices of mpmath's numbers, as lists, and rotations made of them."""

from __future__ import annotations

from typing import Any

from mpmath import mp, mpf

Vector = list[Any]
Matrix = list[Vector]


def exact(value: Any) -> Any:
    """Numbers, also nested in lists and dictionaries, as mpf of the same value."""
    if isinstance(value, dict):
        return {name: exact(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [exact(each) for each in value]
    return None if value is None else mpf(value)


def dot(a: Vector, b: Vector) -> Any:
    """The scalar product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), mpf(0))


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def plus(a: Vector, b: Vector) -> Vector:
    """The sum of two vectors."""
    return [x + y for x, y in zip(a, b, strict=True)]


def scaled(factor: Any, a: Vector) -> Vector:
    """A multiple of a vector."""
    return [factor * x for x in a]


def apply(M: Matrix, a: Vector) -> Vector:
    """A matrix times a vector."""
    return [dot(row, a) for row in M]


def transposed(M: Matrix) -> Matrix:
    """The transpose."""
    return [list(column) for column in zip(*M, strict=True)]


def product(M: Matrix, N: Matrix) -> Matrix:
    """The product of two matrices."""
    columns = transposed(N)
    return [[dot(row, column) for column in columns] for row in M]


def skew_part(M: Matrix) -> Vector:
    """The vector a of [a]×, the skew part of a matrix (3, 3)."""
    return [(M[2][1] - M[1][2]) / 2, (M[0][2] - M[2][0]) / 2, (M[1][0] - M[0][1]) / 2]


def turn(angles: Vector) -> Matrix:
    """The rotation by a rotation vector, of any length from 0 on."""
    half = mp.sqrt(dot(angles, angles)) / 2
    return from_quaternion([*scaled(mp.sinc(half) / 2, angles), mp.cos(half)])


def from_quaternion(q: Vector) -> Matrix:
    """The rotation of a quaternion x y z w of any length."""
    x, y, z, w = q
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    M = [
        [ww + xx - yy - zz, 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), ww - xx + yy - zz, 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), ww - xx - yy + zz],
    ]
    square = xx + yy + zz + ww
    return [[each / square for each in row] for row in M]


def largest_gap(found: Any, expected: Any) -> Any:
    """The largest difference between lists of any depth, as a share of the largest expected."""
    pairs = list(zip(_flat(found), _flat(expected), strict=True))
    return max(abs(a - b) for a, b in pairs) / max(abs(b) for _, b in pairs)


def _flat(value: Any) -> Vector:
    return [x for each in value for x in _flat(each)] if isinstance(value, list) else [value]
