"""Hours of it: `python -m tests.fuzz.soak --minutes 60` prints what was tried and found."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tests.fuzz.domains import DOMAINS
from tests.fuzz.trial import OUTCOMES, REFUSED, USED, Tally, attempt_one

_BATCH = 50


def main() -> int:
    """Try every domain in turn until the time is over; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", choices=sorted(DOMAINS), nargs="*", default=sorted(DOMAINS))
    given = parser.parse_args()
    tallies = {name: Tally() for name in given.only}
    until, seed = time.monotonic() + 60.0 * given.minutes, given.first
    with tempfile.TemporaryDirectory() as folder:
        try:
            while time.monotonic() < until:
                for name, tally in tallies.items():
                    _try(name, tally, range(seed, seed + _BATCH), Path(folder))
                seed += _BATCH
                _progress(tallies)
        except KeyboardInterrupt:
            pass
    print(file=sys.stderr)
    print(table(tallies))
    for name, tally in tallies.items():
        for seed, outcome, said in tally.found[:20]:
            print(f"\n{name}, seed {seed}: {outcome}\n{said}")
    return int(any(tally.found for tally in tallies.values()))


def _try(name: str, tally: Tally, seeds: range, folder: Path) -> None:
    for seed in seeds:
        outcome, said = attempt_one(DOMAINS[name], [seed], folder)
        tally.counts[outcome] += 1
        if outcome not in (USED, REFUSED):
            tally.found.append((seed, outcome, said))


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
