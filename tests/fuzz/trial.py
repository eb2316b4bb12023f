"""What becomes of a try: used, refused in a sentence, or one of the things that must not happen."""

import signal
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from continuair.errors import ContinuairWarning, InputError

USED, REFUSED, TRACEBACK, WRONG, HANG = "used", "refused", "tracebacks", "wrong", "hangs"
OUTCOMES = (USED, REFUSED, TRACEBACK, WRONG, HANG)
LIMIT = 30
"""Seconds that a try may last."""


class Wrong(Exception):
    """Something was accepted, or answered, that a written rule forbids."""


class Slow(BaseException):
    """A try lasts too long; no handler of the code under test takes it for its own."""


@dataclass
class Tally:
    """Counts of a domain, and the seeds of what must not happen, with what happened."""

    counts: Counter[str] = field(default_factory=Counter)
    found: list[tuple[int, str, str]] = field(default_factory=list)


Attempt = Callable[[np.random.Generator, Path], None]


def attempt_one(
    attempt: Attempt, seed: list[int], folder: Path, limit: int = LIMIT
) -> tuple[str, str]:
    """The outcome of one try, and what was said; limit: how long it may last [s]."""

    def stop(*_: Any) -> None:
        raise Slow

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(limit)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContinuairWarning)
            attempt(np.random.default_rng(seed), folder)
        return USED, ""
    except InputError as error:
        return _judged(str(error))
    except Wrong as error:
        return WRONG, str(error)
    except Slow:
        return HANG, f"more than {limit} s"
    except Exception:
        return TRACEBACK, traceback.format_exc()
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _judged(said: str) -> tuple[str, str]:
    """A refusal is a sentence, or one per line for each thing that is wrong, of bearable length."""
    lines = said.split("\n")
    if len(said) > 3000 or any(not line.endswith(".") or len(line) > 700 for line in lines):
        return WRONG, f"a refusal that is no sentence: {said[:300]!r}"
    return REFUSED, said


def attempt_many(
    attempt: Attempt, seeds: range, folder: Path, tally: Tally, limit: int = LIMIT
) -> None:
    """Try every seed, and count what becomes of it."""
    for seed in seeds:
        outcome, said = attempt_one(attempt, [seed], folder, limit)
        tally.counts[outcome] += 1
        if outcome not in (USED, REFUSED):
            tally.found.append((seed, outcome, said))
