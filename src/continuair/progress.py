"""Progress reports of long computations."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int, str], None]
"""Callback with the number of finished steps, their total, and the name of the next step."""


class Steps:
    """Reports each step of a study when it begins; the total may grow."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self.total, self.done = total, 0
        self._progress = progress

    def begin(self, what: str) -> None:
        """Report that the next step begins."""
        if self._progress is not None:
            self._progress(self.done, max(self.total, self.done + 1), what)
        self.done += 1
