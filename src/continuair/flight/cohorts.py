"""A prepared flight: vehicle, scenario, options, and its runs in groups with one time grid."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from continuair.engine.adaptive import Inputs, Tolerance
from continuair.engine.compiling import kind_of
from continuair.engine.engine import Drive, Engine, Logs, Start
from continuair.engine.loop import Loop
from continuair.flight.camera_timing import loop_over
from continuair.flight.inputs import CALLED, groups_in_use, groups_of, groups_of_loop, sample_inputs
from continuair.flight.time_grid import Grid, Marks, seen_at, shared_grids, stage_times
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.layout import FIELDS
from continuair.vehicle.vehicle import Vehicle

# Most memory of the inputs of one part of a batch, if every run has its own over time [bytes].
INPUT_BYTES = {"cpu": 1e8, "cuda": 2e9}


@dataclass(frozen=True, eq=False)
class Cohort:
    """Runs of a flight, by their indices (n,), that share a time grid.

    drive: inputs at the stages of the steps; loop: controller loop; sampled: inputs at the samples,
    if known.
    """

    flight: Flight
    runs: NDArray[np.intp]
    grid: Grid
    drive: Drive
    loop: Loop | None
    sampled: Drive | None = None

    @cached_property
    def at_samples(self) -> Drive:
        """Inputs of these runs at the samples."""
        if self.sampled is not None:
            return self.sampled
        times = seen_at(self.grid.samples, self.flight.scenario.jumps)
        return self.flight.drive(times, self.runs)

    @property
    def start(self) -> Start:
        """Initial states of these runs."""
        start = self.flight.start
        return Start(start.states[self.runs], start.angle[self.runs])

    def part(self, at: slice, observe: bool) -> Cohort:
        """Return the group of some of its runs; observe: with inputs at the samples."""

        def of(drive: Drive) -> Drive:
            """Return the inputs of the runs of the part."""
            table = drive.table if drive.table.shape[1] == 1 else drive.table[:, at]
            return replace(drive, table=table)

        sampled = of(self.at_samples) if observe else None
        return replace(self, runs=self.runs[at], drive=of(self.drive), sampled=sampled)

    def fly(self, engine: Engine, names: Collection[str] = (), among: int = 0) -> Logs:
        """Simulate these runs with one model, and observe the named columns.

        among: the runs of the whole flight.
        """
        at_samples = self.at_samples if names else None
        return engine.roll_out(
            self.runs,
            self.start,
            self.grid,
            self.drive,
            at_samples=at_samples,
            names=names,
            loop=self.loop,
            among=among,
        )


@dataclass(frozen=True, eq=False)
class Flight:
    """A vehicle in a scenario, prepared for any model.

    runs: their number; batched: whether results have a dimension for them. start: of all runs;
    steps: of each run (runs,) [s], NaN if adaptive; marks: times at which steps end. coupled: an
    engine of that model, which others share data with. method: "Tsit5", "RK4" or "implicit";
    tolerance: of adaptive steps; kept_inputs: by the runs that they act on;
    making_inputs: held while they are made.
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
    making_inputs: dict[bytes, Lock] = field(default_factory=dict)
    _sampled: dict[tuple[bytes, bytes], Drive] = field(default_factory=dict)
    _engines: dict[tuple[str, str], Engine] = field(default_factory=dict)

    @property
    def counted(self) -> bool:
        """Whether steps are adaptive, each run's own."""
        return self.tolerance is not None

    @property
    def groups(self) -> int:
        """Bits of the groups of inputs in use."""
        called = CALLED if self.scenario.force_callback is not None else ()
        closed = groups_of_loop(self.scenario, self.vehicle)
        return groups_in_use(self.scenario) | groups_of(called) | closed

    def finer(self) -> Flight:
        """Return the flight with finer steps; the difference estimates the error of this one."""
        if self.tolerance is not None:
            kinked = any(term.kinked for term in self.coupled.tree.terms)
            return replace(self, tolerance=self.tolerance.finer(self.scenario.period, kinked))
        return replace(self, steps=0.5 * self.steps)

    def engine(self, model: str, dtype: str = "float64") -> Engine:
        """Return the engine of a model for this flight's vehicle."""
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
        """Vehicle and scenario as JSON, the scenario with the duration of the flight."""
        flown = self.scenario.describe() | {"duration": self.duration}
        described = {"vehicle": self.vehicle.describe(), "scenario": flown}
        return {name: json.dumps(value) for name, value in described.items()}

    def grids(
        self, chosen: NDArray[np.intp] | None = None
    ) -> Iterator[tuple[NDArray[np.intp], Grid]]:
        """Yield the runs, or the chosen ones, by the time grids that they share."""
        chosen = np.arange(self.runs) if chosen is None else chosen
        for at, grid in shared_grids(self.marks, self.steps[chosen]):
            yield chosen[at], grid

    def cohorts(self, chosen: NDArray[np.intp] | None = None) -> Iterator[Cohort]:
        """Yield the runs, or the chosen ones, in groups that share a time grid."""
        for runs, grid in self.grids(chosen):
            yield self.cohort(runs, grid)

    def parts(self, chosen: NDArray[np.intp] | None = None) -> Iterator[Cohort]:
        """Yield groups as `cohorts`, but in parts whose inputs over time fit into memory."""
        for runs, grid in self.grids(chosen):
            size = self._runs_at_once(grid)
            for first in range(0, len(runs), size):
                yield self.cohort(runs[first : first + size], grid)

    def _runs_at_once(self, grid: Grid) -> int:
        """Return how many runs' inputs over a grid fit into memory."""
        at_start, _ = sample_inputs(self.scenario, np.zeros(1), self.coupled.layout)
        timed = any(callable(getattr(self.scenario, name)) for name in FIELDS)
        if not timed or at_start.shape[1] == 1:
            return self.runs
        bytes_per_run = 8 * at_start.shape[2] * len(stage_times(grid))
        return max(1, int(INPUT_BYTES[kind_of(self.coupled.device)] / bytes_per_run))

    def cohort(self, runs: NDArray[np.intp], grid: Grid) -> Cohort:
        """Return some runs over a time grid."""
        drive = self._drive_at_stages(runs, grid)
        closed = self.scenario.controller is not None
        loop = loop_over(self.vehicle, self.scenario, grid, self.runs) if closed else None
        return Cohort(self, runs, grid, drive, loop)

    def _drive_at_stages(self, runs: NDArray[np.intp], grid: Grid) -> Drive:
        """Return the inputs at the stages of steps; the last ones are kept for other models."""
        times = stage_times(grid)
        key = runs.tobytes(), times.tobytes()
        found = self._sampled.get(key)
        if found is None:
            found = self.drive(times, runs)
            # Models fly side by side.
            self._sampled.clear()
            self._sampled[key] = found
        return found

    def drive(self, times: Array, runs: NDArray[np.intp]) -> Drive:
        """Return the inputs of some runs at some times."""
        table, timed = sample_inputs(self.scenario, times, self.coupled.layout, runs, self.runs)
        return Drive(table, timed, self.groups, self.scenario.gravity)
