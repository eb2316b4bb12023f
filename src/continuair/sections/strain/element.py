"""Device code of a section with a strain field as a body on its own base, and of its tip.

The axes R of the cross-sections at the nodes are a power series in the coordinates; all else are
integrals along the arm of values at the nodes, with the integration matrix A of the nodes (rows: to
each node, and to the end),

    p = l A R ε,    W = A R ∂κ/∂q,    P = l A (W × R ε + R ∂ε/∂q),
    α = A (w × R κ̇),    a = l A (α × R ε + w × (w × R ε + 2 R ε̇)),

with w = W q̇, v = P q̇ and accelerations a and α of a section on a base at rest, at q̈ = 0. Biases are
sums over the nodes of what the symmetric form of z = (ω, q̇) and z' = (ω', q̇') asks of the slices,

    a_i = a + ω×(ω'×p/2 + v') + ω'×(ω×p/2 + v),    α_i = α + (ω×w' + ω'×w)/2,
    n_i = J α_i + (s×J s' + s'×J s)/2,    s = ω + w,    s' = ω' + w',

with a and α only if z' has the rates, too. They are summed with the element, as ω is known by then.

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
    Rows = wp.types.matrix((nodes + 1 + len(BODIES), Row._length_), Real)
    first_row, rows_of_section = tree.first_row[section], nodes + 1 + len(BODIES)
    B = types.layout.bend_of(section).start
    DB = types.layout.bend_rate_of(section).start

    @wp.struct
    class Shape:
        """The element H, I, F, L and N; the bias B(z, (v, q̇)), and B(z, (w - v, 0)) of turning;
        the tip: p, R, P, W, v, w, a and α."""

        H: vec3
        I: mat33
        F: Columns
        L: Columns
        N: Square
        force: vec3
        moment: vec3
        coordinates: Coordinates
        turning_force: vec3
        turning_moment: vec3
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
        """Nothing: Shape has it all."""

        none: Real

    @wp.func_native(section_text(orders, nodes))
    def fill(
        out: wp.ref[Shape],
        rows: wp.ref[Rows],
        q: Coordinates,
        rates: Coordinates,
        w_: vec3,
        v_: vec3,
    ): ...

    @wp.func
    def shape(y: State, table: Table, vehicle: int, w: vec3, v: vec3):
        q = Coordinates()
        rates = Coordinates()
        for c in range(n):
            q[c] = y[B + c]
            rates[c] = y[DB + c]
        rows = Rows()
        for i in range(rows_of_section):
            rows[i] = row_of(table, vehicle, first_row + i)
        out = Shape()
        fill(out, rows, q, rates, w, v)
        return out

    @wp.func
    def motion(y: State, s: Shape):
        return Motion()

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
    def bending(s: Shape):
        out = Bias()
        out.force = s.force
        out.moment = s.moment
        out.coordinates = s.coordinates
        return out

    @wp.func
    def full_bias(s: Shape, e: Element, m: Motion, w: vec3):
        return bending(s)

    @wp.func
    def turning_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        out = Bias()
        out.force = s.turning_force
        out.moment = s.turning_moment
        return out

    @wp.func
    def bending_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        return bending(s)

    @wp.func
    def first_bending(s: Shape, e: Element, m: Motion, w: vec3):
        return bending(s)

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
