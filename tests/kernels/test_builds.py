"""What a user is told of compiling, and kernels that compile at the same time."""

import os
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import pytest

from continuair.engine import builds

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")


def alone(monkeypatch: pytest.MonkeyPatch, cores: int) -> None:
    """As in a process of one thread, on so many cores; those that test have others."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)))
    monkeypatch.setattr(threading, "active_count", lambda: 1)


def write_its_process(path: Path) -> None:
    path.write_text(str(os.getpid()))


@LINUX
def test_tasks_run_in_several_processes_and_all_are_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone(monkeypatch, 3)
    files = [tmp_path / str(number) for number in range(5)]
    builds.run_together([partial(write_its_process, file) for file in files])
    processes = [int(file.read_text()) for file in files]
    assert processes[0] == processes[3] == os.getpid()
    assert len(set(processes)) == 3


@LINUX
def test_a_task_that_fails_or_hangs_elsewhere_stops_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise RuntimeError

    alone(monkeypatch, 3)
    monkeypatch.setattr(builds, "_HUNG", 0.2)
    own = tmp_path / "own"
    begun = time.monotonic()
    builds.run_together([partial(write_its_process, own), fail, partial(time.sleep, 60.0)])
    assert own.exists() and time.monotonic() - begun < 30.0


@LINUX
def test_an_interrupt_here_ends_the_other_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    alone(monkeypatch, 2)
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        builds.run_together([interrupt, partial(time.sleep, 60.0)])
    assert time.monotonic() - begun < 30.0


def test_a_line_tells_what_is_compiled_and_how_long_it_took_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(builds, "_SILENCE", 0.05)
    for _ in range(2):
        with builds.noticed("adaptive_1234", tmp_path):
            time.sleep(0.6)
    first, second = capfd.readouterr().err.splitlines()
    assert "adaptive" in first and "1 s" not in first
    assert "1 s" in second
    with builds.noticed("adaptive_1234", tmp_path):
        pass
    assert capfd.readouterr().err == ""


MODELS = """
import continuair as ca
vehicle = ca.load_vehicle("paper")
scenario = ca.Scenario("push", [0.0] * 6 + [0.5, 0.1], [0.0] * 8, duration=0.05)
found = ca.run_pairs(vehicle, scenario)
assert (found["status"] == 0).all()
"""


@pytest.mark.slow
def test_a_redirected_command_tells_that_it_compiles(tmp_path: Path) -> None:
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path)}
    ran = subprocess.run(
        [sys.executable, "-c", MODELS], env=environment, capture_output=True, text=True, check=True
    )
    assert ran.stderr.count("Compiling a kernel (adaptive)") == 2
