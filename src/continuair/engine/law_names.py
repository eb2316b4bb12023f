"""What the names in a function of the device stand for."""

from __future__ import annotations

import ast
import inspect
from typing import Any


def names_of(function: Any) -> dict[str, Any]:
    """What a function knows from outside, by name; its own names hide those."""
    of = inspect.getclosurevars(function.func)
    known = {**of.builtins, **of.globals, **of.nonlocals}
    own = function.func.__code__.co_varnames
    return {name: value for name, value in known.items() if name not in own}


def value_of(node: ast.AST, names: dict[str, Any]) -> Any:
    """What a name, or an attribute of one, stands for; None if it comes from within."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute):
        return getattr(value_of(node.value, names), node.attr, None)
    return None
