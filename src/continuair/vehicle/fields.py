"""Immutable parameter models, and the kinds of numbers that their fields accept.

Fields accept Python and NumPy numbers, lists, tuples and arrays, and hold plain numbers and tuples.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, get_args

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from continuair import checks
from continuair.errors import ContinuairWarning, InputError, input_error, nearest, shown

ROUNDING = 1e-9
"""Share by which numbers that are meant to be equal may differ."""

# No rigid body exceeds the triangle inequality of its moments; rounded or measured data may.
_TRIANGLE_EXCESS = 0.05


def _real(value: object) -> float:
    """Return a number as float; NaN, which no field accepts, for what is no finite number."""
    if type(value) is float:
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.tolist()  # None where it is masked
    return float(value) if checks.is_number(value) else math.nan


def _finite(value: object) -> float:
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


Finite = Annotated[float, BeforeValidator(_finite)]
Title = Annotated[str, BeforeValidator(_title)]
Positive = Annotated[float, BeforeValidator(_positive)]
NotNegative = Annotated[float, BeforeValidator(_not_negative)]
PositivePair = Annotated[tuple[float, float], _entries(2, _positive)]
NotNegativePair = Annotated[tuple[float, float], _entries(2, _not_negative)]
Pair = Annotated[tuple[float, float], _entries(2, _finite)]
Count = Annotated[int, BeforeValidator(_count)]
Whole = Annotated[int, BeforeValidator(_whole)]
CountPair = Annotated[tuple[int, int], _entries(2, _count)]
Vector = Annotated[tuple[float, float, float], _entries(3, _finite)]
Quaternion = Annotated[tuple[float, float, float, float], _entries(4, _finite)]
Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


def symmetric_matrix(value: object) -> Matrix:
    """Return 3 numbers (the diagonal) or 3x3 numbers as a matrix; ValueError if not symmetric."""
    demand = "must hold 3 numbers (the diagonal) or 3 rows of 3 numbers"
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(rows, (list, tuple)) or len(rows) != 3:
        raise ValueError(demand)
    rows = [row.tolist() if isinstance(row, np.ndarray) else row for row in rows]
    try:
        if all(isinstance(row, (list, tuple)) and len(row) == 3 for row in rows):
            entries = [_finite(entry) for row in rows for entry in row]
        else:
            entries = [_finite(entry) for entry in rows]
    except ValueError as error:
        raise ValueError(f"{demand}, and each {error}") from None
    if len(entries) == 3:
        xx, yy, zz = entries
        return (xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz)
    xx, xy, xz, yx, yy, yz, zx, zy, zz = entries
    tolerance = ROUNDING * max(map(abs, entries))
    if max(abs(xy - yx), abs(xz - zx), abs(yz - zy)) > tolerance:
        raise ValueError("must be symmetric")
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def check_moments(field: str, smallest: float, middle: float, largest: float) -> None:
    """Refuse, or warn about, principal moments that no distribution of mass can have."""
    if largest <= (smallest + middle) * (1 + ROUNDING):
        return
    text = (
        f"the largest principal moment {largest:.6g} kg m² exceeds the sum "
        f"{smallest + middle:.6g} kg m² of the other two"
    )
    if largest > (smallest + middle) * (1 + _TRIANGLE_EXCESS):
        raise ValueError(f"belongs to no rigid body: {text} by more than 5 %")
    text = f"{field} belongs to no rigid body: {text} by less than 5 %, and is used as given."
    warnings.warn(text, ContinuairWarning, stacklevel=2)


class _Shape(str):
    """Text that prints without quotation marks."""

    __repr__ = str.__str__


def _check_names(part: type[BaseModel], fields: Mapping[str, Any], path: str) -> None:
    """Refuse unknown fields of a part and of its parts before a missing one is complained about."""
    for name, value in fields.items():
        if name not in part.model_fields:
            remedy = nearest(f"{path}{name}", [f"{path}{known}" for known in part.model_fields])
            raise InputError(f"{path}{name} = {shown(value)} is not a known field; {remedy}.")
        annotation = part.model_fields[name].annotation
        if isinstance(value, Mapping) and isinstance(annotation, type):
            if issubclass(annotation, Part):
                _check_names(annotation, value, f"{path}{name}.")
        elif isinstance(value, list | tuple) and (kind := _kind_of_entries(annotation)):
            for index, entry in enumerate(value):
                if isinstance(entry, Mapping):
                    _check_names(kind, entry, f"{path}{name}.{index}.")


def _kind_of_entries(annotation: Any) -> type[Part] | None:
    kinds = get_args(annotation)
    return kinds[0] if kinds and isinstance(kinds[0], type) and issubclass(kinds[0], Part) else None


class Part(BaseModel):
    """Immutable parameters; an unknown, missing or unusable field is an InputError."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

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

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        for name, value in super().__repr_args__():
            is_array = isinstance(value, np.ndarray)
            yield name, _Shape(f"array{value.shape}") if is_array else value
