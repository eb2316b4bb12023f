"""A sweep that is killed at any moment ends as one that was not, on one machine or several."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import continuair as ca
from tests.sweeps.lives import done_units, marks

pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")
pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
UNITS = 120
EARLY = 4
DESIGN = f"""
chunk = 3
seed = 5
[scenario]
test = "A"
[[vary]]
sampling = "latin-hypercube"
count = {3 * UNITS - 1}
"vehicle.arm.radius" = {{ from = 0.003, to = 0.009 }}
"vehicle.uav.mass" = {{ from = 1.0, to = 3.0 }}
"""


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("design") / "killed.toml"
    path.write_text(DESIGN)
    return path


@pytest.fixture(scope="module")
def undisturbed(design: Path) -> dict[str, bytes]:
    """The store of a sweep that nothing interrupts, file by file."""
    store = design.parent / "undisturbed.zarr"
    results = ca.sweep(design, store)
    assert results.attrs["done"] == 3 * UNITS - 1 and not results["status"].any()
    return contents(store)


def contents(store: Path) -> dict[str, bytes]:
    return {str(p.relative_to(store)): p.read_bytes() for p in store.rglob("*") if p.is_file()}


def environment() -> dict[str, str]:
    path = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    return {**os.environ, "PYTHONPATH": path}


def killed(design: Path, store: Path, **settings: int) -> list[dict[str, Any]]:
    text = json.dumps({"design": str(design), "out": str(store), **settings})
    run = subprocess.run(
        [sys.executable, "-m", "tests.sweeps.lives", text],
        env=environment(), cwd=ROOT, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    record: list[dict[str, Any]] = json.loads(run.stdout)
    return record


def assert_same(store: Path, undisturbed: dict[str, bytes], earlier: dict[str, list[int]]) -> None:
    """The store is the undisturbed one to the last bit, and what was done is still that file."""
    found = contents(store)
    assert found.keys() == undisturbed.keys()
    assert [name for name in found if found[name] != undisturbed[name]] == []
    now = marks(store)
    assert {name: now[name] for name in earlier} == earlier


@pytest.mark.parametrize(
    ("shards", "kills"), [pytest.param(1, 24, marks=pytest.mark.soak), (2, 20)]
)
def test_killed_lives_add_up_to_an_undisturbed_sweep(
    design: Path, undisturbed: dict[str, bytes], tmp_path: Path, shards: int, kills: int
) -> None:
    store = tmp_path / "killed.zarr"
    record = killed(design, store, kills=kills, shards=shards, early=EARLY, seed=11)
    assert record[-1]["kills"] >= 20
    progress = [len(life["marks"]) // 2 for life in record]
    assert 0 < progress[-1] < UNITS, "the kills should have hit a sweep under way"
    assert len(set(progress)) > (len(record) - EARLY) // 2, "the kills should have hit it all along"
    for before, after in zip(record, record[1:], strict=False):
        assert before["marks"].items() <= after["marks"].items(), "a done unit was written again"
    for index in range(shards):
        command = [sys.executable, "-c", "from continuair.__main__ import main; main()", "sweep"]
        command += [str(design), "--out", str(store), "--shard", f"{index + 1}/{shards}"]
        run = subprocess.run(command, env=environment(), capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
    assert f"{3 * UNITS - 1} of {3 * UNITS - 1} runs are done" in run.stdout
    assert_same(store, undisturbed, record[-1]["marks"])


def test_a_worker_of_a_cluster_may_be_killed(
    design: Path, undisturbed: dict[str, bytes], tmp_path: Path
) -> None:
    pytest.importorskip("distributed", reason="the extra 'cluster' installs Dask")
    store = tmp_path / "cluster.zarr"
    with cluster(tmp_path) as (address, _, workers):
        command = [sys.executable, "-c", "from continuair.__main__ import main; main()", "sweep"]
        command += [str(design), "--out", str(store), "--scheduler", address]
        run = subprocess.Popen(command, env=environment(), stderr=subprocess.PIPE, text=True)
        wait_for(lambda: len(done_units(store)) > 10 or run.poll() is not None)
        os.kill(workers[0].pid, signal.SIGKILL)
        earlier = marks(store)
        assert 0 < len(earlier) // 2 < UNITS, "the worker should have been killed under way"
        _, said = run.communicate(timeout=120)
        assert run.returncode == 0, said
    assert_same(store, undisturbed, earlier)


def test_the_end_of_the_scheduler_is_told_in_one_sentence(
    design: Path, undisturbed: dict[str, bytes], tmp_path: Path
) -> None:
    pytest.importorskip("distributed", reason="the extra 'cluster' installs Dask")
    store = tmp_path / "cluster.zarr"
    command = [sys.executable, "-c", "from continuair.__main__ import main; main()", "sweep"]
    command += [str(design), "--out", str(store)]
    with cluster(tmp_path) as (address, scheduler, _):
        run = subprocess.Popen(
            [*command, "--scheduler", address],
            env=environment(), stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        wait_for(lambda: len(done_units(store)) > 4 or run.poll() is not None)
        scheduler.kill()
        _, said = run.communicate(timeout=120)
    assert run.returncode == 2, said
    assert said.strip().count("\n") == 0, said
    assert said.startswith("scheduler ")
    assert len(done_units(store)) < UNITS, "the scheduler should have ended under way"
    assert subprocess.run(command, env=environment(), capture_output=True).returncode == 0
    assert_same(store, undisturbed, {})


@contextmanager
def cluster(
    folder: Path,
) -> Iterator[tuple[str, subprocess.Popen[bytes], list[subprocess.Popen[bytes]]]]:
    """A Dask scheduler and two workers, each a process of its own."""
    file = folder / "scheduler.json"
    quiet: dict[str, Any] = {"env": environment(), "cwd": folder, "stderr": subprocess.DEVNULL}
    python = [sys.executable, "-m"]
    options = ["--scheduler-file", str(file), "--no-dashboard"]
    scheduler = subprocess.Popen(
        [*python, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *options],
        **quiet,
    )
    worker = [*python, "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", *options]
    worker += ["--local-directory", str(folder), "--host", "127.0.0.1"]
    processes = [scheduler]
    try:
        # The scheduler makes its file before it writes it.
        wait_for(lambda: file.is_file() and file.read_text().rstrip().endswith("}"))
        processes += [subprocess.Popen(worker, **quiet) for _ in range(2)]
        yield json.loads(file.read_text())["address"], scheduler, processes[1:]
    finally:
        for process in processes:
            process.kill()
            process.wait()


def wait_for(condition: Any) -> None:
    deadline = time.monotonic() + 300.0
    while not condition():
        assert time.monotonic() < deadline, "waited five minutes in vain"
        time.sleep(2e-3)


@pytest.mark.parametrize("apart", [0.0, pytest.param(0.3, marks=pytest.mark.soak)])
def test_shards_that_start_together_on_a_new_store_all_join(
    design: Path, undisturbed: dict[str, bytes], tmp_path: Path, apart: float
) -> None:
    store = tmp_path / "together.zarr"
    shards = []
    for index in range(3):
        command = [sys.executable, "-c", "from continuair.__main__ import main; main()", "sweep"]
        command += [str(design), "--out", str(store), "--shard", f"{index + 1}/3"]
        shards.append(
            subprocess.Popen(command, env=environment(), stderr=subprocess.PIPE, text=True)
        )
        time.sleep(apart)
    said = [shard.communicate(timeout=300)[1] for shard in shards]
    assert [shard.returncode for shard in shards] == [0, 0, 0], said
    assert_same(store, undisturbed, {})
