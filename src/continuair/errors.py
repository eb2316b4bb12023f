"""Exceptions and warnings about inputs, and the format of their messages."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Sequence
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

    `str(error)` is one sentence with the field, its value and the remedy. If several fields are
    invalid, it has one sentence per line.

    Parameters
    ----------
    field : str
        Dotted path of the field, such as ``"arm.radius"``, or name of the argument.
    problem : str
        Value of the field and what is wrong with it, such as ``"is -1, but must be positive"``.
    remedy : str
        What to do, such as ``"give a length [m]"``.

    Attributes
    ----------
    place : str
        Name of the file, run or worker that holds the field, or an empty string.
    errors : tuple of InputError
        Errors of all invalid fields, this one first.

    Examples
    --------
    >>> error = ca.InputError("radius", "is -1, but must be positive", "give a length [m]")
    >>> print(error.within("arm."))
    arm.radius is -1, but must be positive; give a length [m].
    >>> error.within("arm.").field
    'arm.radius'
    """

    def __init__(self, field: str, problem: str, remedy: str) -> None:
        super().__init__(field, problem, remedy)
        self.field = field
        self.problem = problem
        self.remedy = remedy
        self.place = ""
        self._others: tuple[InputError, ...] = ()

    def __str__(self) -> str:
        return "\n".join(each._sentence() for each in self.errors)

    def _sentence(self) -> str:
        where = f"{self.place}: " if self.place else ""
        return f"{where}{self.field} {self.problem}; {self.remedy}."

    @property
    def errors(self) -> tuple[InputError, ...]:
        """Errors of all invalid fields, this one first."""
        return (self, *self._others)

    @staticmethod
    def joined(errors: Sequence[InputError]) -> InputError:
        """Return the first error, which names the fields of the others as well.

        Parameters
        ----------
        errors : sequence of InputError
            Errors of one field or several each, at least one.

        Returns
        -------
        InputError
            An error of the class of the first error.
        """
        first, *others = (each for error in errors for each in error.errors)
        found = first._moved(first.field, first.place)
        found._others = tuple(others)
        return found

    def within(self, prefix: str) -> InputError:
        """Return the same error with a prefix before each field.

        Parameters
        ----------
        prefix : str
            Path of the enclosing field, such as ``"arm."``.

        Returns
        -------
        InputError
            An error of the same class.
        """
        return self.joined([each._moved(prefix + each.field, each.place) for each in self.errors])

    def located(self, place: str) -> InputError:
        """Return the same error with a place before each sentence.

        Parameters
        ----------
        place : str
            File, run or worker that the fields belong to, such as ``"drone.toml"``.

        Returns
        -------
        InputError
            An error of the same class.
        """
        return self.joined(
            [
                each._moved(each.field, f"{place}: {each.place}" if each.place else place)
                for each in self.errors
            ]
        )

    def _moved(self, field: str, place: str) -> InputError:
        moved = type(self)(field, self.problem, self.remedy)
        moved.place = place
        return moved


class CannotHover(InputError):
    """The maximum thrust of a vehicle is below its weight."""


class ContinuairWarning(UserWarning):
    """An input is valid, but may not be what was intended."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return the clause that suggests the nearest of the `valid` names, or lists them all."""
    names = list(valid)
    table = name.rpartition(".")[0]
    alone = all(other.rpartition(".")[0] == table for other in names)
    # Fields of one table without its path, which a sentence has room for once.
    known = ", ".join(other.rpartition(".")[2] if alone else other for other in names)
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

    def repr_function(self, x: Any, level: int) -> str:
        return f"<function {x.__name__}>"  # without its address, which differs between processes


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

    Its fields are those of the model, so that an enclosing model can prepend its own. The
    class is that of the first error.
    """
    return InputError.joined([_error_of(model, item) for item in error.errors()])


def _error_of(model: type[BaseModel], item: Any) -> InputError:
    cause = item.get("ctx", {}).get("error")
    field = ".".join(str(key) for key in item["loc"])
    if isinstance(cause, InputError):
        return cause.within(f"{field}.") if field else cause
    name = str(item["loc"][0])
    description = " ".join((named_fields(model)[name].description or "a valid value").split())
    if item["type"] == "missing":
        return InputError(field, "is missing", f"give {description}")
    demand = str(cause) if cause else _demand(item)
    return InputError(field, f"is {shown(item['input'])}, but {demand}", f"give {description}")


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
