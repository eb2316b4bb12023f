"""Device code of elastic and damping forces between coordinates, which tapered sections have.

Stiffness and damping of each coordinate are in `Plant.stiffness` and `Plant.damping`; those between
the pairs of `Tree.couples` are in `Plant.stiffness_between` and `Plant.damping_between`.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types


@dataclass(frozen=True)
class Elastic:
    """Functions of the Plant, None for a tree without pairs.

    between(plant, b, db): forces (bends,) between coordinates; springs(plant, b): without damping.
    """

    between: Any
    springs: Any
    pairs: int
    first: Any
    second: Any


@cache
def elastic_code(numbers: Numbers, tree: Tree) -> Elastic:
    """Return the functions for one kind of numbers and a tree of arms."""
    types, pairs = device_types(numbers, tree), len(tree.couples)
    if not pairs:
        return Elastic(None, None, 0, None, None)
    Bends, Plant = types.Bends, types.Plant
    Indices = wp.types.vector(pairs, wp.int32)
    first, second = (Indices(*(pair[side] for pair in tree.couples)) for side in (0, 1))

    @wp.func
    def springs(plant: Plant, b: Bends):
        out = Bends()
        for p in range(pairs):
            j = first[p]
            k = second[p]
            out[j] = out[j] + plant.stiffness_between[p] * b[k]
            out[k] = out[k] + plant.stiffness_between[p] * b[j]
        return out

    @wp.func
    def between(plant: Plant, b: Bends, db: Bends):
        out = Bends()
        for p in range(pairs):
            j = first[p]
            k = second[p]
            K, D = plant.stiffness_between[p], plant.damping_between[p]
            out[j] = out[j] + (K * b[k] + D * db[k])
            out[k] = out[k] + (K * b[j] + D * db[j])
        return out

    return holding(Elastic, locals())
