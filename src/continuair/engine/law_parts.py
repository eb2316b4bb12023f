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


def checked_law(found: Any) -> SimpleNamespace:
    """What a law returned; raises InputError without its parts, or for numbers that lose digits."""
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
        _check_numbers(function)
    return found


def _check_numbers(function: Any) -> None:
    """Raise InputError for numbers that Warp counts in single precision: all but those that a type
    takes as they are, such as Real(0.5)."""
    names = _names(function)
    taken = [
        argument.operand if isinstance(argument, ast.UnaryOp) else argument
        for node in ast.walk(function.adj.tree)
        if isinstance(node, ast.Call) and isinstance(_value(node.func, names), type)
        for argument in node.args
    ]
    for node in ast.walk(function.adj.tree):
        number = node.value if isinstance(node, ast.Constant) else _value(node, names)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and _whole(node.left):
            number = ast.unparse(node)
        elif not isinstance(number, (float, np.floating)) or (node in taken and _exact(number)):
            continue
        raise InputError(
            f"law has the number {number} in its function {function.func.__name__}, where Warp "
            "counts in single precision, or in whole numbers; make it outside of that function, as "
            f"in number = code.Real({number})."
        )


def _exact(number: Any) -> bool:
    """Whether single precision holds it."""
    return float(np.float32(number)) == float(number)


def _whole(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


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
    return {**of.globals, **of.nonlocals}


def _value(node: ast.AST, names: dict[str, Any]) -> Any:
    """What a name, or an attribute of one, stands for; None if it comes from within."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute):
        return getattr(_value(node.value, names), node.attr, None)
    return None
