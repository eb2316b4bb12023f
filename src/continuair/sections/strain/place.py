"""Device code of points of the backbone of a section with a strain field, and of motion there.

The part from the base to a share of the length is integrated at its own Gauss nodes. With columns
c = R ∂κ/∂q and m = R ∂ε/∂q there, the point p at the end moves by l ∫ (c × (p - p(s)) + m).
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.types import Tree, device_types
from continuair.sections.kind import section_types
from continuair.sections.strain.field import field_code
from continuair.sections.strain.nodes import gauss, integration
from continuair.vehicle.strain import Orders


@dataclass(frozen=True)
class PlaceCode:
    """Place, a struct, and its functions, defined below."""

    Place: Any
    place: Any
    swept_by: Any
    turned_by: Any
    pushed_by: Any


@cache
def place_code(numbers: Numbers, tree: Tree, orders: Orders, nodes: int, section: int) -> PlaceCode:
    """Return the functions for one kind of numbers and a section of a tree."""
    types, field = device_types(numbers, tree), field_code(numbers, tree, orders, nodes)
    n, turning = len(orders.coordinates), orders.turning
    own = section_types(numbers, tree, n)
    Columns, Coordinates, Cell = own.Columns, own.Coordinates, number_code(numbers).Cell
    Real, State, Plant, vec3, quat = types.Real, types.State, types.Plant, types.vec3, types.quat
    series_of, axes_at, advance_of = field.series_of, field.axes_at, field.advance_of
    turning_columns, moving_columns = field.turning_columns, field.moving_columns
    Turns, Moves, moving = field.Turns, field.Moves, n - turning
    Three = wp.types.matrix((nodes, 3), Real)
    TurnsAtNodes = wp.types.matrix((nodes, Turns._length_), Real)
    Weights, Integrals = wp.types.vector(nodes, Cell), wp.types.matrix((nodes, nodes), Cell)
    points, weights = gauss(nodes)
    at_nodes, weight, to_nodes = (
        Weights(*points), Weights(*weights), Integrals(*integration(points)[:-1].ravel()),
    )  # fmt: skip
    one, two = Real(1.0), Real(2.0)
    length_at = types.layout.of_section[section].start
    B = types.layout.bend_of(section).start
    DB = types.layout.bend_rate_of(section).start

    @wp.struct
    class Place:
        """Point relative to the base [m], axes there, and columns of its velocity and turning."""

        point: vec3
        turn: quat
        P: Columns
        W: Columns
        rates: Coordinates

    @wp.func
    def place(y: State, plant: Plant, share: Real):
        out = Place()
        q = Coordinates()
        for c in range(n):
            q[c] = y[B + c]
            out.rates[c] = y[DB + c]
        series = series_of(q)
        base = wp.quat_inverse(axes_at(series, -one))
        out.turn = base * axes_at(series, two * share - one)
        scale = share * plant.unit[length_at]
        advance = Three()
        turns = TurnsAtNodes()
        moved = Moves()
        count = wp.int32(nodes)
        for i in range(count):
            at = two * share * Real(at_nodes[i]) - one
            R = wp.quat_to_matrix(base * axes_at(series, at))
            x_axis = vec3(R[0, 0], R[1, 0], R[2, 0])
            y_axis = vec3(R[0, 1], R[1, 1], R[2, 1])
            z_axis = vec3(R[0, 2], R[1, 2], R[2, 2])
            t = scale * advance_of(q, at, x_axis, y_axis, z_axis)
            advance[i] = t
            out.point += Real(weight[i]) * t
            turns[i] = share * turning_columns(at, x_axis, y_axis, z_axis)
            if wp.static(moving > 0):
                moved += (Real(weight[i]) * scale) * moving_columns(at, x_axis, y_axis, z_axis)
        for i in range(count):
            p = vec3()
            for k in range(count):
                p += Real(to_nodes[i, k]) * vec3(advance[k, 0], advance[k, 1], advance[k, 2])
            lever = Real(weight[i]) * (out.point - p)
            for c in range(turning):
                turn = vec3(turns[i, 3 * c], turns[i, 3 * c + 1], turns[i, 3 * c + 2])
                swept = wp.cross(turn, lever)
                for j in range(3):
                    out.P[j, c] = out.P[j, c] + swept[j]
                    out.W[j, c] = out.W[j, c] + Real(weight[i]) * turn[j]
        for c in range(moving):
            for j in range(3):
                out.P[j, turning + c] = moved[3 * c + j]
        return out

    @wp.func
    def swept_by(at: Place):
        return at.P * at.rates

    @wp.func
    def turned_by(at: Place):
        return at.W * at.rates

    @wp.func
    def pushed_by(at: Place, force: vec3, moment: vec3):
        return wp.transpose(at.P) * force + wp.transpose(at.W) * moment

    return holding(PlaceCode, locals())
