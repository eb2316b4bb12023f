"""Flying batches of candidate vehicles through the paper's four tests, reduced to their tips."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.engine.engine import Engine
from continuair.engine.pack import per_run
from continuair.flight.steps import fastest_frequency
from continuair.flight.time_grid import Grid, groups_in_use, make_grid, sample_inputs, stage_times
from continuair.identification.diagonal import DiagonalEngine
from continuair.identification.readings import Flight, Tips
from continuair.scenario.paper_tests import open_loop_test
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.layout import ONE_SECTION
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_MODELS = {"block": "decoupled", "independent": "independent"}


@dataclass(frozen=True)
class Accuracy:
    """phase: largest ω_max h of a step; largest: step at most [s]; sample: between samples [s]."""

    phase: float
    largest: float
    sample: float


SEARCH = Accuracy(0.4, 2e-3, 4e-3)
"""While searching: errors of some percent of a metric, which the objective hardly sees."""

FINAL = Accuracy(0.1, 2.5e-4, 1e-3)
"""For what is reported."""

STEEPEST = 2e3
"""Vehicles of a higher bending frequency [rad/s] are not flown: an arm so stiff hardly bends."""


def step_groups(vehicle: Vehicle, accuracy: Accuracy) -> Iterator[tuple[Array, float]]:
    """Yield the runs that share a step, and the step [s]; runs without a usable one are left out.

    A step is a power of two of parts of a sample.
    """
    q = np.asarray(open_loop_test("B").q)[None]
    runs = vehicle.runs or 1
    engine = Engine(vehicle, "coupled")
    straight = q.copy()
    straight[:, 6] = 0.0
    fastest = np.fmax(*(fastest_frequency(engine, np.repeat(at, runs, 0)) for at in (straight, q)))
    flown = np.isfinite(fastest) & (fastest < STEEPEST)
    step = np.minimum(accuracy.largest, accuracy.phase / np.where(flown, fastest, 1.0))
    pieces = 2 ** np.ceil(np.log2(accuracy.sample / step) - 1e-9).astype(int)
    for count in np.unique(pieces[flown]):
        yield np.flatnonzero(flown & (pieces == count)), accuracy.sample / count


class Flights:
    """Flies one batch of vehicles, all with one step; remembers what it has flown."""

    def __init__(self, vehicle: Vehicle, step: float, sample: float) -> None:
        self.vehicle, self.step, self.sample = vehicle, step, sample
        self.runs = vehicle.runs or 1
        self._engines: dict[str, Any] = {}
        self._flown: dict[tuple[Any, ...], Tips] = {}

    def fly(self, model: str, flight: Flight, test: str) -> Tips:
        """Tips of a model ("coupled", or as in `Flight`) in a test; NaN where a run fails."""
        forced = flight.force_signs if test == "D" else None
        key = (model, test, flight.gravity, flight.bend, forced)
        if key not in self._flown:
            flown = self._diagonal if model == "diagonal" else self._kernel
            drive = _drive(test, flight.bend, forced, self.step, self.sample)
            self._flown[key] = flown(model, drive, flight.gravity)
        return self._flown[key]

    def _kernel(self, model: str, drive: Drive, gravity: float) -> Tips:
        engine, scenario = self._engine(model), drive.scenario
        q = np.broadcast_to(scenario.q, (self.runs, 8))
        start = state_from_paper(q, np.zeros_like(q))
        groups = groups_in_use(scenario)
        inputs = drive.inputs
        logs = engine.roll_out(
            start, q[:, -1], drive.grid, inputs, inputs, gravity, groups, observe=False
        )
        log, layout = logs.log, engine.layout
        log[logs.status != 0] = np.nan
        twist = log[..., layout.branch][..., 1]
        at = log[..., layout.position], log[..., layout.attitude], log[..., layout.bend]
        return tips(self.vehicle, *at, twist)

    def _diagonal(self, model: str, drive: Drive, gravity: float) -> Tips:
        layout, (table, stride) = ONE_SECTION, drive.inputs
        rows = [table[..., layout.force], table[..., layout.euler_and_polar]]
        rows.append(table[..., layout.tip_wrench][..., :3])
        inputs = np.ascontiguousarray(np.concatenate(rows, -1)[:, 0])
        start = np.zeros((self.runs, 16))
        start[:, :8] = drive.scenario.q
        q = self._engine(model).roll_out(start, drive.grid, (inputs, stride), gravity)[..., :8]
        bent = np.abs(q[..., 6]) * per_run(self.vehicle.arm.length, self.runs)[:, None]
        q[~(np.isfinite(q).all((1, 2)) & (bent.max(1) < 2.0 * np.pi))] = np.nan
        euler = np.nan_to_num(q[..., 5:2:-1]).reshape(-1, 3)
        attitude = Rotation.from_euler("ZYX", euler).as_quat().reshape(*q.shape[:2], 4)
        along = np.stack([np.cos(q[..., 7]), np.sin(q[..., 7])], -1)
        return tips(self.vehicle, q[..., :3], attitude, q[..., 6:7] * along, q[..., 7])

    def _engine(self, model: str) -> Any:
        if model not in self._engines:
            self._engines[model] = (
                DiagonalEngine(self.vehicle, os.cpu_count() or 1)
                if model == "diagonal"
                else Engine(self.vehicle, _MODELS.get(model, model))
            )
        return self._engines[model]


@dataclass(frozen=True)
class Drive:
    """A test on a time grid: the scenario, the grid, and its inputs at the stages of the steps."""

    scenario: Scenario
    grid: Grid
    inputs: tuple[Array, int]


# The inputs are functions in Python: sampling them takes as long as flying some vehicles.
@lru_cache(maxsize=128)
def _drive(
    test: str, bend: int, force_signs: tuple[float, float] | None, step: float, sample: float
) -> Drive:
    scenario = read_test(test, bend, force_signs)
    grid = make_grid(scenario.duration, step, sample)
    return Drive(scenario, grid, sample_inputs(scenario, stage_times(grid), ONE_SECTION))


def read_test(test: str, bend: int, force_signs: tuple[float, float] | None) -> Scenario:
    """One of the paper's tests at the hanging arm, as a `Flight` reads it.

    bend: sign of the initial bend. force_signs: of the tip force, across and along z.
    """
    scenario = open_loop_test(test)
    q = np.array(scenario.q)
    q[6] *= bend
    if force_signs is None:
        return scenario.replace(q=q)
    across, along = force_signs
    given: Any = scenario.tip_wrench
    signs = np.array([across, across, along, 0.0, 0.0, 0.0])
    return scenario.replace(q=q, tip_wrench=lambda t: signs * given(t), tip_wrench_sign=1)


def tips(vehicle: Vehicle, position: Array, attitude: Array, bend: Array, twist: Array) -> Tips:
    """Tips of runs (runs, samples, …) from position, attitude and bend vector of the UAV."""
    runs = len(position)
    length = per_run(vehicle.arm.length, runs)[:, None]
    mount = per_run(vehicle.uav.mount, runs, 3)[:, None]
    size = np.linalg.norm(bend, axis=-1)
    # sin(x)/x and the like are smooth at 0; np.sinc takes x/π.
    half = np.sinc(size * length / (2.0 * np.pi))
    across = (0.5 * length**2 * half**2)[..., None] * bend
    down = -length * np.sinc(size * length / np.pi)
    point = mount + np.concatenate([across, down[..., None]], -1)
    turn = np.zeros((*size.shape, 4))
    turn[..., 0] = 0.5 * length * half * bend[..., 1]
    turn[..., 1] = -0.5 * length * half * bend[..., 0]
    turn[..., 3] = np.cos(0.5 * size * length)
    return Tips(position + _rotated(attitude, point), _product(attitude, turn), twist)


def _rotated(q: Array, v: Array) -> Array:
    cross = 2.0 * np.cross(q[..., :3], v)
    return v + q[..., 3:] * cross + np.cross(q[..., :3], cross)


def _product(a: Array, b: Array) -> Array:
    vector = a[..., 3:] * b[..., :3] + b[..., 3:] * a[..., :3] + np.cross(a[..., :3], b[..., :3])
    scalar = a[..., 3] * b[..., 3] - np.sum(a[..., :3] * b[..., :3], -1)
    return np.concatenate([vector, scalar[..., None]], -1)
