"""Which numbers a law may hold: those of which Warp keeps all digits."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from typing import Any

import numpy as np
import warp as wp

from continuair.errors import InputError

_REAL = (wp.float16, wp.bfloat16, wp.float32, wp.float64)
_LARGEST_WHOLE = 2**31 - 1


def check_numbers(function: Any, Real: Any) -> None:
    """Raise InputError for numbers of a function of the device that Warp rounds or cuts off.

    Real: the numbers that the law computes with.
    """
    called = f"its function {function.func.__name__}"
    for number in _rounded(function, names_of(function), Real):
        raise InputError(
            f"law has the number {number} in {called}, where Warp counts in single precision, or "
            "in whole numbers; make it outside of that function, as in number = "
            f"code.Real({number})."
        )
    for name in _vectors(function):
        raise InputError(
            f"law has {name} in {called}, a vector or matrix from outside of it, of which Warp "
            "keeps too few digits; make it within, of numbers from outside, as in "
            "code.vec3(x, y, z), or give it as a gain."
        )
    for default in _defaults(function):
        raise InputError(
            f"law has the default {default} of an argument in {called}, which Warp does not tell "
            "from others that it has compiled; give it where the function is called."
        )


def names_of(function: Any) -> dict[str, Any]:
    """What a function knows from outside, by name."""
    of = inspect.getclosurevars(function.func)
    return {**of.builtins, **of.globals, **of.nonlocals}


def value_of(node: ast.AST, names: dict[str, Any]) -> Any:
    """What a name, or an attribute of one, stands for; None if it comes from within."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute):
        return getattr(value_of(node.value, names), node.attr, None)
    return None


def _rounded(function: Any, names: dict[str, Any], Real: Any) -> Iterator[Any]:
    """Numbers in single precision, but for those that a type takes as they are, such as Real(0.5),
    and what whole numbers are cut off to."""
    taken = [
        argument.operand if isinstance(argument, ast.UnaryOp) else argument
        for node in ast.walk(function.adj.tree)
        if isinstance(node, ast.Call) and isinstance(value_of(node.func, names), type)
        for argument in node.args
    ]
    whole = _whole_names(function, names)
    for node in ast.walk(function.adj.tree):
        number: Any = node.value if isinstance(node, ast.Constant) else value_of(node, names)
        cast = isinstance(node, ast.Call) and _single(value_of(node.func, names), Real)
        if cast or _divides(node, whole):
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
    """Vectors and matrices of numbers, but for whole ones, that a function has from outside."""
    names, static = names_of(function), function.adj.resolved_static_expressions
    found = {ast.unparse(node): value_of(node, names) for node in ast.walk(function.adj.tree)}
    for name, value in (found | static).items():
        if getattr(type(value), "_wp_scalar_type_", None) in _REAL:
            yield name


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


def _divides(node: ast.AST, whole: set[str]) -> bool:
    """Whether a whole number is divided, which leaves a whole number."""
    if not isinstance(node, (ast.BinOp, ast.AugAssign)) or not isinstance(node.op, ast.Div):
        return False
    return _is_whole(node.left if isinstance(node, ast.BinOp) else node.target, whole)


def _whole_names(function: Any, names: dict[str, Any]) -> set[str]:
    """Names of whole numbers: from outside, those that count loops, and what is set to such."""
    found = {name for name, value in names.items() if isinstance(value, (int, np.integer))}
    nodes = list(ast.walk(function.adj.tree))
    found |= {
        x.target.id for x in nodes if isinstance(x, ast.For) and isinstance(x.target, ast.Name)
    }
    for node in nodes:
        if isinstance(node, ast.Assign) and _is_whole(node.value, found):
            found |= {each.id for each in node.targets if isinstance(each, ast.Name)}
    return found


def _is_whole(node: ast.AST, names: set[str]) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_whole(node.left, names) and _is_whole(node.right, names)
    if isinstance(node, ast.UnaryOp):
        return _is_whole(node.operand, names)
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int)
    return isinstance(node, ast.Name) and node.id in names
