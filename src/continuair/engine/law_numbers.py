"""Which numbers a law may hold: those of which Warp keeps all digits."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any

import numpy as np
import warp as wp

from continuair.engine.law_names import names_of, value_of
from continuair.errors import InputError

_REAL = (wp.float16, wp.bfloat16, wp.float32, wp.float64)
_LARGEST_WHOLE = 2**31 - 1


def check_numbers(function: Any, Real: Any, whose: str = "law") -> None:
    """Raise InputError for numbers of a function of the device that Warp rounds or cuts off.

    Real: the numbers that it computes with; whose: of what the function is, for the sentence.
    """
    called = f"its function {function.func.__name__}"
    for number in _rounded(function, names_of(function), Real):
        raise InputError(
            f"{whose} has the number {number} in {called}, where Warp counts in single precision; "
            f"make it outside of that function, as in number = code.Real({number})."
        )
    for name in _vectors(function):
        raise InputError(
            f"{whose} has {name} in {called}, a vector or matrix from outside of it, of which Warp "
            "keeps too few digits; make it within, of numbers from outside, as in "
            "code.vec3(x, y, z), or give it as a gain."
        )
    if function.adj.has_unresolved_static_expressions:
        raise InputError(
            f"{whose} has a wp.static in {called} that is known while it is compiled alone, and "
            "that Warp does not tell from others; make its numbers outside of that function, each "
            "by a name, or give them as gains."
        )
    for default in _defaults(function):
        raise InputError(
            f"{whose} has the default {default} of an argument in {called}, which Warp does not "
            "tell from others that it has compiled; give it where the function is called."
        )


def _rounded(function: Any, names: dict[str, Any], Real: Any) -> Iterator[Any]:
    """Numbers in single precision, but for those that a type takes as they are, such as Real(0.5),
    and whole numbers beyond Warp's."""
    taken = [
        argument.operand if isinstance(argument, ast.UnaryOp) else argument
        for node in ast.walk(function.adj.tree)
        if isinstance(node, ast.Call) and isinstance(value_of(node.func, names), type)
        for argument in node.args
    ]
    for node in ast.walk(function.adj.tree):
        number: Any = node.value if isinstance(node, ast.Constant) else value_of(node, names)
        if isinstance(node, ast.Call) and _single(value_of(node.func, names), Real):
            yield ast.unparse(node)
        elif isinstance(number, (float, np.floating)):
            if not (node in taken and _exact(number)):
                yield number
        elif isinstance(number, (int, np.integer)) and abs(int(number)) > _LARGEST_WHOLE:
            yield number
        elif type(number) in _REAL and not _printed(number.value):
            yield f"float({number.value})"
        elif _single(type(number), Real) and not _exact(number.value):
            yield number.value


def _vectors(function: Any) -> Iterator[str]:
    """Vectors and matrices that a function has from outside, of numbers with too many digits."""
    names, static = names_of(function), function.adj.resolved_static_expressions
    found = {ast.unparse(node): value_of(node, names) for node in ast.walk(function.adj.tree)}
    for name, value in (found | static).items():
        if getattr(type(value), "_wp_scalar_type_", None) in _REAL and not _short(value):
            yield name


def _short(value: Any) -> bool:
    """Whether the 8 bits that Warp keeps of a pack's vectors hold its numbers, as 0 and 1."""
    if hasattr(value, "_wp_scalar_type_"):
        return all(_short(each) for each in value)
    number = np.float32(getattr(value, "value", value))
    return float(number) == float(value) and not int(number.view(np.uint32)) & 0xFFFF


def _defaults(function: Any) -> Iterator[str]:
    for node in ast.walk(function.adj.tree):
        if isinstance(node, ast.arguments):
            yield from (ast.unparse(each) for each in (*node.defaults, *node.kw_defaults) if each)


def _single(kind: Any, Real: Any) -> bool:
    """Whether a type has fewer digits than the numbers of a law."""
    return kind is float or (kind in (wp.float16, wp.bfloat16, wp.float32) and kind is not Real)


def _exact(number: Any) -> bool:
    """Whether single precision holds it."""
    return float(np.float32(number)) == float(number)


def _printed(number: Any) -> bool:
    """Whether its text holds all its digits, as Warp writes it into C++: 1/3 would be 0 there."""
    try:
        return float(str(number)) == float(number)
    except ValueError:
        return False
