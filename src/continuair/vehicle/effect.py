"""What acts on a vehicle beside its own parts, as the vehicle knows it: fields that hold numbers.

The device code of such an effect is that of `continuair.Term` (terms/term.py).
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
    """Immutable fields, checked when the effect is made.

    Fields of type `float`, or tuples of it, are numbers, each of one run or with a leading
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
                    f"{kind.__name__}.{each.name} is {shown(value)}, which cannot be compared as "
                    "part of kernels; give a number, text or tuple."
                )


@cache
def numbers_of(kind: type[Effect]) -> dict[str, tuple[int | None, ...]]:
    """Return the fields of a class of effects that hold numbers, and the shape of each in one run.

    None stands for a length that the type leaves open.
    """
    hints = get_type_hints(kind)
    shapes = {each.name: _shape(hints[each.name]) for each in fields(kind)}
    return {name: shape for name, shape in shapes.items() if shape is not None}


def _shape(kind: Any) -> tuple[int | None, ...] | None:
    """Return the shape of the numbers of a type, None if it holds something else."""
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
    """Return numbers of one run as a float or tuples, those of several as an array."""
    found = checks.finite_array(value)
    fits = found is not None and found.size > 0 and found.ndim in (len(shape), len(shape) + 1)
    if found is not None and fits:
        each = found.shape[found.ndim - len(shape) :]
        fits = all(want in (None, have) for want, have in zip(shape, each, strict=True))
    if found is None or not fits:
        size = " x ".join("n" if length is None else str(length) for length in shape)
        one = f"{size} finite numbers" if shape else "a finite number"
        raise InputError(
            f"{path} is {shown(value)}, but must be {one}; give {'those' if shape else 'that'}, "
            "or a row per run."
        )
    return _tuples(found.tolist()) if found.ndim == len(shape) else checks.frozen(found)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(child) for child in value) if isinstance(value, list) else value


def check_effects(value: object) -> tuple[Effect, ...]:
    """Return effects as a tuple; raises an error for anything else, such as what a file holds."""
    if not isinstance(value, (list, tuple)):
        raise ValueError("must be a tuple")
    for index, each in enumerate(value):
        if not isinstance(each, Effect):
            name = each.get("term", each) if isinstance(each, dict) else each
            raise InputError(
                f"{index} is {_named(name)}, but a term is code, which no file or description "
                "holds; set it with vehicle.replace({'terms': (Name(...),)})."
            )
        _check_fields(each)
    return tuple(value)


def _check_fields(effect: Effect) -> None:
    """Raise InputError for a class whose annotated fields are none, for want of a decorator."""
    kind, known = type(effect), {each.name for each in fields(effect)}
    for name, annotation in kind.__dict__.get("__annotations__", {}).items():
        if name not in known and "ClassVar" not in str(annotation):
            raise InputError(
                f"term {kind.__name__} has {name}, which is no field yet; write "
                "@dataclass(frozen=True) above its class."
            )


def _named(value: object) -> str:
    if isinstance(value, type):
        return f"the class {value.__name__}"
    return value if isinstance(value, str) else shown(value)


def plain(effect: Effect) -> dict[str, Any]:
    """Return the class name and the fields of an effect as JSON can hold them."""
    found: dict[str, Any] = {"term": type(effect).__name__}
    for each in fields(effect):
        value = getattr(effect, each.name)
        found[each.name] = (
            np.asarray(value).tolist() if isinstance(value, (tuple, np.ndarray)) else value
        )
    return found
