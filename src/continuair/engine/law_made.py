"""Control laws after their call with a LawCode, and their identity for caches of kernels."""

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
    """Parts of a law for a LawCode; equal if their content is equal.

    content: arguments of the LawCode, and hashes of the law's functions, with their constants, and
    of its types. name: unique name of kernels with these functions.
    """

    content: Any
    name: str = field(compare=False)
    code: LawCode = field(compare=False)
    parts: SimpleNamespace = field(compare=False)


def made_law(law: Law, precision: str, tree: Tree, points: int, lanes: int = 1) -> MadeLaw:
    """Call a law; results are cached for laws of this package only, which read no outside state.

    Raises InputError if the law does not return its parts.
    """
    of = law, Numbers(precision, lanes), tree, points
    return _kept(*of) if isinstance(law, FunctionType) and is_ours(law) else _anew(*of)


def made_for_packs(law: Law, precision: str, tree: Tree, points: int, lanes: int) -> MadeLaw | None:
    """Return the same for packs of runs, or None if the law does not support them."""
    try:
        return made_law(law, precision, tree, points, lanes)
    except Exception:
        # A law may raise anything with unexpected number types.
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
    """Return values that identify the types of a law."""
    memory = getattr(parts, "Memory", None)
    remembered = None if memory is None else memory._length_
    return parts.Gains.hash, remembered, getattr(parts, "looks", None)
