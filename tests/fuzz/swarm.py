"""Thousands of damaged files of others: `python -m tests.fuzz.swarm --count 20000`.

One process reads file after file, within bounds of time and memory, and another takes its place
where it is killed; a process for each file would take most of the time.
"""

import argparse
import json
import os
import resource
import select
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from tests.fuzz.foreign import KINDS, attempt, samples
from tests.fuzz.trial import REFUSED, USED, WRONG, attempt_one

LIMIT, WAIT, PATIENCE = 10, 60, 90
"""Seconds of a processor that a file may take, and those by the clock after which it is given up
and its process killed."""

MEMORY = 1 << 30
"""Bytes that a file may take."""

_ROOM = 2 << 30
"""Bytes of addresses that a process may take beside those that it begins with."""

KILLED = "killed"


class Reader:
    """A process that reads damaged files, begun again when it ends."""

    def __init__(self, of_samples: Path, folder: Path) -> None:
        command = [sys.executable, "-m", "tests.fuzz.swarm", "--read", str(of_samples), str(folder)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        self._answer(120)  # that it has begun

    def read(self, kind: int, seed: int) -> tuple[str, str]:
        """What became of a file, and what was said."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{kind} {seed}\n".encode())
        self._process.stdin.flush()
        line = self._answer(PATIENCE)
        if line is None:
            status = self._process.poll()
            self.end()
            return KILLED, f"ended with {status}" if status is not None else "did not answer"
        outcome, said = json.loads(line)
        return outcome, said

    @property
    def has_ended(self) -> bool:
        """Whether another one is needed."""
        return self._process.poll() is not None

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()

    def _answer(self, patience: float) -> bytes | None:
        assert self._process.stdout is not None
        if not select.select([self._process.stdout], [], [], patience)[0]:
            return None
        return self._process.stdout.readline() or None


def swarm(count: int, first: int, folder: Path) -> Iterator[tuple[str, int, str, str]]:
    """Read so many damaged files, of every kind in turn: kind, seed, outcome, what was said."""
    of_samples, copies = folder / "samples", folder / "tries"
    of_samples.mkdir()
    copies.mkdir()
    samples(of_samples)
    reader = Reader(of_samples, copies)
    try:
        for index in range(count):
            kind, seed = index % len(KINDS), first + index // len(KINDS)
            if reader.has_ended:
                reader = Reader(of_samples, copies)
            yield KINDS[kind].name, seed, *reader.read(kind, seed)
    finally:
        reader.end()


def _read(of_samples: Path, folder: Path) -> None:
    """Read the files that lines of the standard input name, and answer with lines."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + _ROOM, taken + _ROOM))
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        kind, seed = map(int, line.split())
        before, begun = _reset_peak(), time.process_time()
        tried = partial(attempt, KINDS[kind], of_samples)
        outcome, said = attempt_one(tried, [kind, seed], folder, WAIT)
        took, grown = time.process_time() - begun, _peak() - before
        if outcome in (USED, REFUSED) and grown > MEMORY:
            outcome, said = WRONG, f"took {grown / 2**30:.2f} GiB"
        if outcome in (USED, REFUSED) and took > LIMIT:
            outcome, said = WRONG, f"took {took:.1f} s"
        print(json.dumps([outcome, said]), file=answers, flush=True)


def _reset_peak() -> int:
    """Bytes that the process holds, from which its peak is counted."""
    Path("/proc/self/clear_refs").write_text("5")
    return _peak()


def _peak() -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def main() -> int:
    """Read damaged files, and count what became of them; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--read", type=Path, nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.read:
        _read(*given.read)
        return 0
    counts: Counter[tuple[str, str]] = Counter()
    found, done = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for name, seed, outcome, said in swarm(given.count, given.first, Path(folder)):
            counts[name, outcome] += 1
            done += 1
            if done % 100 == 0:
                print(f"\r{done} read, {found} found", end="", file=sys.stderr, flush=True)
            if outcome not in (USED, REFUSED):
                found += 1
                print(f"\n{name}, seed {seed}: {outcome}\n{said}", flush=True)
    print(file=sys.stderr)
    for (name, outcome), count in sorted(counts.items()):
        print(f"{name}: {outcome} {count}")
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
