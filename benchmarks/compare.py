"""Measure continuair beside its peers on this machine: one round of all of them after the other.

    python benchmarks/compare.py [--rounds 7] [--python ADAPTER=PATH ...]
    python benchmarks/compare.py --peers soromox_hub --only "linear strain"

Every peer has an adapter in benchmarks/peers, run as a process of its own. Its Python is this one
where the pinned versions (extras `oracles` and `bench`) are installed here, else .peers/<adapter>,
which is made on first use, or the one that --python names. A peer that cannot be installed or
started is reported as not measured, with the reason. Writes benchmarks/peers.json,
docs/explanation/peers.md and docs/images/peers.png.

With --peers, some of the peers are measured, and with --only, cases whose names contain a text.
Their ratios are printed then, and nothing is written.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter, strftime
from typing import Any

import peers_page
from machine import described_machine

import continuair as ca

ROOT = Path(__file__).parents[1]
ADAPTERS = ROOT / "benchmarks" / "peers"
JSON = ROOT / "benchmarks" / "peers.json"
OURS = "ours"
PEERS = (
    "mujoco_chain",
    "soromox_hub",
    "pinocchio_tree",
    "crazyflow_rigid",
    "rotorpy_rigid",
    "machinevision_servo",
)


class NotMeasured(Exception):
    """Why a peer has no figures."""


@dataclass
class Worker:
    """A process that serves an adapter's cases; `ready` is what it said of itself."""

    adapter: str
    process: subprocess.Popen[str]
    errors: Any
    ready: dict[str, Any] = field(default_factory=dict)

    def answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            self.process.wait()
            self.errors.seek(0)
            said = self.errors.read().strip().splitlines() or ["it ended without a word"]
            raise NotMeasured(said[-1][:200])
        return dict(json.loads(line))

    def ask(self, line: str) -> None:
        assert self.process.stdin is not None
        print(line, file=self.process.stdin, flush=True)

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def vehicle_numbers() -> dict[str, Any]:
    """What the adapters build: the preset `paper`, SI."""
    vehicle = ca.load_vehicle("paper")
    uav, arm = vehicle.uav, vehicle.arm
    names = ("length", "radius", "density", "youngs_modulus", "bending_stiffness")
    return {name: getattr(arm, name) for name in (*names, "mass_per_length")} | {
        "uav_mass": uav.mass,
        "uav_inertia": [uav.inertia[i][i] for i in range(3)],
    }


def pins() -> dict[str, str]:
    """Distribution -> requirement, of the extras `oracles` and `bench`."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    listed = [line for extra in ("oracles", "bench") for line in extras[extra]]
    return {re.split(r"[\[=]", line)[0]: line for line in listed}


def python_for(adapter: str, given: dict[str, str]) -> str:
    """The Python that runs an adapter; makes its environment if there is none."""
    if adapter == OURS or adapter in given:
        return given.get(adapter, sys.executable)
    needs = [sys.executable, str(ADAPTERS / f"{adapter}.py"), "--threads", "1", "--needs"]
    names = json.loads(subprocess.check_output(needs, text=True))
    wanted = [line for name, line in pins().items() if name in names]
    if not wanted:
        raise NotMeasured(f"no extra pins {names[0]}")
    if all(_installed(line) for line in wanted):
        return sys.executable
    folder = ROOT / ".peers" / adapter
    python = folder / "bin" / "python"
    if not (folder / "installed").exists():
        print(f"  installing {', '.join(wanted)}", flush=True)
        _run([sys.executable, "-m", "venv", "--clear", str(folder)])
        _run([str(python), "-m", "pip", "install", "--quiet", *wanted])
        (folder / "installed").touch()
    return str(python)


def _installed(requirement: str) -> bool:
    name, _, wanted = requirement.partition("==")
    try:
        return version(name.split("[")[0]) == wanted
    except PackageNotFoundError:
        return False


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        errors = [line for line in done.stderr.splitlines() if "ERROR" in line] or [done.stderr]
        raise NotMeasured(f"it could not be installed ({errors[-1].strip()[:200]})")


def start(adapter: str, python: str, threads: int, cache: str, *options: str) -> Worker:
    """Start an adapter's process and wait until all its cases have run once."""
    environment = {**os.environ, "JAX_PLATFORMS": "cpu", "XDG_CACHE_HOME": cache}
    environment["WARP_CACHE_PATH"] = f"{cache}/warp"
    if adapter != OURS:
        environment.pop("PYTHONPATH", None)
    Path(cache).mkdir(exist_ok=True)  # engines log where they run
    errors = tempfile.TemporaryFile("w+")  # noqa: SIM115 - read when the worker has died
    command = [python, str(ADAPTERS / f"{adapter}.py"), "--threads", str(threads), *options]
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        command, env=environment, cwd=cache, stdin=pipe, stdout=pipe, stderr=errors, text=True
    )
    worker = Worker(adapter, process, errors)
    worker.ask(json.dumps(vehicle_numbers()))
    worker.ready = worker.answer()
    return worker


def start_up(adapter: str, python: str, cache: str) -> dict[str, Any]:
    """A fresh process until its first case has run once: without caches, and with them."""
    found: dict[str, Any] = {}
    for kind in ("cold", "warm"):
        begin = perf_counter()
        worker = start(adapter, python, 1, cache, "--first")
        found[kind] = {"seconds": perf_counter() - begin, **worker.ready["stages"]}
        found["case"] = next(iter(worker.ready["cases"]))
        found["memory_mib"] = worker.ready["memory_mib"]
        worker.close()
    return found


def measure(workers: list[Worker], rounds: int) -> dict[str, dict[str, list[dict[str, float]]]]:
    """Adapter -> case -> one measurement per round; all cases run once before any runs again."""
    found: dict[str, dict[str, list[dict[str, float]]]] = {
        worker.adapter: {case: [] for case in worker.ready["cases"]} for worker in workers
    }
    for number in range(rounds):
        print(f"  round {number + 1} of {rounds}", flush=True)
        for worker in workers:
            for case in worker.ready["cases"]:
                worker.ask(case)
                found[worker.adapter][case].append(worker.answer())
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--python", action="append", default=[], metavar="ADAPTER=PATH")
    parser.add_argument("--peers", nargs="+", default=PEERS, choices=PEERS)
    parser.add_argument("--only", default="", metavar="TEXT")
    arguments = parser.parse_args()
    given = dict(item.split("=", 1) for item in arguments.python)
    result: dict[str, Any] = {
        "when": strftime("%Y-%m-%d"),
        "machine": described_machine(),
        "rounds": arguments.rounds,
        "vehicle": vehicle_numbers(),
        "not_measured": {},
        "start_up": {},
        "measured": {},
    }
    with tempfile.TemporaryDirectory() as cache:
        pythons: dict[str, str] = {}
        for adapter in (OURS, *arguments.peers):
            print(adapter, flush=True)
            try:
                python = python_for(adapter, given)
                if not arguments.only:
                    result["start_up"][adapter] = start_up(adapter, python, f"{cache}/{adapter}")
                pythons[adapter] = python
            except NotMeasured as reason:
                result["not_measured"][adapter] = str(reason)
                print(f"  not measured: {reason}", flush=True)
        cores = len(os.sched_getaffinity(0))
        for threads in dict.fromkeys((1, cores)):
            print(f"{threads} thread{'s' if threads > 1 else ''}", flush=True)
            workers = _workers(pythons, threads, cache, "--only", arguments.only)
            result["measured"][str(threads)] = measured_by(workers, arguments.rounds)
    if arguments.only or len(arguments.peers) < len(PEERS):
        print_ratios(result)
        return
    JSON.write_text(json.dumps(result, indent=1) + "\n")
    peers_page.write(result, ROOT / "docs")


def _workers(pythons: dict[str, str], threads: int, cache: str, *options: str) -> list[Worker]:
    """Those of the adapters that have cases for so many threads."""
    workers = []
    for adapter, python in pythons.items():
        worker = start(adapter, python, threads, f"{cache}/{adapter}", *options)
        if worker.ready["cases"]:
            workers.append(worker)
        else:
            worker.close()
    return workers


def measured_by(workers: list[Worker], rounds: int) -> dict[str, Any]:
    """Measure the cases of the workers, and end them."""
    found = measure(workers, rounds)
    for worker in workers:
        worker.close()
    return {
        worker.adapter: {
            "versions": worker.ready["versions"],
            "stages": worker.ready["stages"],
            "cases": {
                name: {**case, "rounds": found[worker.adapter][name]}
                for name, case in worker.ready["cases"].items()
            },
        }
        for worker in workers
    }


def print_ratios(result: dict[str, Any]) -> None:
    """Print medians per unit of work, and ratios to ours, of all cases."""
    for threads in result["measured"]:
        clock = "cpu" if threads == "1" else "wall"
        for row in peers_page.rows_of(result, threads, clock):
            per_unit = 1e6 * getattr(row, clock)
            what = f"{row.label}: {per_unit:.4g} µs per {row.case['unit']}"
            print(f"{threads} threads, {what}, {row.ratio:.4g} times ours ({clock})")


if __name__ == "__main__":
    main()
