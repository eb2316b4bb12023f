"""What a controller's law must give, and which numbers it may hold."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from continuair.errors import InputError

_OURS = __name__.partition(".")[0]
_REAL = (wp.float16, wp.bfloat16, wp.float32, wp.float64)


def checked_law(found: Any, Real: Any) -> SimpleNamespace:
    """What a law returned; raises InputError without its parts, or for numbers that lose digits.

    Real: the numbers that it computes with.
    """
    for name in ("Gains", "control"):
        if not hasattr(found, name):
            raise InputError(
                f"law gives no {name}; return a namespace with Gains, a Warp struct, and control, "
                "a Warp function."
            )
    if hasattr(found, "Memory") and not hasattr(found, "looks"):
        raise InputError(
            "law has a Memory, but does not say whether it looks; return looks, True or False, "
            "beside it."
        )
    for function in _functions(found.control, set()):
        _check_numbers(function, Real)
    return found


def _check_numbers(function: Any, Real: Any) -> None:
    """Raise InputError for numbers of a function of the device that Warp rounds or cuts off."""
    for number in _rounded(function, _names(function), Real):
        raise InputError(
            f"law has the number {number} in its function {function.func.__name__}, where Warp "
            "counts in single precision, or in whole numbers; make it outside of that function, as "
            f"in number = code.Real({number})."
        )
    for name in _vectors(function):
        raise InputError(
            f"law has {name} in its function {function.func.__name__}, a vector or matrix from "
            "outside of it, of which Warp keeps too few digits; make it within, of numbers from "
            "outside, as in code.vec3(x, y, z), or give it as a gain."
        )


def _rounded(function: Any, names: dict[str, Any], Real: Any) -> Iterator[Any]:
    """Numbers in single precision, but for those that a type takes as they are, such as Real(0.5),
    and quotients of whole numbers."""
    taken = [
        argument.operand if isinstance(argument, ast.UnaryOp) else argument
        for node in ast.walk(function.adj.tree)
        if isinstance(node, ast.Call) and isinstance(_value(node.func, names), type)
        for argument in node.args
    ]
    whole = _whole_names(function, names)
    for node in ast.walk(function.adj.tree):
        number: Any = node.value if isinstance(node, ast.Constant) else _value(node, names)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
            if _is_whole(node.left, whole):
                yield ast.unparse(node)
        elif isinstance(node, ast.Call) and _single(_value(node.func, names), Real):
            yield ast.unparse(node)
        elif isinstance(number, (float, np.floating)):
            if not (node in taken and _exact(number)):
                yield number
        elif _single(type(number), Real) and not _exact(number.value):
            yield number.value


def _vectors(function: Any) -> Iterator[str]:
    """Vectors and matrices of numbers, but for whole ones, that a function has from outside."""
    names, static = _names(function), function.adj.resolved_static_expressions
    found = {ast.unparse(node): _value(node, names) for node in ast.walk(function.adj.tree)}
    for name, value in (found | static).items():
        if getattr(type(value), "_wp_scalar_type_", None) in _REAL:
            yield name


def _single(kind: Any, Real: Any) -> bool:
    """Whether a type has fewer digits than the numbers of a law."""
    return kind is float or (kind in (wp.float16, wp.bfloat16, wp.float32) and kind is not Real)


def _exact(number: Any) -> bool:
    """Whether single precision holds it."""
    return float(np.float32(number)) == float(number)


def _whole_names(function: Any, names: dict[str, Any]) -> set[str]:
    """Names of whole numbers: from outside, and those that count loops."""
    found = {name for name, value in names.items() if isinstance(value, (int, np.integer))}
    loops = (node for node in ast.walk(function.adj.tree) if isinstance(node, ast.For))
    return found | {loop.target.id for loop in loops if isinstance(loop.target, ast.Name)}


def _is_whole(node: ast.AST, names: set[str]) -> bool:
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int)
    return isinstance(node, ast.Name) and node.id in names


def _functions(control: Any, known: set[str]) -> Iterator[Any]:
    """A function of the device and those that it calls, but for those of this package."""
    plain = getattr(control, "func", None)
    if not isinstance(control, wp.Function) or plain is None or control.key in known:
        return
    if plain.__module__.partition(".")[0] == _OURS:
        return
    known.add(control.key)
    yield control
    names = _names(control)
    for node in ast.walk(control.adj.tree):
        yield from _functions(_value(node, names), known)


def _names(function: Any) -> dict[str, Any]:
    """What a function knows from outside, by name."""
    of = inspect.getclosurevars(function.func)
    return {**of.builtins, **of.globals, **of.nonlocals}


def _value(node: ast.AST, names: dict[str, Any]) -> Any:
    """What a name, or an attribute of one, stands for; None if it comes from within."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute):
        return getattr(_value(node.value, names), node.attr, None)
    return None
