"""Whole processes: killed at any moment, started together, on a disk that is full."""

import functools
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import continuair as ca
from continuair.studies.results import UNFINISHED
from tests.fuzz.rules import require
from tests.kernels.test_compiling import FIRST_CALLS
from tests.sweeps.test_killed import EARLY, contents, environment, killed

Rng = np.random.Generator

UNITS = 40
DESIGN = f"""
chunk = 3
[scenario]
test = "A"
duration = 0.1
[[vary]]
sampling = "latin-hypercube"
count = {3 * UNITS}
"vehicle.arm.radius" = {{ from = 0.003, to = 0.009 }}
"""


def killed_sweeps(rng: Rng, folder: Path) -> None:
    """A sweep that is killed four times, alone or as two shards, ends as one that was not."""
    design, undisturbed = _undisturbed()
    shards = int(rng.integers(1, 3))
    with _place(folder) as place:
        store = place / "store.zarr"
        killed(design, store, kills=4, shards=shards, early=EARLY, seed=int(rng.integers(1 << 30)))
        for part in range(1, shards + 1):
            _finish(_sweep(design, store, "--shard", f"{part}/{shards}"))
        require(contents(store) == undisturbed, "the store of a killed sweep is another one")


def shards_together(rng: Rng, folder: Path) -> None:
    """Three shards that start at once on a new store all join it."""
    design, undisturbed = _undisturbed()
    with _place(folder) as place:
        store = place / "store.zarr"
        runs = []
        for part in (1, 2, 3):
            runs.append(_sweep(design, store, "--shard", f"{part}/3"))
            time.sleep(float(rng.choice([0.0, 0.0, 0.05, 0.3])))
        for run in runs:
            _finish(run)
        require(contents(store) == undisturbed, "the store of shards is another one")


def first_calls(_: Rng, folder: Path) -> None:
    """Eight threads whose first calls come at once, in two processes at a time."""
    runs = [_start("-c", FIRST_CALLS, cwd=folder) for _ in range(2)]
    for run in runs:
        said = _finish(run)
        require(said == "said meanwhile\nsaid at the end\n", f"first calls said {said!r}")


def killed_studies(rng: Rng, folder: Path) -> None:
    """A result folder whose study was killed says so, and the next run makes it whole."""
    with _place(folder) as place:
        out = place / "results"
        command = ("open-loop", "--tests", "B", "--model", "decoupled", "--out", str(out))
        run = _continuair(*command)
        time.sleep(float(rng.uniform(0.0, 6.0)))
        run.kill()
        run.communicate()
        names = {path.name for path in out.iterdir()} if out.is_dir() else set()
        whole = "test_B_differences.pdf" in names and "frames.svg" in names
        begun = bool(names - {".continuair"})
        require(not begun or whole or UNFINISHED in names, f"a killed study left {sorted(names)}")
        _finish(_continuair(*command))
        require(not (out / UNFINISHED).exists(), "a study that ran says that it did not")
        require((out / "open_loop_B.nc").stat().st_size > 1e5, "a result is missing")


def full_disk(rng: Rng, folder: Path) -> None:
    """A study that may write no more ends in one sentence."""
    most = int(rng.choice([0, 100, 5_000, 50_000, 500_000]))

    def limit() -> None:
        # Python ignores the signal of this limit, and gets the error instead.
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    with _place(folder) as place:
        command = ("open-loop", "--tests", "B", "--model", "decoupled", "--out", str(place / "out"))
        run = _continuair(*command, preexec_fn=limit)
        _, said = run.communicate(timeout=60)
        last = said.strip().splitlines()[-1]
        told = "cannot be written" in last and last.endswith(".")
        require(run.returncode == 2 and told, f"a full disk ended with {run.returncode}: {last}")


PROCESSES = {
    "killed sweeps (4 SIGKILLs each)": killed_sweeps,
    "killed open-loop studies": killed_studies,
    "three shards at once": shards_together,
    "first calls of 2 × 8 threads": first_calls,
    "full disks": full_disk,
}


@functools.cache
def _undisturbed() -> tuple[Path, dict[str, bytes]]:
    folder = Path(tempfile.mkdtemp(prefix="continuair_soak_"))
    design, store = folder / "design.toml", folder / "store.zarr"
    design.write_text(DESIGN)
    ca.sweep(design, store)
    return design, contents(store)


class _place:
    """A folder for one try, gone afterwards."""

    def __init__(self, folder: Path) -> None:
        self.path = Path(tempfile.mkdtemp(dir=folder))

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.path, ignore_errors=True)


def _sweep(design: Path, store: Path, *options: str) -> subprocess.Popen[str]:
    return _continuair("sweep", str(design), "--out", str(store), *options)


def _continuair(*arguments: str, **options: Any) -> subprocess.Popen[str]:
    code = "from continuair.__main__ import main; main()"
    return _start("-c", code, *arguments, **options)


def _start(*arguments: str, **options: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, *arguments], env={**environment(), "COLUMNS": "200"},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def _finish(run: subprocess.Popen[str]) -> str:
    """What it said on standard error; it must end well."""
    _, said = run.communicate(timeout=120)
    require(run.returncode == 0, f"{os.path.basename(str(run.args))} ended: {said[-300:]}")
    return said
