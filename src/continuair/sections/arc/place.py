"""Device code of points of an arc's backbone, in closed form, in units of its λ.

The part of an arc from its base to a point is itself an arc of the same curvature.
"""

from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Any

import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, holding
from continuair.device.types import FULL_LENGTH, Tree, device_types


@dataclass(frozen=True)
class PlaceCode:
    """Place, a struct, and its functions, defined below."""

    Place: Any
    place: Any
    swept_by: Any
    turned_by: Any
    pushed_by: Any


@cache
def place_code(numbers: Numbers, tree: Tree) -> PlaceCode:
    """Return the functions for one kind of numbers and tree."""
    types = device_types(numbers, tree)
    Real, vec2, vec3, quat = types.Real, types.vec2, types.vec3, types.quat
    zero, quarter, half, one, two = (Real(x) for x in (0.0, 0.25, 0.5, 1.0, 2.0))
    full, Series = Real(FULL_LENGTH), wp.types.vector(6, Real)
    polynomial = elementary_code(numbers).polynomial
    series_3, series_4 = (
        polynomial([(-1.0) ** k / factorial(2 * k + m) for k in reversed(range(8))]) for m in (3, 4)
    )

    @wp.struct
    class Place:
        """Point relative to the base [m], and rotation there, about (-b_y, b_x) by -|b| σ.

        share, unit, b, db: share of the length, λ, bend and rate of the part up to the point.
        A, dA, dB, Gamma: A, A', B', Γ there.
        """

        point: vec3
        turn: quat
        share: Real
        unit: Real
        b: vec2
        db: vec2
        A: Real
        dA: Real
        dB: Real
        Gamma: Real

    @wp.func
    def stumpff(z: Real):
        """Return c_1 … c_4 of z, and c_0 and c_1 of z/4.

        Series at z/64 are followed by three double-angle steps; c_0 is 1 - z c_2.
        """
        t = z * Real(0.015625)
        c3 = series_3(t)
        c4 = series_4(t)
        c1 = one - t * c3
        c2 = half - t * c4
        before = vec2(one, c1)
        for _ in range(3):
            c0 = one - t * c2
            before = vec2(c0, c1)
            c4 = Real(0.125) * c3 * (one + c1)
            c3 = (c2 + c0 * c3) * quarter
            c2 = half * c1 * c1
            c1 = c0 * c1
            t = Real(4.0) * t
        return Series(c1, c2, c3, c4, before[0], before[1])

    @wp.func
    def place(b: vec2, db: vec2, unit: Real, share: Real):
        """Return the Place at a share of an arc with given bend, rate and λ."""
        out = Place()
        out.share = share
        out.unit = share * unit
        out.b = share * b
        out.db = share * db
        b = out.b
        c = stumpff(full * full * wp.dot(b, b))
        A = full * full * c[1]
        out.A = A
        out.dA = full * full * full * full * (c[3] - half * c[2])
        out.dB = half * full * full * full * (c[2] - c[1])
        out.Gamma = full * full * full * c[2]
        out.point = out.unit * vec3(A * b[0], A * b[1], -full * c[0])
        s = half * full * c[5]
        out.turn = quat(s * b[1], -s * b[0], zero, c[4])
        return out

    @wp.func
    def along_bend(a: Real, d_a: Real, d_beta: Real, b: vec2, force: vec3):
        """Return Jᵀ force of a point at (a b, -β); d_a, d_beta: derivatives in u."""
        h = vec2(force[0], force[1])
        return a * h + two * (d_a * wp.dot(b, h) - d_beta * force[2]) * b

    @wp.func
    def pushed_by(at: Place, force: vec3, moment: vec3):
        """Return Jᵀ (force, moment), the generalised force on the bend of a wrench at a place."""
        b = at.b
        twist = at.A * moment[2] - at.Gamma * (b[0] * moment[0] + b[1] * moment[1])
        bend = at.unit * along_bend(at.A, at.dA, at.dB, b, force)
        pushed = bend + full * vec2(-moment[1], moment[0]) + twist * vec2(-b[1], b[0])
        return at.share * pushed

    @wp.func
    def swept_by(at: Place):
        """Return the velocity from the bend rate [m/s], in axes of the base."""
        b, db = at.b, at.db
        along = two * wp.dot(b, db)
        return at.unit * vec3(
            at.A * db[0] + at.dA * along * b[0],
            at.A * db[1] + at.dA * along * b[1],
            -at.dB * along,
        )

    @wp.func
    def turned_by(at: Place):
        """Return the angular velocity from the bend rate, in axes of the base."""
        b, db = at.b, at.db
        across = b[0] * db[1] - b[1] * db[0]
        return vec3(
            full * db[1] - at.Gamma * b[0] * across,
            -full * db[0] - at.Gamma * b[1] * across,
            at.A * across,
        )

    return holding(PlaceCode, locals())
