"""Check the parts of a control law, and what its functions read."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.engine.law_names import names_of, value_of
from continuair.engine.law_numbers import check_numbers
from continuair.engine.law_reading import Struct, read
from continuair.errors import InputError

_OURS = __name__.partition(".")[0]
_OF_CAMERA = ("sight", "desired", "camera_twist", "target_twist", "camera", "view")


def check_parts(found: Any) -> None:
    """Raise InputError if a law did not return its parts."""
    for name, kind in (("Gains", Struct), ("control", wp.Function)):
        if not isinstance(getattr(found, name, None), kind):
            raise InputError(
                "law",
                f"returns no {name}",
                "return a namespace with Gains, a Warp struct, and control, a Warp function",
            )
    if hasattr(found, "Memory") and not hasattr(found, "looks"):
        raise InputError(
            "law",
            "has a Memory, but no looks",
            "return looks beside it, True if it needs the camera, else False",
        )


def check_reading(found: SimpleNamespace, code: Any) -> None:
    """Raise InputError if constants of a law lose digits, or it needs a missing target."""
    if is_ours(found.control.func):
        return
    for function in _named(found.control, set()):
        check_numbers(function, code.Real)
    # Warp's own analysis resolves functions, but its error messages are less specific.
    for function in read(found.control, "law"):
        if not is_ours(function.func):
            check_numbers(function, code.Real)
            if code.points == 0:
                _check_unseen(function, code)


def is_ours(function: Any) -> bool:
    """Return whether a Python function belongs to this package."""
    return bool(function.__module__.partition(".")[0] == _OURS)


def _named(control: Any, known: set[str]) -> Iterator[Any]:
    if not isinstance(control, wp.Function) or getattr(control, "func", None) is None:
        return
    if is_ours(control.func) or control.key in known:
        return
    known.add(control.key)
    yield control
    names = names_of(control)
    for node in ast.walk(control.adj.tree):
        yield from _named(value_of(node, names), known)


def _check_unseen(function: Any, code: Any) -> None:
    """Raise InputError if a function reads a measurement that needs a target."""
    names = names_of(function)
    for node in ast.walk(function.adj.tree):
        if _of_camera(node, function, code) or value_of(node, names) is code.camera_push:
            raise InputError(
                "target",
                (
                    f"is None, but the law reads {ast.unparse(node)} in its function "
                    f"{function.func.__name__}, which needs a target"
                ),
                "give one",
            )


def _of_camera(node: ast.AST, function: Any, code: Any) -> bool:
    """Return whether a node is a camera measurement of an argument of type Sense."""
    if not isinstance(node, ast.Attribute) or not isinstance(node.value, ast.Name):
        return False
    # A local name may refer to an argument.
    sense = function.input_types.get(node.value.id, code.Sense) is code.Sense
    return sense and node.attr in _OF_CAMERA
