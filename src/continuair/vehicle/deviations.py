"""Standard deviations of fields in a vehicle's file, its plain fields, and which are places."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


def split_deviations(fields: Any, path: str = "") -> tuple[Any, dict[str, object]]:
    """Return a file's fields with plain values, and the standard deviations by dotted name."""
    if isinstance(fields, dict):
        if set(fields) == {"value", "sd"}:
            return fields["value"], {path: fields["sd"]}
        return _split(fields.items(), path, dict)
    if isinstance(fields, list):
        return _split(enumerate(fields), path, lambda pairs: [value for _, value in pairs])
    return fields, {}


def _split(items: Iterable[tuple[Any, Any]], path: str, made: Any) -> tuple[Any, dict[str, object]]:
    """Return a table or list with plain values, and the deviations in it."""
    plain: list[tuple[Any, Any]] = []
    deviations: dict[str, object] = {}
    for name, value in items:
        found, inside = split_deviations(value, f"{path}.{name}" if path else str(name))
        plain.append((name, found))
        deviations |= inside
    return made(plain), deviations


def is_place(name: str) -> bool:
    """Return whether a field is a coordinate of a mount or of a centre of mass."""
    *_, of, last = ["", *name.split(".")]
    return last.isdecimal() and of in ("mount", "centre")
