"""Device code of a section with a strain field as a body on its own base, and of its tip.

The axes R of the cross-sections at the nodes are a power series in the coordinates; all else are
integrals along the arm of values at the nodes, with the integration matrix A of the nodes (rows: to
each node, and to the end),

    p = l A R ε,    W = A R ∂κ/∂q,    P = l A (W × R ε + R ∂ε/∂q),
    α = A (w × R κ̇),    a = l A (α × R ε + w × (w × R ε + 2 R ε̇)),

with w = W q̇, v = P q̇ and accelerations a and α of a section on a base at rest, at q̈ = 0. With
x = v' + share w, the bias B((w, q̇), (v', share q̇)) of sections/kind.py is

    force   share f0 + x×(F q̇) + (w×(v'×H) + v'×(w×H))/2
    moment  share n0 + E x + (w×I v' + v'×I w)/2
    on q    share b0 + Xᵀ x + w·S v'

Warp reads annotations as types, so they are not postponed here.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.types import Tree, device_types
from continuair.sections.kind import section_types
from continuair.sections.strain.native import section_text
from continuair.vehicle.strain import Orders

BODIES = ("place", "mass", "transverse", "axial", "length")
"""Rows of the table after the integration matrix: places of the nodes, from 0 to 1, masses [kg] and
inertias [kg m²] there, and the length of the section [m]."""


@dataclass(frozen=True)
class ElementCode:
    """Structs and functions of a section, defined below."""

    Shape: Any
    Motion: Any
    shape: Any
    motion: Any
    element: Any
    full_bias: Any
    turning_bias: Any
    bending_bias: Any
    first_bending: Any
    own_bending: Any
    joint: Any
    carried: Any


@cache
def element_code(
    numbers: Numbers, tree: Tree, orders: Orders, nodes: int, section: int
) -> ElementCode:
    """Return the functions for one kind of numbers and a section of a tree."""
    types, n = device_types(numbers, tree), len(orders.coordinates)
    own = section_types(numbers, tree, n)
    Element, Bias, Joint, Carried = own.Element, own.Bias, own.Joint, own.Carried
    Columns, Coordinates, Square = own.Columns, own.Coordinates, own.Square
    Real, Row, Table, State, Plant = types.Real, types.Row, types.Table, types.State, types.Plant
    vec3, mat33 = types.vec3, types.mat33
    row_of = number_code(numbers).row_reader(Row)
    Symmetric = wp.types.matrix((6, n), Real)
    Rows = wp.types.matrix((nodes + 1 + len(BODIES), Row._length_), Real)
    half, one, zero = Real(0.5), Real(1.0), Real(0.0)
    first_row, rows_of_section = tree.first_row[section], nodes + 1 + len(BODIES)
    B = types.layout.bend_of(section).start
    DB = types.layout.bend_rate_of(section).start

    @wp.struct
    class Shape:
        """The element H, I, F, L and N; its bias: f0, n0, b0, E (exchange), X (across) and S
        (centrifugal, xx xy xz yy yz zz); the tip: p, R, P, W, v, w, a and α."""

        H: vec3
        I: mat33
        F: Columns
        L: Columns
        N: Square
        force: vec3
        moment: vec3
        coordinates: Coordinates
        exchange: mat33
        across: Columns
        centrifugal: Symmetric
        p: vec3
        R: mat33
        P: Columns
        W: Columns
        moved: vec3
        turned: vec3
        base: vec3
        spin: vec3

    @wp.struct
    class Motion:
        """Momentum F q̇."""

        momentum: vec3

    @wp.func_native(section_text(orders, nodes))
    def fill(out: wp.ref[Shape], rows: Rows, q: Coordinates, rates: Coordinates): ...

    @wp.func
    def shape(y: State, table: Table, vehicle: int):
        q = Coordinates()
        rates = Coordinates()
        for c in range(n):
            q[c] = y[B + c]
            rates[c] = y[DB + c]
        rows = Rows()
        for i in range(rows_of_section):
            rows[i] = row_of(table, vehicle, first_row + i)
        out = Shape()
        fill(out, rows, q, rates)
        return out

    @wp.func
    def motion(y: State, s: Shape):
        F = s.F
        rates = Coordinates()
        for c in range(n):
            rates[c] = y[DB + c]
        out = Motion()
        out.momentum = F * rates
        return out

    @wp.func
    def element(plant: Plant, s: Shape, m: Motion):
        out = Element()
        out.H = s.H
        out.I = s.I
        out.F = s.F
        out.L = s.L
        out.N = s.N
        return out

    @wp.func
    def bias_of(s: Shape, m: Motion, w: vec3, v: vec3, share: Real):
        """Return B((w, q̇), (v, share q̇)) for a share of 0 or 1."""
        out = Bias()
        x = v + share * w
        H, I, S = s.H, s.I, s.centrifugal
        out.force = share * s.force + wp.cross(x, m.momentum)
        out.force += half * (wp.cross(w, wp.cross(v, H)) + wp.cross(v, wp.cross(w, H)))
        out.moment = share * s.moment + s.exchange * x
        out.moment += half * (wp.cross(w, I * v) + wp.cross(v, I * w))
        pushed = share * s.coordinates + wp.transpose(s.across) * x
        xy = w[0] * v[1] + w[1] * v[0]
        xz = w[0] * v[2] + w[2] * v[0]
        yz = w[1] * v[2] + w[2] * v[1]
        for c in range(n):
            squares = S[0, c] * (w[0] * v[0]) + S[3, c] * (w[1] * v[1]) + S[5, c] * (w[2] * v[2])
            pushed[c] = pushed[c] + (squares + S[1, c] * xy + S[2, c] * xz + S[4, c] * yz)
        out.coordinates = pushed
        return out

    @wp.func
    def full_bias(s: Shape, e: Element, m: Motion, w: vec3):
        return bias_of(s, m, w, w, one)

    @wp.func
    def turning_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        return bias_of(s, m, w, v, zero)

    @wp.func
    def bending_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        return bias_of(s, m, w, v, one)

    @wp.func
    def first_bending(s: Shape, e: Element, m: Motion, w: vec3):
        return bias_of(s, m, w, vec3(), one)

    @wp.func
    def own_bending(s: Shape, m: Motion):
        return s.coordinates

    @wp.func
    def joint(plant: Plant, s: Shape, m: Motion):
        out = Joint()
        out.p = s.p
        out.R = s.R
        out.P = s.P
        out.W = s.W
        out.moved = s.moved
        out.turned = s.turned
        return out

    @wp.func
    def carried(plant: Plant, s: Shape, m: Motion):
        out = Carried()
        out.base = s.base
        out.spin = s.spin
        return out

    return holding(ElementCode, locals())
