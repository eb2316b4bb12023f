"""Device code of the bend vectors of the arcs in a tree."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types


@dataclass(frozen=True)
class BendCode:
    """Functions of arcs, the sections whose coordinates are a bend vector.

    count: number of arcs. section_of(arc): section of an arc. first_of(section): its first
    coordinate. bend_of(y, section), bend_rate_of(y, section): b and ḃ. pair_of(bends, section):
    pair of an arc among coordinates, or forces, of all sections; plus_pair(bends, section, pair)
    adds to it. with_polar(bends, section, κ, ψa, unit) writes κ [1/m] and ψa in its place, ψa at
    the index angle_at(section). bent(y, section): squared share of a full circle.
    """

    count: int
    section_of: Any
    first_of: Any
    bend_of: Any
    bend_rate_of: Any
    pair_of: Any
    plus_pair: Any
    with_polar: Any
    angle_at: Any
    bent: Any


@cache
def bend_code(numbers: Numbers, tree: Tree) -> BendCode:
    """Return the functions for one kind of numbers and tree."""
    types = device_types(numbers, tree)
    Real, State, Bends, vec2 = types.Real, types.State, types.Bends, types.vec2
    layout, half = types.layout, Real(0.5)
    B, DB = layout.bend.start, layout.bend_rate.start
    arcs = [section for section in range(layout.sections) if tree.kind_of(section).polar]
    count = len(arcs)
    section_of = _chosen(arcs)
    first_of = _chosen([where.start for where in layout.of_section])

    @wp.func
    def bend_of(y: State, section: int):
        first = first_of(section)
        return vec2(y[B + first], y[B + first + 1])

    @wp.func
    def bend_rate_of(y: State, section: int):
        first = first_of(section)
        return vec2(y[DB + first], y[DB + first + 1])

    @wp.func
    def pair_of(bends: Bends, section: int):
        first = first_of(section)
        return vec2(bends[first], bends[first + 1])

    @wp.func
    def plus_pair(bends: Bends, section: int, pair: vec2):
        first = first_of(section)
        bends[first] = bends[first] + pair[0]
        bends[first + 1] = bends[first + 1] + pair[1]
        return bends

    @wp.func
    def with_polar(bends: Bends, section: int, kappa: Real, psi: Real, unit: Bends):
        first = first_of(section)
        bends[first] = kappa / unit[first]
        bends[first + 1] = psi
        return bends

    @wp.func
    def angle_at(section: int):
        return first_of(section) + 1

    @wp.func
    def bent(y: State, section: int):
        return half * wp.length_sq(bend_of(y, section))

    return holding(BendCode, locals())


def _chosen(numbers: list[int]) -> Any:
    """Return the function that selects one of some whole numbers by its index."""

    @wp.func
    def first(index: int):
        return wp.int32(0)

    def among(before: Any, place: int, number: int) -> Any:
        @wp.func
        def found(index: int):
            return wp.where(index == place, wp.int32(number), before(index))

        return found

    found = first
    for place, number in enumerate(numbers):
        found = among(found, place, number)
    return found
