"""Runs a sweep in many short lives, each ended by SIGKILL: python -m tests.sweeps.lives SETTINGS.

Imports and kernels are loaded once; each life is a fork of that process, so that it starts within
milliseconds and most kills hit the sweep itself. Prints, after each kill, the done units' files.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path
from typing import Any

from continuair.sweeps import load_design, sweep
from continuair.sweeps.units import check

_PATIENCE = 60.0  # seconds


def done_units(store: Path) -> list[int]:
    """Units that a store holds as done, from its files alone."""
    return [int(path.name) for path in store.glob("done/c/*") if path.name.isdecimal()]


def marks(store: Path) -> dict[str, list[int]]:
    """Inode and time of writing of the files of every unit that is done."""
    found = {}
    for unit in done_units(store):
        for path in (store / f"results/c/{unit}/0/0", store / f"done/c/{unit}"):
            status = path.stat()
            found[str(path.relative_to(store))] = [status.st_ino, status.st_mtime_ns]
    return found


def live(design: Path, store: Path, shard: tuple[int, int]) -> int:
    """Start a life; return its process."""
    child = os.fork()
    if child == 0:
        try:
            sweep(design, store, shard=shard)
        finally:
            os._exit(0)
    return child


def end(children: list[int]) -> int:
    """Kill lives; return how many of them the signal ended."""
    for child in children:
        os.kill(child, signal.SIGKILL)
    ended = (os.waitpid(child, 0)[1] for child in children)
    return sum(os.WIFSIGNALED(status) for status in ended)


def killed_lives(settings: dict[str, Any]) -> list[dict[str, Any]]:
    """Live and kill: early ones at any time after the fork, later ones after some progress."""
    chance = random.Random(settings["seed"])
    design, store, shards = Path(settings["design"]), Path(settings["out"]), settings["shards"]
    check(load_design(design), "cpu")
    record: list[dict[str, Any]] = []
    kills = 0
    while kills < settings["kills"]:
        before = len(done_units(store))
        children = [live(design, store, (i + 1, shards)) for i in range(shards)]
        if len(record) >= settings["early"]:
            deadline = time.monotonic() + _PATIENCE
            while len(done_units(store)) == before and time.monotonic() < deadline:
                time.sleep(1e-3)
        time.sleep(chance.uniform(0.0, 0.05))
        kills += end(children)
        record.append({"kills": kills, "done": before, "marks": marks(store)})
    return record


if __name__ == "__main__":
    print(json.dumps(killed_lives(json.loads(sys.argv[1]))))
