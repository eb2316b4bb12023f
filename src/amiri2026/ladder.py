"""Values that are tried from small to large, and how far all of them end well."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def climbed(good: Sequence[bool]) -> int:
    """Return how many are good before the first that is not."""
    return next((place for place, each in enumerate(good) if not each), len(good))


def in_words(entry: dict[str, Any], all_well: str, beyond: str) -> str:
    """Return in words what an entry has "reached", and the next value beyond it.

    all_well: where nothing beyond was tried; else `beyond`, with its value "failed_at" in place of
    {}.
    """
    unit = entry["unit"]
    reached = f"{entry['reached']:g}{unit}" if entry["reached"] else "none"
    if entry["failed_at"] is None:
        return reached + all_well
    first = f"{entry['failed_at']:g}{unit}"
    return f"{reached} ({beyond.format(first)})"
