"""Device code of a Load, the generalised force of one term."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding


@dataclass(frozen=True)
class LoadCode:
    """Load, a struct, and the sum of two."""

    Load: Any
    plus: Any


@cache
def load_code(numbers: Numbers, tree: Tree) -> LoadCode:
    """Return the struct for one kind of numbers and tree of arms."""
    types = device_types(numbers, tree)
    Bends, vec3 = types.Bends, types.vec3

    @wp.struct
    class Load:
        """Force [N] and moment [N m] about B's origin in body axes, and forces on the bends."""

        force: vec3
        moment: vec3
        bend: Bends

    @wp.func
    def plus(a: Load, b: Load):
        out = Load()
        out.force = a.force + b.force
        out.moment = a.moment + b.moment
        out.bend = a.bend + b.bend
        return out

    return holding(LoadCode, locals())
