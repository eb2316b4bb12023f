"""Immutable parameter models, and the kinds of numbers that their fields accept.

Fields accept Python and NumPy numbers, lists, tuples and arrays, and hold plain numbers and tuples.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Generator, Iterator, Mapping
from functools import cache
from types import UnionType
from typing import Annotated, Any, ClassVar, Self, TypeGuard, Union, cast, get_args, get_origin

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from continuair import checks
from continuair.errors import InputError, input_error, named_fields, nearest, shown
from continuair.immutable import Immutable

ROUNDING = 1e-9
"""Share by which numbers that are meant to be equal may differ."""

_UNIONS = (Union, UnionType)


def _real(value: object) -> float:
    """Return a number as float; NaN, which no field accepts, for what is no finite number."""
    if type(value) is float:
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0 and not checks.has_unit(value):
        value = value.tolist()  # None where it is masked
    return float(value) if checks.is_number(value) else math.nan


def finite(value: object) -> float:
    """Return a finite number as float; ValueError for anything else."""
    number = _real(value)
    if not math.isfinite(number):
        raise ValueError("must be a finite number")
    return number


def _positive(value: object) -> float:
    number = _real(value)
    if not 0 < number < math.inf:
        raise ValueError("must be a finite number above 0")
    return number


def _not_negative(value: object) -> float:
    number = _real(value)
    if not 0 <= number < math.inf:
        raise ValueError("must be a finite number, 0 or above")
    return number


def _count(value: object) -> int:
    number = _real(value)
    if not 0 < number < math.inf or not number.is_integer():
        raise ValueError("must be a whole number above 0")
    return int(number)


def _whole(value: object) -> int:
    number = _real(value)
    if not 0 <= number < math.inf or not number.is_integer():
        raise ValueError("must be a whole number, 0 or above")
    return int(number)


def is_title(value: object) -> bool:
    """Tell whether a value is text for titles: one line, and not blank."""
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def _title(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError("must be text")
    if not is_title(value):
        raise ValueError("must be one line of text, not blank")
    return value


def is_word(value: object) -> TypeGuard[str]:
    """Tell whether a value is a word that can stand in the path of a field."""
    return isinstance(value, str) and re.fullmatch(r"[A-Za-z0-9_-]+", value) is not None


def _name(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError("must be text")
    if value and not is_word(value):
        raise ValueError("must be one word of letters, digits, _ and -")
    return value


def _entries(length: int, entry: Callable[[object], float]) -> BeforeValidator:
    def validate(value: object) -> tuple[float, ...]:
        if isinstance(value, np.ndarray):
            value = value.tolist()
        if not isinstance(value, (list, tuple)) or len(value) != length:
            raise ValueError(f"must hold {length} numbers")
        try:
            return tuple(entry(number) for number in value)
        except ValueError as error:
            raise ValueError(f"must hold {length} numbers, and each {error}") from None

    return BeforeValidator(validate)


Finite = Annotated[float, BeforeValidator(finite)]
Title = Annotated[str, BeforeValidator(_title)]
Name = Annotated[str, BeforeValidator(_name)]
Positive = Annotated[float, BeforeValidator(_positive)]
NotNegative = Annotated[float, BeforeValidator(_not_negative)]
PositivePair = Annotated[tuple[float, float], _entries(2, _positive)]
NotNegativePair = Annotated[tuple[float, float], _entries(2, _not_negative)]
Pair = Annotated[tuple[float, float], _entries(2, finite)]
Count = Annotated[int, BeforeValidator(_count)]
Whole = Annotated[int, BeforeValidator(_whole)]
CountPair = Annotated[tuple[int, int], _entries(2, _count)]
Vector = Annotated[tuple[float, float, float], _entries(3, finite)]
NotNegativeVector = Annotated[tuple[float, float, float], _entries(3, _not_negative)]
Quaternion = Annotated[tuple[float, float, float, float], _entries(4, finite)]


class _Shape(str):
    """Text that prints without quotation marks."""

    __repr__ = str.__str__


def label(entry: object, index: int) -> str:
    """Return what an entry of a list is called in the path of a field: its name, or its index."""
    name = entry.get("name") if isinstance(entry, Mapping) else getattr(entry, "name", None)
    return name if is_word(name) else str(index)


def named(entry: Mapping[str, Any], index: int) -> dict[str, Any]:
    """Return an entry of a list of named tables; one without a name is called by its index."""
    return {**entry, "name": entry.get("name") or str(index)}


@cache
def kinds(part: type[BaseModel], field: str) -> tuple[type[Part] | None, type[Part] | None]:
    """Return the part that a table of a field is read as, and that of the entries of a list."""
    annotation: Any = named_fields(part)[field].annotation
    options = get_args(annotation) if get_origin(annotation) in _UNIONS else (annotation,)
    of_entries = [get_args(each)[0] for each in options if get_origin(each) is tuple]
    return next(filter(_is_part, options), None), next(filter(_is_part, of_entries), None)


def dimensions(part: type[BaseModel], field: str) -> int:
    """Return how deep the numbers of a field are in lists: 0 for one number, 1 for a vector."""
    return _depth(named_fields(part)[field].annotation)


def _depth(annotation: Any) -> int:
    inner = get_args(annotation)
    if get_origin(annotation) is tuple:
        return 1 + _depth(inner[0])
    return max(map(_depth, inner), default=0) if get_origin(annotation) in _UNIONS else 0


def _is_part(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Part)


def _check_names(part: type[Part], fields: Mapping[str, Any], path: str) -> None:
    """Refuse unknown fields of a part and of its parts before a missing one is complained about."""
    known = named_fields(part)
    for name, value in fields.items():
        if name in part.refused:
            raise InputError(f"{path}{name} {part.refused[name]}.")
        if name not in known:
            remedy = nearest(f"{path}{name}", [f"{path}{each}" for each in known])
            raise InputError(f"{path}{name} = {shown(value)} is not a known field; {remedy}.")
        if not isinstance(value, Mapping | list | tuple):
            continue
        of_table, of_entries = kinds(part, name)
        if isinstance(value, Mapping) and of_table:
            _check_names(of_table, value, f"{path}{name}.")
        elif of_entries:
            for index, entry in enumerate(value):
                if isinstance(entry, Mapping):
                    _check_names(of_entries, entry, f"{path}{name}.{label(entry, index)}.")


class Part(Immutable, BaseModel):
    """Immutable parameters; an unknown, missing or unusable field is an InputError.

    Iterating gives pairs of a field's name, as files have it, and its value.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    refused: ClassVar[Mapping[str, str]] = {}
    """What files may hold elsewhere, or later -> the rest of the sentence that refuses it."""

    def __init__(self, /, **fields: Any) -> None:
        _check_names(type(self), fields, "")
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise input_error(type(self), error) from None

    def __setattr__(self, name: str, value: Any) -> None:
        raise InputError(
            f"{name} cannot be set to {shown(value)} because a {type(self).__name__} is immutable; "
            "use vehicle.replace({...}), which returns a changed copy."
        )

    def __delattr__(self, name: str) -> None:
        raise InputError(
            f"{name} cannot be deleted because a {type(self).__name__} is immutable; "
            "use vehicle.replace({...}), which returns a changed copy."
        )

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Itself; InputError for updates, which pydantic would not check."""
        if update:
            raise InputError(
                f"model_copy is asked to change {', '.join(map(str, update))}, which nothing would "
                "check; use vehicle.replace({...}), which returns a changed copy."
            )
        return self

    def having(self, **fields: Any) -> Self:
        """Itself with other fields that are known to be usable, as nothing checks them."""
        return cast(Self, type(self).model_construct(**(dict(self) | fields)))

    def __iter__(self) -> Generator[tuple[str, Any], None, None]:
        for name, field in type(self).model_fields.items():
            yield field.alias or name, getattr(self, name)

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        for name, value in self:
            is_array = isinstance(value, np.ndarray)
            yield name, _Shape(f"array{value.shape}") if is_array else value
