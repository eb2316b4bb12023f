"""How far long work is, told to whoever asked."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int, str], None]
"""Called with how many steps are done, of how many, and what comes next."""


class Steps:
    """Tells of every step of a study when it begins; the total may grow on the way."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self.total, self.done = total, 0
        self._progress = progress

    def begin(self, what: str) -> None:
        """Tell that the next step begins."""
        if self._progress is not None:
            self._progress(self.done, max(self.total, self.done + 1), what)
        self.done += 1
