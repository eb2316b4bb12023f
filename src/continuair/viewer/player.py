"""The clocks of a view: which frame is shown when."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

_TICK = 1.0 / 60.0
"""How often a frame is chosen while the flight plays [s]."""


class Clock(ABC):
    """Keeps a view up to date in a thread of its own."""

    def __init__(self) -> None:
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, name="continuair view", daemon=True)

    def start(self) -> None:
        """Start the clock."""
        self._thread.start()

    def stop(self) -> None:
        """Stop, and wait until nothing more is shown."""
        self._done.set()
        self._thread.join()

    @abstractmethod
    def _run(self) -> None:
        """Show due frames until stopped."""


class Player(Clock):
    """Plays times (F,) [s] in real time, calling show(frame) for each that is due."""

    def __init__(self, times: NDArray[np.float64], show: Callable[[int], None]) -> None:
        super().__init__()
        self._times, self._show = times, show
        self.playing, self.speed, self.loop = False, 1.0, True
        self.shown, self.sent = 0, 0
        self._at = float(times[0])
        self._lock = threading.Lock()

    def seek(self, at: float) -> None:
        """Show the frame at a time [s], or the one before."""
        with self._lock:
            self._at = at
            self._show_at(at)

    def advance(self, passed: float) -> None:
        """Advance the time [s], and show the due frame if it is another."""
        with self._lock:
            first, last = float(self._times[0]), float(self._times[-1])
            self._at += self.speed * passed
            if self._at > last:
                self._at, self.playing = (first, True) if self.loop else (last, False)
            self._show_at(self._at)

    def _show_at(self, at: float) -> None:
        frame = max(0, int(np.searchsorted(self._times, at + 1e-9, side="right")) - 1)
        if frame != self.shown or not self.sent:
            self._show(frame)
            self.shown, self.sent = frame, self.sent + 1

    def _run(self) -> None:
        before = due = time.perf_counter()
        while not self._done.wait(max(0.0, due - time.perf_counter())):
            now = time.perf_counter()
            if self.playing:
                self.advance(now - before)
            before, due = now, max(due, now - _TICK) + _TICK
