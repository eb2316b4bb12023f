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
        for number in _numbers(function):
            if float(np.float32(number)) != number:
                raise InputError(
                    f"law has the number {number!r} in its function {function.func.__name__}, "
                    "where Warp counts it in single precision; make it outside of that function, "
                    f"as in number = code.Real({number!r})."
                )
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
    of = inspect.getclosurevars(plain)
    for called in (*of.nonlocals.values(), *of.globals.values()):
        yield from _functions(called, known)


def _numbers(function: Any) -> Iterator[float]:
    """What is written with a decimal point in a function."""
    for node in ast.walk(function.adj.tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, float):
            yield node.value
