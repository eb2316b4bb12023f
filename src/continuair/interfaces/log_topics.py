"""Topics of a log by role: ROLE=TOPIC[:FIELDS][*SCALE]."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, nearest, shortened, shown

Array = np.ndarray

_LONGEST_LIST = 600


@dataclass(frozen=True)
class Topic:
    """A topic of a log, in a role: its fields, by their own names, and their scales."""

    role: str
    name: str
    fields: tuple[str, ...] = ()
    scale: tuple[float, ...] = ()

    def __str__(self) -> str:
        return f"{self.role} ({self.name})"

    def scaled(self, values: Array) -> Array:
        """Return values (n, width) times the scale, one number or one for each column."""
        if len(self.scale) not in (0, 1, values.shape[1]):
            raise InputError(
                f"scale of {self}",
                f"holds {len(self.scale)} numbers, but there are {values.shape[1]} fields",
                "give one number, or one for each",
            )
        return np.asarray(values * self.scale) if self.scale else values


def parse_topics(
    given: Any, roles: Iterable[str], default: Mapping[str, str] | None = None
) -> dict[str, Topic]:
    """Return role -> topic, of texts TOPIC[:FIELD,...][*NUMBER,...] by role; raises InputError."""
    if not isinstance(given, Mapping):
        raise InputError("topics", f"is {shown(given)}", "give a dict of topics by role")
    for role in given:
        checks.choice("topic", role, roles)
    return {role: _parsed(role, text) for role, text in {**(default or {}), **given}.items()}


def split_topics(options: Iterable[str]) -> dict[str, str]:
    """Return role -> text, of options ROLE=TEXT; raises InputError."""
    found: dict[str, str] = {}
    for option in options:
        role, equals, text = option.partition("=")
        if not equals or role in found:
            raise InputError("topic", f"is {shown(option)}", "give ROLE=TOPIC, once for each role")
        found[role] = text
    return found


def _parsed(role: str, text: Any) -> Topic:
    if not isinstance(text, str) or not text:
        raise InputError("topic", f"{role} is {shown(text)}", "give a topic's name")
    named, times, scale = text.partition("*")
    name, colon, fields = named.partition(":")
    names = tuple(each.strip() for each in fields.split(",")) if colon else ()
    try:
        numbers = tuple(float(each) for each in scale.split(",")) if times else ()
    except ValueError:
        numbers = (np.nan,)
    if not np.isfinite(numbers).all() or not all(names) or not name:
        raise InputError(
            "topic",
            f"{role} is {shown(text)}",
            "write TOPIC:FIELD,FIELD*NUMBER, fields and number where they are needed",
        )
    return Topic(role, name.strip(), names, numbers)


def missing_topic(topic: Topic, there: Iterable[str]) -> InputError:
    """Return the error of a missing topic, which lists those of the log."""
    listed = sorted(there)
    hint = shortened(nearest(topic.name, listed), _LONGEST_LIST) if listed else "it holds none"
    return InputError("data", f"has no topic {topic.name} for {topic.role}", hint)


@contextmanager
def of_log(path: str) -> Iterator[None]:
    """Add the name of a log to errors of the block."""
    try:
        yield
    except InputError as error:
        raise error.located(path) from None
