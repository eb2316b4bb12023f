"""Device code of points of the backbone of a section with a strain field, and of motion there.

The part from the base to a share of the length is integrated at its own Gauss nodes. With columns
c = R ∂κ/∂q and m = R ∂ε/∂q there, the point p at the end moves by l ∫ (c × (p - p(s)) + m).
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types
from continuair.sections.kind import section_types
from continuair.sections.strain.native import place_text
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
    types, n = device_types(numbers, tree), len(orders.coordinates)
    own = section_types(numbers, tree, n)
    Columns, Coordinates = own.Columns, own.Coordinates
    Real, State, Plant, vec3, quat = types.Real, types.State, types.Plant, types.vec3, types.quat
    points, weights = gauss(nodes)
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

    @wp.func_native(place_text(orders, nodes, points, weights, integration(points)[:-1]))
    def fill(out: wp.ref[Place], q: Coordinates, length: Real, share: Real): ...

    @wp.func
    def place(y: State, plant: Plant, share: Real):
        out = Place()
        q = Coordinates()
        rates = Coordinates()
        for c in range(n):
            q[c] = y[B + c]
            rates[c] = y[DB + c]
        fill(out, q, plant.unit[length_at], share)
        out.rates = rates
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
