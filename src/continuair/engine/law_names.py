"""Values of the names in a device function."""

from __future__ import annotations

import ast
import inspect
from typing import Any


def names_of(function: Any) -> dict[str, Any]:
    """Return the outside names of a function and their values, without its local names."""
    of = inspect.getclosurevars(function.func)
    known = {**of.builtins, **of.globals, **of.nonlocals}
    own = function.func.__code__.co_varnames
    return {name: value for name, value in known.items() if name not in own}


def value_of(node: ast.AST, names: dict[str, Any]) -> Any:
    """Return the value of a name, or of an attribute, or None if it is local."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute):
        return getattr(value_of(node.value, names), node.attr, None)
    return None
