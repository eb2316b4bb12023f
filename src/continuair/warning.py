"""Warnings of the package, which a caller may leave untold, or collect, in its own thread alone.

Python's filters of warnings are those of the whole process: threads that change them side by side,
each to put them back, may leave them changed for good.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from continuair.errors import ContinuairWarning

_takers: ContextVar[tuple[Callable[[str], bool], ...]] = ContextVar("takers", default=())
"""Who takes a warning before it is told, the last one first."""


def warn(text: str, stacklevel: int) -> None:
    """Tell a ContinuairWarning of a caller so many levels up, unless somebody takes it."""
    if not any(takes(text) for takes in reversed(_takers.get())):
        warnings.warn(text, ContinuairWarning, stacklevel=stacklevel + 1)


@contextmanager
def untold(*texts: str) -> Iterator[None]:
    """No warnings that begin like one of these patterns, or none at all: for what tells another
    way."""
    with _taken_by(lambda text: not texts or any(re.match(each, text) for each in texts)):
        yield


@contextmanager
def collected() -> Iterator[list[str]]:
    """The texts of the warnings, which are not told."""
    found: list[str] = []

    def takes(text: str) -> bool:
        found.append(text)
        return True

    with _taken_by(takes):
        yield found


@contextmanager
def _taken_by(takes: Callable[[str], bool]) -> Iterator[None]:
    token = _takers.set((*_takers.get(), takes))
    try:
        yield
    finally:
        _takers.reset(token)
