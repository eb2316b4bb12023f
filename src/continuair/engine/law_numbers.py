"""Check that Warp keeps all digits of the constants in device functions."""

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
    """Raise InputError for constants of a device function that Warp rounds or truncates.

    Real: number type of the function; whose: owner of the function, for the message.
    """
    called = f"its function {function.func.__name__}"
    real = "code.Real" if whose == "law" else "code.types.Real"
    for number in _rounded(function, names_of(function), Real):
        raise InputError(
            whose,
            f"has the number {number} in {called}, where Warp uses single precision",
            f"define it outside of that function, as in number = {real}({number})",
        )
    for name in _vectors(function):
        raise InputError(
            whose,
            f"has {name} in {called}, an outside vector or matrix, which Warp rounds",
            "build it inside, as code.vec3(x, y, z), or make it a gain",
        )
    if function.adj.has_unresolved_static_expressions:
        raise InputError(
            whose,
            f"has a wp.static in {called} that Warp evaluates only during compilation",
            "define its numbers outside of that function by name, or make them gains",
        )
    for default in _defaults(function):
        raise InputError(
            whose,
            (
                f"has the default {default} of an argument in {called}, which Warp does "
                "not distinguish"
            ),
            "give it where the function is called",
        )


def _rounded(function: Any, names: dict[str, Any], Real: Any) -> Iterator[Any]:
    """Yield constants that single precision or Warp's whole numbers do not hold exactly.

    Exact arguments of a type, such as Real(0.5), are left out.
    """
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
    """Yield outside vectors and matrices of a function whose numbers have too many digits."""
    names, static = names_of(function), function.adj.resolved_static_expressions
    found = {ast.unparse(node): value_of(node, names) for node in ast.walk(function.adj.tree)}
    for name, value in (found | static).items():
        if getattr(type(value), "_wp_scalar_type_", None) in _REAL and not _short(value):
            yield name


def _short(value: Any) -> bool:
    """Return whether the 8 bits that Warp keeps of a pack's vectors hold the numbers exactly."""
    if hasattr(value, "_wp_scalar_type_"):
        return all(_short(each) for each in value)
    number = np.float32(getattr(value, "value", value))
    return float(number) == float(value) and not int(number.view(np.uint32)) & 0xFFFF


def _defaults(function: Any) -> Iterator[str]:
    for node in ast.walk(function.adj.tree):
        if isinstance(node, ast.arguments):
            yield from (ast.unparse(each) for each in (*node.defaults, *node.kw_defaults) if each)


def _single(kind: Any, Real: Any) -> bool:
    """Return whether a type has fewer digits than the numbers of a law."""
    return kind is float or (kind in (wp.float16, wp.bfloat16, wp.float32) and kind is not Real)


def _exact(number: Any) -> bool:
    """Return whether single precision holds a number exactly."""
    return float(np.float32(number)) == float(number)


def _printed(number: Any) -> bool:
    """Return whether the text of a number holds all its digits: Warp writes it into C++."""
    try:
        return float(str(number)) == float(number)
    except ValueError:
        return False
