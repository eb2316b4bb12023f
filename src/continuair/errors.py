"""What a user is told when an input cannot be used."""

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
"""What shells report for a process ended by Ctrl-C."""

_LONGEST_VALUE = 80
_MOST_SLIPS = 3


class InputError(ValueError):
    """An input of the user cannot be used; each sentence names the field, its value and the remedy.

    `str(error)` holds one sentence per line; nearly always there is one.
    """

    def __init__(self, *sentences: str) -> None:
        super().__init__("\n".join(sentences))
        self.sentences = tuple(line for text in sentences for line in text.splitlines())

    def within(self, prefix: str) -> InputError:
        """Return the same error, every sentence of it starting with `prefix`."""
        return type(self)(*(prefix + sentence for sentence in self.sentences))


class CannotHover(InputError):
    """A vehicle is one that its rotors do not lift."""


class ContinuairWarning(UserWarning):
    """An input can be used, but may not be what its author meant."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return the clause that tells which of the `valid` names was meant, or lists them all."""
    names = list(valid)
    known = ", ".join(names)
    # Only the last of dotted names counts: the tables that lead to it would make any two alike.
    most = min(len(name.rpartition(".")[2]) // 3, _MOST_SLIPS)
    alike = [other for other in names if other.count(".") == name.count(".")]
    slips = {other: _slips(name, other) for other in alike if abs(len(other) - len(name)) <= most}
    close = min(slips, key=lambda other: slips[other], default="")
    likely = bool(close) and slips[close] <= most
    return f"use {close} (known: {known})" if likely else f"use one of: {known}"


def _slips(name: str, other: str) -> int:
    """Return how many letters added, left out, changed or swapped make one name of another."""
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
    """Return a value as a message prints it: on one line, and not too long.

    Arrays of NumPy are lists; those of other libraries tell their device, or that they are traced.
    """
    foreign = hasattr(value, "__dlpack__") and type(value).__module__ != "numpy"
    if hasattr(value, "tolist") and not isinstance(value, type) and not foreign:
        # A quantity of Pint has it, but not around one number.
        with suppress(AttributeError):
            value = value.tolist()
    return shortened(" ".join(_PRINTER.repr(value).split()), _LONGEST_VALUE)


def shortened(text: str, longest: int) -> str:
    """Return a text of at most that many characters, its end left out if need be."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


@cache
def named_fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return a model's fields by the names that users give them, which attributes may not have."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def input_error(model: type[BaseModel], error: ValidationError) -> InputError:
    """Return pydantic's complaint about building a `model` as an InputError.

    Sentences start with the field, so an enclosing model can put its own field in front. An
    InputError that is the only complaint stays of its class.
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
