"""Compiling kernels: a line where it takes long, and several kernels at the same time."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

_SILENCE = 2.0
"""Seconds until a line tells that a kernel is compiled."""

_TIMES = "compile-times"
_STDERR = 2
_HUNG = 60.0
"""Seconds that a process may compile longer than this one, before it counts as hung."""

_hidden: list[int] = []
"""Descriptors of stderr where it is redirected, the latest last."""


@contextmanager
def stderr_behind(descriptor: int) -> Iterator[None]:
    """Write notices to this descriptor while stderr is redirected."""
    _hidden.append(descriptor)
    try:
        yield
    finally:
        _hidden.pop()


@contextmanager
def noticed(module: str, cache: Path) -> Iterator[None]:
    """Tell on stderr that a module is compiled, if that takes long, and how long it took before."""
    kind = module.strip("_").split("_")[0]
    timer = threading.Timer(_SILENCE, _tell, (kind, _last_time(cache, kind)))
    timer.daemon = True
    timer.start()
    begun = time.monotonic()
    try:
        yield
    finally:
        timer.cancel()
    taken = time.monotonic() - begun
    if taken > _SILENCE:
        _keep_time(cache, kind, taken)


def _tell(kind: str, last: float | None) -> None:
    before = "" if last is None else f"; the last one took {last:.0f} s"
    line = f"Compiling a kernel ({kind}) for this kind of vehicle, once{before}.\n"
    descriptor = _hidden[-1] if _hidden else _STDERR
    with suppress(OSError, ValueError, AttributeError):
        if not _is_process_stderr():
            sys.stderr.write(line)
            return
        # A progress bar may stand in the line.
        clear = "\r\x1b[K" if os.isatty(descriptor) else ""
        os.write(descriptor, (clear + line).encode())


def _is_process_stderr() -> bool:
    """Return whether `sys.stderr` is the stderr of the process, not that of a notebook."""
    try:
        return sys.stderr.fileno() == _STDERR
    except OSError:
        return False


def _last_time(cache: Path, kind: str) -> float | None:
    try:
        return float((cache / _TIMES / kind).read_text()[:20])
    except (OSError, ValueError):
        return None


def _keep_time(cache: Path, kind: str, taken: float) -> None:
    with suppress(OSError):
        (cache / _TIMES).mkdir(exist_ok=True)
        (cache / _TIMES / kind).write_text(f"{taken:.1f}\n")


def run_together(tasks: Sequence[Callable[[], object]]) -> None:
    """Run tasks whose results are files, in as many processes as there are cores.

    The first runs in this process. Failures elsewhere are ignored: the caller finds a file missing,
    and makes it itself. Processes are forked, so that tasks need not be pickled. Where other
    threads run, which may hold locks, nothing is forked, and nothing done.
    """
    if sys.platform != "linux" or threading.active_count() > 1:
        return
    several = min(len(tasks), len(os.sched_getaffinity(0)))
    if several < 2:
        return
    children = [_forked(tasks[part::several]) for part in range(1, several)]
    begun = time.monotonic()
    try:
        for task in tasks[::several]:
            task()
    except BaseException:
        for child in children:
            with suppress(OSError):
                os.kill(child, signal.SIGKILL)
        raise
    finally:
        limit = 2.0 * (time.monotonic() - begun) + _HUNG
        for child in children:
            _wait(child, limit)


def _forked(tasks: Sequence[Callable[[], object]]) -> int:
    child = os.fork()
    if child:
        return child
    status = 1
    try:
        for task in tasks:
            task()
        status = 0
    except BaseException:
        # The parent compiles what is missing, and reports why it cannot.
        pass
    finally:
        os._exit(status)


def _wait(child: int, limit: float) -> None:
    """Wait for a process to end, and end it after so many seconds."""
    until = time.monotonic() + limit
    with suppress(ChildProcessError):
        while os.waitpid(child, os.WNOHANG) == (0, 0):
            if time.monotonic() > until:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
                return
            time.sleep(0.02)
