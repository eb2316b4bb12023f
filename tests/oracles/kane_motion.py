"""How the pieces of an aerial continuum manipulator move: central differences of their poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpmath import mpf

from tests.oracles.kane_algebra import Matrix, Vector, product, skew_part, transposed
from tests.oracles.kane_body import Configuration, Piece, Pose, moved, poses


@dataclass(frozen=True)
class PartialMotion:
    """How a piece moves and turns per unit of every speed, (n, 3) each, in world axes."""

    velocity: Matrix
    spin: Matrix


@dataclass(frozen=True)
class Motion:
    """Of a piece, in world axes: velocity and spin, acceleration and angular acceleration."""

    velocity: Vector
    spin: Vector
    acceleration: Vector
    spin_rate: Vector


def motions(
    body: list[Piece],
    vehicle: Any,
    at: Configuration,
    u: Vector,
    h: Any,
    change: Vector | None = None,
) -> list[Motion]:
    """Of all pieces, by differences over a time h; change: u̇, or none."""
    times = [poses(body, vehicle, moved(at, u, t, change)) for t in (-h, mpf(0), h)]
    found = []
    for (p0, R0), (p1, R1), (p2, R2) in zip(*times, strict=True):
        velocity, acceleration = rate(p0, p2, h), _second_rate(p0, p1, p2, h)
        # [ω̇]× is the skew part of R̈ Rᵀ, whose other part is [ω]×².
        turning = [_second_rate(*rows, h) for rows in zip(R0, R1, R2, strict=True)]
        spin_rate = skew_part(product(turning, transposed(R1)))
        found.append(Motion(velocity, spin(R0, R1, R2, h), acceleration, spin_rate))
    return found


def partial_motions(
    body: list[Piece], vehicle: Any, at: Configuration, n: int, h: Any
) -> list[PartialMotion]:
    """Of all pieces, for n speeds."""
    sides = []
    for j in range(n):
        unit = [mpf(i == j) for i in range(n)]
        sides.append([poses(body, vehicle, moved(at, unit, t)) for t in (-h, h)])
    return differences(poses(body, vehicle, at), sides, h)


def differences(here: list[Pose], sides: list[list[list[Pose]]], h: Any) -> list[PartialMotion]:
    """Motions of all pieces from their poses and, by speed, those a step before and after."""
    found = [PartialMotion([], []) for _ in here]
    for before, after in sides:
        for partial, (_, R), (p0, R0), (p2, R2) in zip(found, here, before, after, strict=True):
            partial.velocity.append(rate(p0, p2, h))
            partial.spin.append(spin(R0, R, R2, h))
    return found


def rate(before: Vector, after: Vector, h: Any) -> Vector:
    """The first derivative, from a step h on either side."""
    return [(b - a) / (2 * h) for a, b in zip(before, after, strict=True)]


def spin(before: Matrix, here: Matrix, after: Matrix, h: Any) -> Vector:
    """The angular velocity ω of axes R in the axes that they are given in: [ω]× = Ṙ Rᵀ."""
    turning = [rate(*rows, h) for rows in zip(before, after, strict=True)]
    return skew_part(product(turning, transposed(here)))


def _second_rate(before: Vector, here: Vector, after: Vector, h: Any) -> Vector:
    return [(a - 2 * b + c) / h**2 for a, b, c in zip(before, here, after, strict=True)]


def inertia_in_world(piece: Piece, axes: Matrix) -> Matrix:
    """A piece's inertia about its centre in world axes."""
    return product(product(axes, piece.inertia), transposed(axes))
