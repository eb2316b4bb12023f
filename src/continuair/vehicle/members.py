"""Lists of named parts: arms of a vehicle, and sections and tendons of an arm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from continuair.errors import InputError, shown
from continuair.vehicle.fields import Name, Part, label, named

MOST_ARMS = 8
"""Most arms of a vehicle, and most sections, and groups of tendons, of an arm. Kernels are compiled
for each number."""


class NamedPart(Part):
    """Part of a list, with a name of its own."""

    name: Name = ""
    """the name, for the paths of fields"""


Member = TypeVar("Member", bound=NamedPart)


def members(kind: type[Member], value: object, noun: str) -> tuple[Member, ...]:
    """Return arms, or parts of an arm, validated and with unique names."""
    if not isinstance(value, (list, tuple)):
        raise ValueError("must be a list")
    if not 0 < len(value) <= MOST_ARMS:
        raise ValueError(f"must hold 1 to {MOST_ARMS} {noun}s (it has {len(value)})")
    found: list[Member] = []
    problems: list[InputError] = []
    for index, entry in enumerate(value):
        try:
            found.append(_member(kind, entry, index, noun))
        except InputError as error:
            problems.append(error)
    if problems:
        raise InputError.joined(problems)
    names = [each.name for each in found]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise InputError(
                f"{index}.name",
                f"is {name!r}, as is that of {noun} {names.index(name)}",
                f"give each {noun} a unique name",
            )
    return tuple(found)


def _member(kind: type[Member], entry: object, index: int, noun: str) -> Member:
    """Return one arm or part, named by its index if it has no name."""
    if isinstance(entry, Mapping):
        try:
            built = kind(**named(entry, index))
        except InputError as error:
            raise error.within(f"{label(entry, index)}.") from None
    elif isinstance(entry, kind):
        built = entry if entry.name else entry.having(name=str(index))
    else:
        raise InputError(
            str(index),
            f"is {shown(entry)}, but must be a table of fields",
            f"give the fields of one {noun}",
        )
    if built.name.isdecimal() and built.name != str(index):
        raise InputError(
            f"{index}.name",
            f"is {built.name!r}, which reads as the index of another {noun}",
            "give it a letter",
        )
    return built
