"""What a controller's law must give, and what it may read."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.engine.law_names import names_of, value_of
from continuair.engine.law_numbers import check_numbers
from continuair.engine.law_quotients import check_quotients
from continuair.errors import InputError

_OURS = __name__.partition(".")[0]
_OF_CAMERA = ("sight", "desired", "camera_twist", "target_twist", "camera", "view")


def checked_law(found: Any, code: Any) -> SimpleNamespace:
    """What a law returned for its LawCode.

    Raises InputError without its parts, for numbers that lose digits, and where it reads the camera
    but there is no target.
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
    functions = list(_functions(found.control, set()))
    for function in functions:
        check_numbers(function, code.Real)
        if code.points == 0:
            _check_unseen(function, code)
    if functions:
        check_quotients(found.control)
    return found


def _functions(control: Any, known: set[str]) -> Iterator[Any]:
    """A function of the device and those that it calls, but for those of this package."""
    plain = getattr(control, "func", None)
    if not isinstance(control, wp.Function) or plain is None or control.key in known:
        return
    if plain.__module__.partition(".")[0] == _OURS:
        return
    known.add(control.key)
    yield control
    names = names_of(control)
    for node in ast.walk(control.adj.tree):
        yield from _functions(value_of(node, names), known)


def _check_unseen(function: Any, code: Any) -> None:
    """Raise InputError if a function reads what is known with a target alone."""
    names = names_of(function)
    for node in ast.walk(function.adj.tree):
        if _of_camera(node, function, code) or value_of(node, names) is code.camera_push:
            raise InputError(
                f"target is None, but the law reads {ast.unparse(node)} in its function "
                f"{function.func.__name__}, which is known with a target alone; give one."
            )


def _of_camera(node: ast.AST, function: Any, code: Any) -> bool:
    """Whether it is what an argument of the type Sense has of the camera."""
    if not isinstance(node, ast.Attribute) or not isinstance(node.value, ast.Name):
        return False
    sense = function.input_types.get(node.value.id) is code.Sense
    return sense and node.attr in _OF_CAMERA
