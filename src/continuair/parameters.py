"""Immutable parameter models, and the kinds of numbers that their fields accept.

Fields accept Python and NumPy numbers, lists, tuples and arrays, and hold plain numbers and tuples.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterator
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from continuair.errors import InputError, input_error, shown

# Entries across the diagonal may differ by this much of the largest entry.
_ASYMMETRY = 1e-9


def _real(value: object) -> float:
    """Return a number as float; NaN, which no field accepts, for what is not a number."""
    if type(value) is float:
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


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
    number = _positive(value)
    if not number.is_integer():
        raise ValueError("must be a whole number")
    return int(number)


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
Positive = Annotated[float, BeforeValidator(_positive)]
NotNegative = Annotated[float, BeforeValidator(_not_negative)]
PositivePair = Annotated[tuple[float, float], _entries(2, _positive)]
NotNegativePair = Annotated[tuple[float, float], _entries(2, _not_negative)]
Pair = Annotated[tuple[float, float], _entries(2, _finite)]
Count = Annotated[int, BeforeValidator(_count)]
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
    tolerance = _ASYMMETRY * max(map(abs, entries))
    if max(abs(xy - yx), abs(xz - zx), abs(yz - zy)) > tolerance:
        raise ValueError("must be symmetric")
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


class _Shape(str):
    """Text that prints without quotation marks."""

    __repr__ = str.__str__


class Part(BaseModel):
    """Immutable parameters; an unknown, missing or unusable field is an InputError."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    def __init__(self, /, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise input_error(type(self), error) from None

    def __setattr__(self, name: str, value: Any) -> None:
        raise InputError(
            f"{name} cannot be set to {shown(value)} because a {type(self).__name__} is immutable; "
            "use vehicle.replace({...}), which returns a changed copy."
        )

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        for name, value in super().__repr_args__():
            is_array = isinstance(value, np.ndarray)
            yield name, _Shape(f"array{value.shape}") if is_array else value
