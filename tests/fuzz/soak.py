"""Hours of it: `python -m tests.fuzz.soak --minutes 60` counts what was tried and found."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tests.fuzz.domains import DOMAINS
from tests.fuzz.extreme import extreme_flights
from tests.fuzz.processes import PROCESSES
from tests.fuzz.trial import LIMIT, OUTCOMES, Tally, attempt_many

ALL = {**DOMAINS, "extreme flights": extreme_flights, **PROCESSES}
_TRIES = {"extreme flights": 5} | dict.fromkeys(PROCESSES, 1)
"""Seeds of a domain in a round, where they are not fifty."""

_PATIENCE = 180
"""Seconds that a try may last that starts processes."""

_FEW = 50


_HEAD = """# How robust is it against bad input?

Every input that was tried was either used or refused with a message, if the last three columns
below are 0. They count `make soak`, which ran for {minutes:.0f} minutes: mutations of real files,
odd arguments, flights at the edge, and processes that are killed, start together or find the disk
full (`tests/fuzz/`).

* *Used*: it gave a result. *Refused*: an error says what is wrong and what to do.
* *Traceback*: any other exception.
* *Wrong*: it breaks a rule of `tests/fuzz/rules.py`; or the flight is off by more than 0.01 arm
  lengths while its `error_estimate` is below 0.001; or it leaves another store or folder than an
  undisturbed run.
* *Hang*: it takes longer than its limit.
"""


def main() -> int:
    """Try every domain in turn until the time is over; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", choices=list(ALL), nargs="*", default=list(ALL))
    parser.add_argument("--out", type=Path, help="a Markdown file for the counts")
    given = parser.parse_args()
    tallies = {name: Tally() for name in given.only}
    begun, seed = time.monotonic(), given.first
    with tempfile.TemporaryDirectory() as folder:
        try:
            while time.monotonic() < begun + 60.0 * given.minutes:
                for name, tally in tallies.items():
                    last = seed + _TRIES.get(name, _FEW)
                    limit = _PATIENCE if name in PROCESSES else LIMIT
                    attempt_many(ALL[name], range(seed, last), Path(folder), tally, limit)
                seed += _FEW
                _progress(tallies)
        except KeyboardInterrupt:
            pass
    print(file=sys.stderr)
    print(table(tallies))
    if given.out is not None:
        minutes = (time.monotonic() - begun) / 60.0
        given.out.write_text(f"{_HEAD.format(minutes=minutes)}\n{table(tallies)}\n", "utf-8")
    for name, tally in tallies.items():
        for seed, outcome, said in tally.found[:20]:
            print(f"\n{name}, seed {seed}: {outcome}\n{said}")
    return int(any(tally.found for tally in tallies.values()))


def _progress(tallies: dict[str, Tally]) -> None:
    done = sum(tally.counts.total() for tally in tallies.values())
    found = sum(len(tally.found) for tally in tallies.values())
    print(f"\r{done} tried, {found} found", end="", file=sys.stderr, flush=True)


def table(tallies: dict[str, Tally]) -> str:
    """Counts in Markdown."""
    lines = ["| what | tried | " + " | ".join(OUTCOMES) + " |", "| --- |" + " --- |" * 6]
    for name, tally in tallies.items():
        counts = " | ".join(str(tally.counts[outcome]) for outcome in OUTCOMES)
        lines.append(f"| {name} | {tally.counts.total()} | {counts} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
