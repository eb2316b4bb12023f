"""Exceptions and warnings about inputs, and the format of their messages."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError
    from pydantic.fields import FieldInfo

INTERRUPTED = 130
"""Exit status of a process stopped by Ctrl-C, as in shells."""

_LONGEST_VALUE = 80
_MOST_SLIPS = 3


class InputError(ValueError):
    """An invalid input.

    Each sentence names the field, its value and the remedy. `str(error)` has one sentence per line,
    in most cases one.

    Parameters
    ----------
    *sentences : str
        Sentences of the message.
    """

    def __init__(self, *sentences: str) -> None:
        super().__init__("\n".join(sentences))
        self.sentences = tuple(line for text in sentences for line in text.splitlines())

    def within(self, prefix: str) -> InputError:
        """Return the same error with a prefix before each sentence.

        Parameters
        ----------
        prefix : str
            Path of the enclosing field, such as ``"arm."``.

        Returns
        -------
        InputError
            An error of the same class.
        """
        return type(self)(*(prefix + sentence for sentence in self.sentences))


class CannotHover(InputError):
    """The maximum thrust of a vehicle is below its weight."""


class ContinuairWarning(UserWarning):
    """An input is valid, but may not be what was intended."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return the clause that suggests the nearest of the `valid` names, or lists them all."""
    names = list(valid)
    known = ", ".join(names)
    # Compare the last part of dotted names only: common tables would make any two similar.
    most = min(len(name.rpartition(".")[2]) // 3, _MOST_SLIPS)
    alike = [other for other in names if other.count(".") == name.count(".")]
    slips = {other: _slips(name, other) for other in alike if abs(len(other) - len(name)) <= most}
    close = min(slips, key=lambda other: slips[other], default="")
    likely = bool(close) and slips[close] <= most
    return f"use {close} (known: {known})" if likely else f"use one of: {known}"


def _slips(name: str, other: str) -> int:
    """Return the number of letters to insert, delete, change or swap between two names."""
    before, row = [0] * (len(other) + 1), list(range(len(other) + 1))
    for i, a in enumerate(name, 1):
        last, before, row = before, row, [i]
        for j, b in enumerate(other, 1):
            row.append(min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (a != b)))
            if i > 1 < j and a == other[j - 2] and b == name[i - 2]:
                row[j] = min(row[j], last[j - 2] + 1)
    return row[-1]


class _Printer(reprlib.Repr):
    def repr_int(self, x: int, level: int) -> str:
        # Python refuses to print numbers of a few thousand digits.
        digits = int(x.bit_length() * 0.30103) + 1
        return f"a number of {digits:,} digits" if digits > 4000 else super().repr_int(x, level)


_PRINTER = _Printer()
_PRINTER.maxother = _LONGEST_VALUE


def shown(value: object) -> str:
    """Return a value as text for a message: on one line, and shortened.

    Arrays of NumPy are printed as lists; arrays of other libraries are printed with their device or
    tracer.
    """
    foreign = hasattr(value, "__dlpack__") and type(value).__module__ != "numpy"
    if hasattr(value, "tolist") and not isinstance(value, type) and not foreign:
        # A scalar quantity of Pint has the method, but it fails.
        with suppress(AttributeError):
            value = value.tolist()
    return shortened(" ".join(_PRINTER.repr(value).split()), _LONGEST_VALUE)


def shortened(text: str, longest: int) -> str:
    """Return a text, cut to at most `longest` characters."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


@cache
def named_fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return a model's fields by their names in files, which may differ from attributes."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def input_error(model: type[BaseModel], error: ValidationError) -> InputError:
    """Return an error of pydantic about a `model` as an InputError.

    Sentences start with the field, so that an enclosing model can prepend its own field. A single
    InputError keeps its class.
    """
    items = error.errors()
    causes = [item.get("ctx", {}).get("error") for item in items]
    kind = type(causes[0]) if len(causes) == 1 and isinstance(causes[0], InputError) else InputError
    return kind(*(line for item in items for line in _sentences(model, item)))


def _sentences(model: type[BaseModel], item: Any) -> list[str]:
    cause = item.get("ctx", {}).get("error")
    field = ".".join(str(key) for key in item["loc"])
    if isinstance(cause, InputError):
        return list(cause.within(f"{field}." if field else "").sentences)
    name = str(item["loc"][0])
    description = " ".join((named_fields(model)[name].description or "a valid value").split())
    if item["type"] == "missing":
        return [f"{field} is missing; give {description}."]
    demand = str(cause) if cause else _demand(item)
    return [f"{field} is {shown(item['input'])}, but {demand}; give {description}."]


def _demand(item: Any) -> str:
    match item["type"]:
        case "model_type":
            return "must be a table of fields"
        case "tuple_type":
            return "must be a list"
        case "string_type":
            return "must be text"
        case "literal_error":
            return f"must be {item['ctx']['expected']}"
        case _:
            return "cannot be used"
