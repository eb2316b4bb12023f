"""Device code of an arc as a body with two coordinates, its bend b, about its own base.

Lengths along the arc are in units of its λ (sections/arc/moments.py). The rows and the parts of
their biases are those of sections/kind.py, with J_c for F, J for L and q for b;
docs/explanation/fast_form.md derives every term. Warp reads annotations as types, so they are not
postponed here.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.types import Tree, device_types
from continuair.sections.arc.moments import MOMENTS, TERMS
from continuair.sections.kind import section_types
from continuair.vehicle.arc import COORDINATES


@dataclass(frozen=True)
class ElementCode:
    """Structs and functions of an arc, defined and documented below."""

    Shape: Any
    Motion: Any
    shape: Any
    motion: Any
    element: Any
    full_bias: Any
    turning_bias: Any
    bending_bias: Any
    own_bending: Any
    first_bending: Any


@cache
def element_code(numbers: Numbers, tree: Tree) -> ElementCode:
    """Return the functions for one kind of numbers and the types of a tree."""
    types, own = device_types(numbers, tree), section_types(numbers, tree, COORDINATES)
    Element, Bias, Columns, Square = own.Element, own.Bias, own.Columns, own.Square
    Real, Row, Table = types.Real, types.Row, types.Table
    row_of = number_code(numbers).row_reader(Row)
    vec2, vec3, mat33 = types.vec2, types.vec3, types.mat33
    alpha, beta, P, Q, S, KP, KQ, KW, NP, ND, A, Gamma = range(len(MOMENTS))
    quarter, half, two = Real(0.25), Real(0.5), Real(2.0)
    others = tree.table_rows - TERMS

    @wp.struct
    class Shape:
        """Moments of an arc at u = |b|², their derivatives in u, and four second derivatives."""

        f: Row
        d: Row
        dd_alpha: Real
        dd_beta: Real
        dd_A: Real
        dd_Gamma: Real

    @wp.struct
    class Motion:
        """Bend of an arc: b, ḃ, u, u̇, b×ḃ; the rate of the first moment, and J ḃ."""

        b: vec2
        db: vec2
        u: Real
        du: Real
        c: Real
        moved: vec3
        turned: vec3

    @wp.func
    def shape(table: Table, vehicle: int, first: int, u: Real):
        """Evaluate the polynomials of an arc at its bend; first: its first row in the table."""
        w = u - Real(1.0)
        f = Row()
        d = Row()
        sa = Real(0.0)
        sb = Real(0.0)
        sA = Real(0.0)
        sG = Real(0.0)
        # This equals TERMS, but not as a constant: the compiler does not unroll the loop.
        terms = table.shape[1] - others
        for j in range(terms):
            sa = sa * w + d[alpha]
            sb = sb * w + d[beta]
            sA = sA * w + d[A]
            sG = sG * w + d[Gamma]
            d = d * w + f
            f = f * w + row_of(table, vehicle, first + j)
        out = Shape()
        out.f = f
        out.d = d
        out.dd_alpha = Real(2.0) * sa
        out.dd_beta = Real(2.0) * sb
        out.dd_A = Real(2.0) * sA
        out.dd_Gamma = Real(2.0) * sG
        return out

    @wp.func
    def motion(s: Shape, b: vec2, db: vec2):
        out = Motion()
        out.b = b
        out.db = db
        out.u = wp.dot(b, b)
        out.du = two * wp.dot(b, db)
        out.c = b[0] * db[1] - b[1] * db[0]
        lift = s.d[alpha] * out.du
        out.moved = vec3(
            s.f[alpha] * db[0] + lift * b[0], s.f[alpha] * db[1] + lift * b[1], -s.d[beta] * out.du
        )
        spin = s.f[KW] * out.du
        out.turned = vec3(
            s.f[KQ] * db[1] + spin * b[1], -s.f[KQ] * db[0] - spin * b[0], s.f[KP] * out.c
        )
        return out

    @wp.func
    def element(s: Shape, axial: Real, m: Motion):
        out = Element()
        x = m.b[0]
        y = m.b[1]
        u = m.u
        f = s.f
        out.H = vec3(f[alpha] * x, f[alpha] * y, -f[beta])
        d = axial + u * f[P] + f[S]
        xy = -f[P] * x * y
        xz = f[Q] * x
        yz = f[Q] * y
        out.I = mat33(d - f[P] * x * x, xy, xz, xy, d - f[P] * y * y, yz, xz, yz, d - f[S])
        ca = two * s.d[alpha]
        cb = -two * s.d[beta]
        caxy = ca * x * y
        out.F = Columns(
            f[alpha] + ca * x * x, caxy,
            caxy, f[alpha] + ca * y * y,
            cb * x, cb * y,
        )  # fmt: skip
        kw = two * f[KW]
        out.L = Columns(
            kw * x * y, f[KQ] + kw * y * y,
            -f[KQ] - kw * x * x, -kw * x * y,
            -f[KP] * y, f[KP] * x,
        )  # fmt: skip
        n = f[ND] * x * y
        out.N = Square(f[NP] + f[ND] * x * x, n, n, f[NP] + f[ND] * y * y)
        return out

    @wp.func
    def second_rate(s: Shape, m: Motion):
        """Return d²H/dt² at b̈ = 0, in axes of the base."""
        ddu = two * wp.dot(m.db, m.db)
        lift = two * s.d[alpha] * m.du
        out = s.d[alpha] * ddu + s.dd_alpha * m.du * m.du
        up = s.d[beta] * ddu + s.dd_beta * m.du * m.du
        return vec3(lift * m.db[0] + out * m.b[0], lift * m.db[1] + out * m.b[1], -up)

    @wp.func
    def second_turn(s: Shape, m: Motion):
        """Return the rate of J ḃ at b̈ = 0, in axes of the base."""
        ddu = two * wp.dot(m.db, m.db)
        turn = (s.d[KQ] + s.f[KW]) * m.du
        twist = s.d[KW] * m.du * m.du + s.f[KW] * ddu
        b, db = m.b, m.db
        return vec3(turn * db[1] + twist * b[1], -turn * db[0] - twist * b[0], s.d[KP] * m.du * m.c)

    @wp.func
    def exchange(s: Shape, m: Motion, w: vec3):
        """Return İ ω, from the change of inertia with the bend."""
        b, db = m.b, m.db
        bw = b[0] * w[0] + b[1] * w[1]
        dbw = db[0] * w[0] + db[1] * w[1]
        on_b = m.du * (s.d[Q] * w[2] - s.d[P] * bw) - s.f[P] * dbw
        on_db = s.f[Q] * w[2] - s.f[P] * bw
        on_z = m.du * (s.d[Q] * bw - s.d[S] * w[2]) + s.f[Q] * dbw
        on_w = m.du * (s.f[P] + m.u * s.d[P] + s.d[S])
        return on_w * w + vec3(on_b * b[0] + on_db * db[0], on_b * b[1] + on_db * db[1], on_z)

    @wp.func
    def own_bending(s: Shape, m: Motion):
        """Return q of an arc whose base does not rotate: Ṅ ḃ - ½ ∂(ḃᵀ N ḃ)/∂b."""
        ddu = two * wp.dot(m.db, m.db)
        along = quarter * s.d[ND] * m.du * m.du + half * (s.f[ND] - s.d[NP]) * ddu
        return s.d[NP] * m.du * m.db + along * m.b

    @wp.func
    def across(s: Shape, m: Motion, w: vec3):
        """Return half the coefficient of the part of q linear in both w and ḃ."""
        bw = m.b[0] * w[0] + m.b[1] * w[1]
        return (s.d[KQ] - s.f[KW]) * bw + (s.f[KP] + m.u * s.d[KP]) * w[2]

    @wp.func
    def centrifugal(s: Shape, m: Motion, w: vec3, v: vec3):
        """Return -½ ∂(ωᵀ I ω)/∂b, as a symmetric form in w and v."""
        bw = m.b[0] * w[0] + m.b[1] * w[1]
        bv = m.b[0] * v[0] + m.b[1] * v[1]
        slope = s.f[P] + m.u * s.d[P] + s.d[S]
        along = slope * wp.dot(w, v) - s.d[P] * bw * bv - s.d[S] * w[2] * v[2]
        along += s.d[Q] * (bw * v[2] + bv * w[2])
        of_w = half * (s.f[P] * bw - s.f[Q] * w[2])
        of_v = half * (s.f[P] * bv - s.f[Q] * v[2])
        return of_w * vec2(v[0], v[1]) + of_v * vec2(w[0], w[1]) - along * m.b

    @wp.func
    def full_bias(s: Shape, e: Element, m: Motion, w: vec3):
        """Return B(z, z)."""
        out = Bias()
        out.force = wp.cross(w, wp.cross(w, e.H) + two * m.moved) + second_rate(s, m)
        out.moment = wp.cross(w, e.I * w + m.turned) + exchange(s, m, w) + second_turn(s, m)
        rate = two * across(s, m, w)
        out.coordinates = (
            own_bending(s, m) + rate * vec2(-m.db[1], m.db[0]) + centrifugal(s, m, w, w)
        )
        return out

    @wp.func
    def turning_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        """Return force and moment of B(z, (v, 0)); w: of z."""
        out = Bias()
        out.force = half * (wp.cross(w, wp.cross(v, e.H)) + wp.cross(v, wp.cross(w, e.H)))
        out.force += wp.cross(v, m.moved)
        out.moment = wp.cross(w, e.I * v) + wp.cross(v, e.I * w + m.turned) + exchange(s, m, v)
        out.moment = half * out.moment
        return out

    @wp.func
    def bending_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        """Return B(z, (v, ḃ)) with ḃ of z; w: of z."""
        out = Bias()
        out.force = half * (wp.cross(w, wp.cross(v, e.H)) + wp.cross(v, wp.cross(w, e.H)))
        out.force += wp.cross(w + v, m.moved) + second_rate(s, m)
        out.moment = wp.cross(w, e.I * v + m.turned) + wp.cross(v, e.I * w + m.turned)
        out.moment = half * (out.moment + exchange(s, m, w + v)) + second_turn(s, m)
        rate = across(s, m, w + v)
        out.coordinates = (
            own_bending(s, m) + rate * vec2(-m.db[1], m.db[0]) + centrifugal(s, m, w, v)
        )
        return out

    @wp.func
    def first_bending(s: Shape, e: Element, m: Motion, w: vec3):
        """Return `bending_bias` with v = 0: of the first section of an arm."""
        out = Bias()
        out.force = wp.cross(w, m.moved) + second_rate(s, m)
        out.moment = half * (wp.cross(w, m.turned) + exchange(s, m, w)) + second_turn(s, m)
        out.coordinates = own_bending(s, m) + across(s, m, w) * vec2(-m.db[1], m.db[0])
        return out

    return holding(ElementCode, locals())
