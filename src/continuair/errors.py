"""What a user is told when an input cannot be used."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

INTERRUPTED = 130
"""What shells report for a process ended by Ctrl-C."""

_LONGEST_VALUE = 80


class InputError(ValueError):
    """An input of the user cannot be used; each sentence names the field, its value and the remedy.

    `str(error)` holds one sentence per line; nearly always there is one.
    """

    def __init__(self, *sentences: str) -> None:
        super().__init__("\n".join(sentences))
        self.sentences = tuple(line for text in sentences for line in text.splitlines())

    def within(self, prefix: str) -> InputError:
        """Return the same error, every sentence of it starting with `prefix`."""
        return InputError(*(prefix + sentence for sentence in self.sentences))


class ContinuairWarning(UserWarning):
    """An input can be used, but may not be what its author meant."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return the clause that tells which of the `valid` names was meant, or lists them all."""
    names = list(valid)
    close = difflib.get_close_matches(name, names, n=1)
    known = ", ".join(names)
    return f"use {close[0]} (known: {known})" if close else f"use one of: {known}"


def shown(value: object) -> str:
    """Return a value as a message prints it: on one line, and not too long."""
    if hasattr(value, "tolist") and not isinstance(value, type):
        value = value.tolist()
    return shortened(" ".join(reprlib.repr(value).split()), _LONGEST_VALUE)


def shortened(text: str, longest: int) -> str:
    """Return a text of at most that many characters, its end left out if need be."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


def input_error(model: type[BaseModel], error: ValidationError) -> InputError:
    """Return pydantic's complaint about building a `model` as an InputError.

    Sentences start with the field, so an enclosing model can put its own field in front.
    """
    return InputError(*(line for item in error.errors() for line in _sentences(model, item)))


def _sentences(model: type[BaseModel], item: Any) -> list[str]:
    cause = item.get("ctx", {}).get("error")
    field = ".".join(str(key) for key in item["loc"])
    if isinstance(cause, InputError):
        return list(cause.within(f"{field}." if field else "").sentences)
    name = str(item["loc"][0])
    description = " ".join((model.model_fields[name].description or "a valid value").split())
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
