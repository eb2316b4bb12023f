"""What a law reads from outside of it, which is compiled with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import CodeType, FunctionType, MethodType, SimpleNamespace
from typing import Any

import numpy as np

_OURS = __name__.partition(".")[0]

_DEPTH = 5
"""Of containers in one another that are looked into."""


@dataclass(frozen=True)
class LawAsItIs:
    """A law, and what it reads from outside now: with another number there it is another law."""

    law: Callable[[Any], SimpleNamespace]
    outside: tuple[Any, ...]

    def __call__(self, code: Any) -> SimpleNamespace:
        return self.law(code)


def as_it_is(law: Callable[[Any], SimpleNamespace]) -> LawAsItIs:
    """Return a law with what it reads from outside now."""
    return LawAsItIs(law, _outside(law, set()))


def _outside(function: Any, known: set[Any]) -> tuple[Any, ...]:
    """Names and values that a function of the user reads, and those that it calls."""
    if isinstance(function, MethodType):
        own = _key(getattr(function.__self__, "__dict__", {}), known)
        return ("self", own), *_outside(function.__func__, known)
    if not isinstance(function, FunctionType) or function in known or _is_ours(function):
        return ()
    known.add(function)
    found = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            found[name] = cell.cell_contents
        except ValueError:
            # Not known yet, as of a function that calls itself.
            continue
    names = set(_names(function.__code__))
    found |= {name: value for name, value in function.__globals__.items() if name in names}
    defaults = *(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()
    found |= {f"default {place}": value for place, value in enumerate(defaults)}
    return tuple((name, _key(found[name], known)) for name in sorted(found))


def _is_ours(function: FunctionType) -> bool:
    return str(function.__module__).partition(".")[0] == _OURS


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield from _names(part)


def _key(value: Any, known: set[Any], depth: int = 0) -> Any:
    """What is the same as long as a value is."""
    if depth == _DEPTH:
        return _Itself(value)
    if isinstance(value, (bool, int, float, complex, str, bytes, np.generic)):
        return type(value), repr(value)
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, SimpleNamespace):
        return _key(vars(value), known, depth)
    if isinstance(value, dict):
        return tuple((repr(name), _key(each, known, depth + 1)) for name, each in value.items())
    if isinstance(value, (list, tuple)):
        return type(value), tuple(_key(each, known, depth + 1) for each in value)
    if isinstance(value, (FunctionType, MethodType)):
        return _Itself(value), _outside(value, known)
    if isinstance(getattr(value, "value", None), (int, float)):
        # Warp's own numbers.
        return type(value), repr(value.value)
    return _Itself(value)


class _Itself:
    """An object that is the same as itself alone."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)
