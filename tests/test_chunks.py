"""Runs are simulated in parts that fit into memory, whatever the results need besides."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair import memory
from continuair.flight import chunks, cohorts, inputs, prepare, rollout
from continuair.flight.trajectory import Recorder
from continuair.memory import check_memory
from tests.closed_loop import flights
from tests.refusals import refused

RUNS = 21
PAPER = ca.load_vehicle("paper")
METHODS: dict[str, dict[str, Any]] = {
    "Tsit5": {},
    "RK4": {"method": "RK4", "step": 1e-3},
    "implicit": {"method": "implicit", "step": 1e-3},
}


def starts() -> np.ndarray:
    q = np.zeros((RUNS, 8))
    q[:, 6:] = np.random.default_rng(3).uniform(-1.0, 1.0, (RUNS, 2))
    return q


def pushed() -> tuple[ca.Vehicle, ca.Scenario]:
    """Vehicles, starts and functions of time that differ by run."""
    rates = np.linspace(5.0, 20.0, RUNS)[:, None]
    changes = {"uav.mass": np.linspace(1.5, 2.5, RUNS), "arm.length": np.linspace(0.6, 0.7, RUNS)}
    vehicle = PAPER.replace(changes)
    scenario = ca.Scenario(
        "pushed",
        starts(),
        force=lambda t: np.hstack([np.sin(rates * t), 0.0 * rates, np.cos(rates * t)]),
        bend_moment=lambda t: 0.01 * np.hstack([np.sin(rates * t), np.cos(rates * t)]),
        duration=0.13,
    )
    return vehicle, scenario


def guided() -> tuple[ca.Vehicle, ca.Scenario]:
    """A limited controller with gains and set-points that differ by run."""
    goal, laws = np.random.default_rng(4).uniform(-3.0, 3.0, (RUNS, 3)), []
    for run in range(RUNS):
        laws.append(ca.flight_controller(PAPER, attitude_bandwidth=8.0 + 0.1 * run, rate=200.0))
    setpoints = ca.Setpoints(
        position=np.stack([0.0 * goal, goal], axis=1),
        times=[0.0, 0.1],
        yaw=lambda t: 0.1 * goal[:, :1],
    )
    return PAPER, ca.Scenario(
        "guided", starts(), controller=ca.stack(laws), setpoints=setpoints, duration=0.13
    )


def seeing() -> tuple[ca.Vehicle, ca.Scenario]:
    """A camera before targets that differ by run."""
    paths = [ca.paths.hold([0.002 * run, 0.0, 0.0]) for run in range(RUNS)]
    targets = [ca.Target(path) for path in paths]
    return flights.VEHICLE, flights.scenario(flights.designed(), 0.13, target=targets)


def in_small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let as few runs as possible be simulated at once."""
    for limits in (chunks.LOGGED, chunks.CACHED, cohorts.INPUT_BYTES):
        monkeypatch.setitem(limits, "cpu", 1e4)
    monkeypatch.setattr(inputs, "BYTES_AT_ONCE", 1e5)
    monkeypatch.setattr("continuair.engine.loop._KEPT", 0.0)
    monkeypatch.setattr(rollout, "_PLACES", 2e5)
    monkeypatch.setattr("continuair.engine.pack.MOST_KEPT", 0)


@pytest.mark.filterwarnings("ignore:controller|error_estimate|step is")
@pytest.mark.parametrize(
    ("made", "method"),
    [
        pytest.param(made, method, marks=[pytest.mark.long] if i != j else [])
        for i, made in enumerate((pushed, guided, seeing))
        for j, method in enumerate(METHODS)
    ],
)
def test_runs_in_parts_are_those_of_the_whole_batch_bit_by_bit(
    made: Callable[[], tuple[ca.Vehicle, ca.Scenario]],
    method: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    vehicle, scenario = made()
    options: dict[str, Any] = {"sample": 0.01, "check": True, "threads": 2} | METHODS[method]
    whole = ca.simulate(vehicle, scenario, **options)
    in_small_parts(monkeypatch)
    parts = ca.simulate(vehicle, scenario, **options)
    xr.testing.assert_identical(parts, whole)


def test_a_controller_at_its_limits_is_reported_alike_in_parts_and_without_its_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    laws = [ca.hold(PAPER, [3.0, 0.0, 0.1 * run], force=[2.0, 1.0, 60.0]) for run in range(RUNS)]
    scenario = ca.Scenario("limited", starts(), controller=ca.stack(laws), duration=0.13)
    reports = []
    for names in (["position", "command"], ["position"]):
        with pytest.warns(ca.ContinuairWarning, match="reaches its limits") as caught:
            flown = ca.simulate(PAPER, scenario, sample=0.01, variables=names)
        assert ("command" in flown) == ("command" in names)
        reports.append(str(caught[0].message))
        in_small_parts(monkeypatch)
    assert reports[0] == reports[1]


def recorder_of(runs: int, method: str) -> Recorder:
    tolerance = prepare.tolerance_for("Tsit5") if method == "Tsit5" else None
    scenario = ca.Scenario("many", np.tile(starts()[:1], (runs, 1)), duration=0.05)
    flight = prepare.prepare(
        PAPER, scenario, tolerance=tolerance, threads=1, step="auto" if tolerance else 1e-3
    )
    return Recorder(flight, "coupled", ("tip_position",), "float64")


@pytest.mark.long
@pytest.mark.parametrize("method", ["Tsit5", "RK4"])
def test_a_simulation_needs_memory_for_its_results_and_one_part(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = recorder_of(20_000, method)
    kept, working = recorder.needed(), rollout.working_bytes(recorder)
    # Of more runs, only a few numbers each are needed at any time: no more than 200 are.
    more = rollout.working_bytes(recorder_of(40_000, method)) - working
    assert 0.0 < more < 20_000 * 200 * 8
    for free, fits in ((sum(kept.values()) + 1.01 * working, True), (sum(kept.values()), False)):
        monkeypatch.setattr(memory, "free_memory", lambda free=free: free)
        if fits:
            check_memory(kept, working)
            continue
        with refused("duration"):
            check_memory(kept, working)
        with refused("duration"):
            ca.simulate(
                PAPER, recorder.flight.scenario, variables=["tip_position"], threads=1,
                **METHODS[method],
            )  # fmt: skip


CHILD = """
import resource, sys
import numpy as np, continuair as ca
vehicle = ca.load_vehicle("paper")
def flown(runs, **options):
    q = np.zeros((runs, 8))
    q[:, 6] = np.linspace(-1.0, 1.0, runs)
    scenario = ca.Scenario("many", q, duration=0.05)
    return ca.simulate(vehicle, scenario, variables=["tip_position"], threads=1, **options)
def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
options = {"method": "RK4", "step": 1e-3} if sys.argv[1] == "RK4" else {}
flown(512, **options)
before = peak()
kept = flown(40_000, **options)["tip_position"].nbytes
print(peak() - before - kept)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss counts kilobytes on Linux")
@pytest.mark.parametrize("method", ["Tsit5", "RK4"])
def test_the_peak_memory_of_many_runs_is_that_of_the_results_and_one_part(method: str) -> None:
    own = {**os.environ, "OMP_NUM_THREADS": "1"}
    found = subprocess.run(
        [sys.executable, "-c", CHILD, method], env=own, check=True, capture_output=True, text=True
    )
    more, allowed = float(found.stdout), rollout.working_bytes(recorder_of(40_000, method))
    # The logs of all runs have 0.5 GB, and twice as much with what is derived from them.
    assert more < allowed + 5e7
    assert allowed < 4.5e8
