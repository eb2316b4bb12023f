"""Warnings of the package, which a caller can suppress or collect within its own thread.

Python's warning filters are global to the process. Threads that change and restore them
concurrently may leave them changed.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from continuair.errors import ContinuairWarning

_takers: ContextVar[tuple[Callable[[str], bool], ...]] = ContextVar("takers", default=())
"""Handlers of warnings, of which the last takes precedence."""


def warn(text: str, stacklevel: int) -> None:
    """Issue a ContinuairWarning for a caller `stacklevel` levels up, unless handled."""
    if not any(takes(text) for takes in reversed(_takers.get())):
        warnings.warn(text, ContinuairWarning, stacklevel=stacklevel + 1)


@contextmanager
def untold(*texts: str) -> Iterator[None]:
    """Suppress warnings that match one of the patterns at their start, or all warnings."""
    with _taken_by(lambda text: not texts or any(re.match(each, text) for each in texts)):
        yield


@contextmanager
def collected() -> Iterator[list[str]]:
    """Collect the texts of warnings in place of issuing them."""
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
