"""A controller's law as it is made now: what it reads from outside is in what it gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import FunctionType, SimpleNamespace
from typing import Any

from continuair.device.numbers import Numbers
from continuair.device.types import Tree
from continuair.engine.compiling import made_alone, made_once
from continuair.engine.law_parts import check_parts, is_ours
from continuair.engine.law_reading import hashed
from continuair.kernels.sensing.sense import LawCode, law_code

Law = Callable[[LawCode], SimpleNamespace]


@dataclass(frozen=True)
class MadeLaw:
    """What a law gave for its LawCode: the same as another one whose content is the same.

    content: what the LawCode is for, and a hash of the law's functions, with the numbers that these
    hold, and of its types. name: of kernels that hold its functions, as no other law's.
    """

    content: Any
    name: str = field(compare=False)
    code: LawCode = field(compare=False)
    parts: SimpleNamespace = field(compare=False)


def made_law(law: Law, precision: str, tree: Tree, points: int, lanes: int = 1) -> MadeLaw:
    """Call a law, each time anew but for those of this package, which read nothing from outside.

    Raises InputError for one without its parts.
    """
    of = law, Numbers(precision, lanes), tree, points
    return _kept(*of) if isinstance(law, FunctionType) and is_ours(law) else _anew(*of)


def made_for_packs(law: Law, precision: str, tree: Tree, points: int, lanes: int) -> MadeLaw | None:
    """The same for packs of runs; None for a law that is not for them."""
    try:
        return made_law(law, precision, tree, points, lanes)
    except Exception:
        # Whatever a law raises that is made of other numbers than it expects.
        return None


def _make(law: Law, numbers: Numbers, tree: Tree, points: int) -> MadeLaw:
    code = law_code(numbers, tree, points)
    parts = law(code)
    check_parts(parts)
    functions = hashed(parts.control)
    content = numbers, tree, points, functions, *_types(parts)
    return MadeLaw(content, f"rollout_{functions.hex()[:16]}", code, parts)


_kept, _anew = made_once(_make), made_alone(_make)


def _types(parts: SimpleNamespace) -> tuple[Any, ...]:
    """What tells the types of a law apart."""
    memory = getattr(parts, "Memory", None)
    remembered = None if memory is None else memory._length_
    return parts.Gains.hash, remembered, getattr(parts, "looks", None)
