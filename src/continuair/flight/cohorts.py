"""A flight that is ready: vehicle, scenario, choices, and its runs in cohorts of one time grid."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from continuair.engine.adaptive import Inputs, Tolerance
from continuair.engine.engine import Drive, Engine, Logs, Start
from continuair.engine.loop import Loop
from continuair.flight.camera_timing import loop_over
from continuair.flight.inputs import CALLED, groups_in_use, groups_of, sample_inputs
from continuair.flight.time_grid import Grid, Marks, seen_at, shared_grids, stage_times
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import COMMAND, FIELDS
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

# What the inputs of one part of a batch take at most, where every run has its own over time.
_INPUT_BYTES = {"cpu": 1e8, "cuda": 2e9}


@dataclass(frozen=True, eq=False)
class Cohort:
    """Runs of a flight, by their indices (n,), that share a time grid; what acts on them at the
    stages of the steps and, where it is known, at the samples; and what closes their loop."""

    flight: Flight
    runs: Array
    grid: Grid
    drive: Drive
    loop: Loop | None
    sampled: Drive | None = None

    @cached_property
    def at_samples(self) -> Drive:
        """What acts on these runs at the samples."""
        if self.sampled is not None:
            return self.sampled
        times = seen_at(self.grid.samples, self.flight.scenario.jumps)
        return self.flight.drive(times, self.runs)

    @property
    def start(self) -> Start:
        """Where these runs begin."""
        start = self.flight.start
        return Start(start.states[self.runs], start.angle[self.runs])

    def part(self, at: slice, observe: bool) -> Cohort:
        """The cohort of some of its runs; observe: whether it is told what acts at the samples."""

        def of(drive: Drive) -> Drive:
            table = drive.table if drive.table.shape[1] == 1 else drive.table[:, at]
            return replace(drive, table=table)

        sampled = of(self.at_samples) if observe else None
        return replace(self, runs=self.runs[at], drive=of(self.drive), sampled=sampled)

    def fly(self, engine: Engine, observe: bool, among: int = 0) -> Logs:
        """Fly these runs with one model; among: the runs of the whole flight."""
        at_samples = self.at_samples if observe else None
        return engine.roll_out(
            self.runs,
            self.start,
            self.grid,
            self.drive,
            at_samples=at_samples,
            loop=self.loop,
            among=among,
        )


@dataclass(frozen=True, eq=False)
class Flight:
    """A vehicle in a scenario, ready to be flown with any model.

    runs: how many; batched: whether results have a dimension for them. start: of all runs; steps:
    of each run (runs,) [s], NaN where they follow from their errors; marks: times that steps end
    at. coupled: an engine of that model, which others share what they can with. method: "Tsit5",
    "RK4" or "implicit"; tolerance: of steps that follow from their errors; kept_inputs: by the
    runs that they act on.
    """

    vehicle: Vehicle
    scenario: Scenario
    duration: float
    sample: float
    runs: int
    batched: bool
    start: Start
    steps: Array
    marks: Marks
    coupled: Engine
    method: str
    tolerance: Tolerance | None = None
    kept_inputs: dict[bytes, Inputs] = field(default_factory=dict)
    _sampled: dict[tuple[bytes, bytes], Drive] = field(default_factory=dict)
    _engines: dict[tuple[str, str], Engine] = field(default_factory=dict)

    @property
    def counted(self) -> bool:
        """Whether steps are each run's own, as its error allows."""
        return self.tolerance is not None

    @property
    def groups(self) -> int:
        """Bits of the groups of inputs that act."""
        called = CALLED if self.scenario.force_callback is not None else ()
        closed = COMMAND * (self.scenario.controller is not None)
        return groups_in_use(self.scenario) | groups_of(called) | closed

    def finer(self) -> Flight:
        """The same flight with finer steps: what both differ by tells the error of this one."""
        if self.tolerance is not None:
            return replace(self, tolerance=self.tolerance.finer(self.scenario.period))
        return replace(self, steps=0.5 * self.steps)

    def engine(self, model: str, dtype: str = "float64") -> Engine:
        """The engine of a model for this flight's vehicle."""
        one, key = self.coupled, (model, dtype)
        if (*key, self.method) == (one.model, one.dtype.name, one.method):
            return one
        if key not in self._engines:
            at = one.device, one.threads
            made = Engine(self.vehicle, model, dtype, *at, beside=one, method=self.method)
            self._engines[key] = made
        return self._engines[key]

    @cached_property
    def provenance(self) -> dict[str, str]:
        """Vehicle and scenario as JSON, the scenario with the duration that is flown."""
        flown = self.scenario.describe() | {"duration": self.duration}
        described = {"vehicle": self.vehicle.describe(), "scenario": flown}
        return {name: json.dumps(value) for name, value in described.items()}

    def grids(self, chosen: Array | None = None) -> Iterator[tuple[Array, Grid]]:
        """The runs, or those that are chosen, by the time grids that they share."""
        chosen = np.arange(self.runs) if chosen is None else chosen
        for at, grid in shared_grids(self.marks, self.steps[chosen]):
            yield chosen[at], grid

    def cohorts(self, chosen: Array | None = None) -> Iterator[Cohort]:
        """The runs, or those that are chosen, in cohorts that share a time grid."""
        for runs, grid in self.grids(chosen):
            yield self.cohort(runs, grid)

    def parts(self, chosen: Array | None = None) -> Iterator[Cohort]:
        """As `cohorts`, but in parts whose inputs over time fit into memory."""
        for runs, grid in self.grids(chosen):
            size = self._runs_at_once(grid)
            for first in range(0, len(runs), size):
                yield self.cohort(runs[first : first + size], grid)

    def _runs_at_once(self, grid: Grid) -> int:
        at_start, _ = sample_inputs(self.scenario, np.zeros(1), self.coupled.layout)
        timed = any(callable(getattr(self.scenario, name)) for name in FIELDS)
        if not timed or at_start.shape[1] == 1:
            return self.runs
        bytes_per_run = 8 * at_start.shape[2] * len(stage_times(grid))
        return max(1, int(_INPUT_BYTES[self.coupled.device.split(":")[0]] / bytes_per_run))

    def cohort(self, runs: Array, grid: Grid) -> Cohort:
        """Some runs over a time grid."""
        drive = self._drive_at_stages(runs, grid)
        closed = self.scenario.controller is not None
        loop = loop_over(self.vehicle, self.scenario, grid, self.runs) if closed else None
        return Cohort(self, runs, grid, drive, loop)

    def _drive_at_stages(self, runs: Array, grid: Grid) -> Drive:
        """What acts at the stages of steps; the last is kept, as every model asks for the same."""
        times = stage_times(grid)
        key = runs.tobytes(), times.tobytes()
        if key not in self._sampled:
            self._sampled.clear()
            self._sampled[key] = self.drive(times, runs)
        return self._sampled[key]

    def drive(self, times: Array, runs: Array) -> Drive:
        """What acts on some runs at some times."""
        table, timed = sample_inputs(self.scenario, times, self.coupled.layout, runs)
        return Drive(table, timed, self.groups, self.scenario.gravity)
