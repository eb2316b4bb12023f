"""Base class of a user's own forces, as far as a vehicle needs it: fields that hold numbers.

`continuair.Term` (terms/term.py) adds the device code.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, fields
from functools import cache
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable


@dataclass(frozen=True)
class Effect(Immutable):
    """Frozen dataclass whose fields are validated on construction.

    Fields of type `float`, or tuples of it, are numbers. Each holds one run or has a leading
    dimension (runs,). Fields of any other type are the same in every run.
    """

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, shape in numbers_of(kind).items():
            value = _checked(f"{kind.__name__}.{name}", getattr(self, name), shape)
            object.__setattr__(self, name, value)
        for each in fields(self):
            value = getattr(self, each.name)
            if not isinstance(value, (np.ndarray, Hashable)):
                raise InputError(
                    f"{kind.__name__}.{each.name}",
                    f"is {shown(value)}, which is not hashable",
                    "give a number, text or tuple",
                )


@cache
def numbers_of(kind: type[Effect]) -> dict[str, tuple[int | None, ...]]:
    """Return the numeric fields of a class of effects, and the shape of each in one run.

    None is a length that the type does not fix.
    """
    hints = get_type_hints(kind)
    shapes = {each.name: _shape(hints[each.name]) for each in fields(kind)}
    return {name: shape for name, shape in shapes.items() if shape is not None}


def _shape(kind: Any) -> tuple[int | None, ...] | None:
    """Return the shape of the numbers of a type, or None if it is not numeric."""
    inner = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        (kind, *others) = [each for each in inner if each is not type(None)]
        return None if others else _shape(kind)
    if get_origin(kind) is not tuple:
        return () if kind is float else None
    below = _shape(inner[0])
    if below is None:
        return None
    return (None if inner[-1] is Ellipsis else len(inner), *below)


def _checked(path: str, value: Any, shape: tuple[int | None, ...]) -> Any:
    """Return the numbers of one run as a float or tuples, those of several as an array."""
    found = checks.finite_array(value)
    fits = found is not None and found.size > 0 and found.ndim in (len(shape), len(shape) + 1)
    if found is not None and fits:
        each = found.shape[found.ndim - len(shape) :]
        fits = all(want in (None, have) for want, have in zip(shape, each, strict=True))
    if found is None or not fits:
        size = " x ".join("n" if length is None else str(length) for length in shape)
        one = f"{size} finite numbers" if shape else "a finite number"
        raise InputError(
            path,
            f"is {shown(value)}, but must be {one}",
            f"give {'those' if shape else 'that'}, or a row per run",
        )
    return _tuples(found.tolist()) if found.ndim == len(shape) else checks.frozen(found)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(child) for child in value) if isinstance(value, list) else value


def check_effects(value: object) -> tuple[Effect, ...]:
    """Return effects as a tuple, or raise an error for anything else, such as a table of a file."""
    if not isinstance(value, (list, tuple)):
        raise ValueError("must be a tuple")
    for index, each in enumerate(value):
        if not isinstance(each, Effect):
            name = each.get("term", each) if isinstance(each, dict) else each
            raise InputError(
                str(index),
                f"is {_named(name)}, but a term is code, not part of a file",
                "set it with vehicle.replace({'terms': (Name(...),)})",
            )
        _check_fields(each)
    return tuple(value)


def _check_fields(effect: Effect) -> None:
    """Raise InputError for a class that lacks the decorator which makes its annotations fields."""
    kind, known = type(effect), {each.name for each in fields(effect)}
    for name, annotation in kind.__dict__.get("__annotations__", {}).items():
        if name not in known and "ClassVar" not in str(annotation):
            raise InputError(
                f"term {kind.__name__}",
                f"annotates {name}, which is not a field",
                "write @dataclass(frozen=True) above its class",
            )


def _named(value: object) -> str:
    if isinstance(value, type):
        return f"the class {value.__name__}"
    return value if isinstance(value, str) else shown(value)


def plain(effect: Effect) -> dict[str, Any]:
    """Return the class name and the fields of an effect as values for JSON."""
    found: dict[str, Any] = {"term": type(effect).__name__}
    for each in fields(effect):
        value = getattr(effect, each.name)
        found[each.name] = (
            np.asarray(value).tolist() if isinstance(value, (tuple, np.ndarray)) else value
        )
    return found
