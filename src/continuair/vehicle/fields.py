"""Immutable parameter models, and the types of their fields.

Fields accept Python and NumPy numbers, lists, tuples and arrays, and hold plain numbers and tuples.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Generator, Iterator, Mapping
from functools import cache
from types import UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    Self,
    TypeGuard,
    Union,
    cast,
    get_args,
    get_origin,
)

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError
from pydantic.fields import FieldInfo

from continuair import checks
from continuair.errors import InputError, input_error, named_fields, nearest, shown
from continuair.immutable import Immutable

ROUNDING = 1e-9
"""Relative difference up to which two numbers count as equal."""

_UNIONS = (Union, UnionType)


def _real(value: object) -> float:
    """Return a number as float, and NaN, which no field accepts, for anything else."""
    if type(value) is float:
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0 and not checks.has_unit(value):
        value = value.tolist()  # None where it is masked
    return float(value) if checks.is_number(value) else math.nan


def finite(value: object) -> float:
    """Return a finite number as float, or raise ValueError."""
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
    """Return whether a value is one line of text that is not blank."""
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def _title(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError("must be text")
    if not is_title(value):
        raise ValueError("must be one line of text, not blank")
    return value


def is_word(value: object) -> TypeGuard[str]:
    """Return whether a value is one word, which can be part of the path of a field."""
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
    """Text whose `repr` has no quotation marks."""

    __repr__ = str.__str__


def label(entry: object, index: int) -> str:
    """Return the name of a list's entry in the path of a field: its own name, or its index."""
    name = entry.get("name") if isinstance(entry, Mapping) else getattr(entry, "name", None)
    return name if is_word(name) else str(index)


def named(entry: Mapping[str, Any], index: int) -> dict[str, Any]:
    """Return an entry of a list of named tables, named by its index if it has no name."""
    return {**entry, "name": entry.get("name") or str(index)}


@cache
def kinds(part: type[BaseModel], field: str) -> tuple[type[Part] | None, type[Part] | None]:
    """Return the classes that a table of a field, and the entries of its list, are read as."""
    annotation: Any = named_fields(part)[field].annotation
    options = get_args(annotation) if get_origin(annotation) in _UNIONS else (annotation,)
    of_entries = [get_args(each)[0] for each in options if get_origin(each) is tuple]
    return next(filter(_is_part, options), None), next(filter(_is_part, of_entries), None)


def dimensions(part: type[BaseModel], field: str) -> int:
    """Return the number of dimensions of a field: 0 for one number, 1 for a vector."""
    return _depth(named_fields(part)[field].annotation)


def _depth(annotation: Any) -> int:
    inner = get_args(annotation)
    if get_origin(annotation) is tuple:
        return 1 + _depth(inner[0])
    if get_origin(annotation) is Annotated:
        return _depth(inner[0])
    return max(map(_depth, inner), default=0) if get_origin(annotation) in _UNIONS else 0


@cache
def mixed(part: type[BaseModel], field: str) -> bool:
    """Return whether a field holds one number or several."""
    return _has_number(named_fields(part)[field].annotation) and dimensions(part, field) > 0


def _has_number(annotation: Any) -> bool:
    """Return whether a type is that of a number, or holds it beside others."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _has_number(inner[0])
    return annotation is float or (origin in _UNIONS and any(map(_has_number, inner)))


def _is_part(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Part)


def _check_names(part: type[Part], fields: Mapping[str, Any], path: str) -> None:
    """Raise InputError for unknown fields of a part and its parts, before missing ones."""
    known = named_fields(part)
    for name, value in fields.items():
        if name in part.refused:
            problem, _, remedy = part.refused[name].partition("; ")
            raise InputError(f"{path}{name}", problem, remedy)
        if name not in known:
            remedy = nearest(f"{path}{name}", [f"{path}{each}" for each in known])
            raise InputError(f"{path}{name}", f"= {shown(value)} is not a known field", remedy)
        if not isinstance(value, Mapping | list | tuple):
            continue
        of_table, of_entries = kinds(part, name)
        if isinstance(value, Mapping) and of_table:
            _check_names(of_table, value, f"{path}{name}.")
        elif of_entries:
            for index, entry in enumerate(value):
                if isinstance(entry, Mapping):
                    _check_names(of_entries, entry, f"{path}{name}.{label(entry, index)}.")


def _written(annotation: Any) -> str:
    """Return the type of a field as its documentation names it."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return "{" + ", ".join(f'"{choice}"' for choice in inner) + "}"
    if origin is Annotated:
        return _written(inner[0])
    if origin in _UNIONS:
        return " or ".join(_written(each) for each in inner if each is not type(None))
    if origin is tuple:
        return f"tuple of {_written(inner[0])}"
    return str(annotation.__name__)


def _documented(name: str, field: FieldInfo) -> str:
    """Return the entry of a field in a section `Parameters`."""
    kind, default = _written(field.annotation), field.default
    if not field.is_required():
        plain = isinstance(default, (int, float, str)) or (isinstance(default, tuple) and default)
        kind += f", default {default!r}" if plain else ", optional"
    meaning = " ".join((field.description or "").split())
    return f"{name} : {kind}\n    {meaning[:1].upper()}{meaning[1:]}."


class Part(Immutable, BaseModel):
    """Immutable parameters, validated on construction.

    An unknown, missing or invalid field raises InputError. Iterating yields pairs of a field's
    name, as in files, and its value. Subclasses get their section `Parameters` from their fields.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    refused: ClassVar[Mapping[str, str]] = {}
    """Names that files cannot hold here -> the rest of the sentence that rejects them."""

    @classmethod
    def __pydantic_init_subclass__(cls, **named: Any) -> None:
        """Append the fields to the docstring, as its section `Parameters`."""
        super().__pydantic_init_subclass__(**named)
        if text := cls.__dict__.get("__doc__"):
            fields = [_documented(name, each) for name, each in named_fields(cls).items()]
            cls.__doc__ = "\n".join([inspect.cleandoc(text), "", "Parameters", "-" * 10, *fields])

    def __init__(self, /, **fields: Any) -> None:
        _check_names(type(self), fields, "")
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise input_error(type(self), error) from None

    def __setattr__(self, name: str, value: Any) -> None:
        raise InputError(
            name,
            f"cannot be set to {shown(value)} because a {type(self).__name__} is immutable",
            "use vehicle.replace({...}), which returns a changed copy",
        )

    def __delattr__(self, name: str) -> None:
        raise InputError(
            name,
            f"cannot be deleted because a {type(self).__name__} is immutable",
            "use vehicle.replace({...}), which returns a changed copy",
        )

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return the same object; raise InputError for updates, which pydantic does not check."""
        if update:
            raise InputError(
                "model_copy",
                f"does not check {', '.join(map(str, update))}",
                "use vehicle.replace({...}), which returns a changed copy",
            )
        return self

    def having(self, **fields: Any) -> Self:
        """Return a copy with other fields, which must be valid: they are not checked."""
        return cast(Self, type(self).model_construct(**(dict(self) | fields)))

    def __iter__(self) -> Generator[tuple[str, Any], None, None]:
        for name, field in type(self).model_fields.items():
            yield field.alias or name, getattr(self, name)

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        for name, value in self:
            is_array = isinstance(value, np.ndarray)
            yield name, _Shape(f"array{value.shape}") if is_array else value
