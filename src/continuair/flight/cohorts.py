"""A flight that is ready: vehicle, scenario, choices, and its runs in cohorts of one time grid."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from continuair.engine.adaptive import Tolerance
from continuair.engine.engine import Drive, Engine, Logs, Start
from continuair.engine.loop import Loop
from continuair.flight.camera_timing import loop_over
from continuair.flight.inputs import CALLED, groups_in_use, groups_of, sample_inputs
from continuair.flight.probing import warn_of_jumps
from continuair.flight.pulses import Pulses
from continuair.flight.resolution import (
    RESOLVED,
    may_multiply,
    most_in_loop,
    most_in_sight,
    step_error,
    turned_through,
    unresolved,
)
from continuair.flight.rotors import within_limits
from continuair.flight.time_grid import Grid, Marks, seen_at, shared_grids, stage_times
from continuair.kernels.integrators import INTEGRATORS
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import COMMAND, FIELDS
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_UNRESOLVED = 1.01 * RESOLVED
"""What abrupt inputs add to step_error, until halving the step tells what they cost."""

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

    def fly(self, engine: Engine, observe: bool) -> Logs:
        """Fly these runs with one model."""
        at_samples = self.at_samples if observe else None
        return engine.roll_out(
            self.runs, self.start, self.grid, self.drive, at_samples=at_samples, loop=self.loop
        )


@dataclass(frozen=True, eq=False)
class Flight:
    """A vehicle in a scenario, ready to be flown with any model.

    runs: how many; batched: whether results have a dimension for them. start: of all runs; steps:
    of each run (runs,) [s]; longest: those that vehicle, start and inputs bear, however close the
    samples are (runs,) [s]; missed: whether its steps miss what its inputs do (runs,); abrupt:
    the share of what half the step changes that counts, where it is more than the method's, as
    inputs move or arms cross a wash as no step follows at full order, or 0 (runs,); both as far as
    has been seen; sensitive: whether errors may multiply, as arms of several sections swing far or
    a law answers to them, and turned: the angle that the UAV turns through in all [rad], once it
    has been flown (runs,); marks: times that steps end at. coupled: an engine of that model, which
    others share what they can with. automatic: whether the steps may
    be made finer; method: "RK4", "implicit", "Tsit5" or "DOP853"; told:
    inputs whose jumps have been told of, unseen: that swing between stages; lost: times near which
    samples did not follow the Euler angles of q [s]; tolerance: of steps that follow from their
    errors; plain: whether steps of one length are taken as they are, and tell no error.
    """

    vehicle: Vehicle
    scenario: Scenario
    duration: float
    sample: float
    runs: int
    batched: bool
    start: Start
    steps: Array
    longest: Array
    missed: Array
    abrupt: Array
    sensitive: Array
    turned: Array
    marks: Marks
    coupled: Engine
    automatic: bool
    method: str
    told: set[str] = field(default_factory=set)
    unseen: set[str] = field(default_factory=set)
    lost: list[float] = field(default_factory=list)
    tolerance: Tolerance | None = None
    plain: bool = False
    _sampled: dict[tuple[bytes, bytes], Drive] = field(default_factory=dict)
    _engines: dict[tuple[str, str], Engine] = field(default_factory=dict)

    @property
    def adaptive(self) -> bool:
        """Whether it is flown by the reference integrator."""
        return self.method == "DOP853"

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

    @property
    def looks(self) -> bool:
        """Whether a law closes its loop through a camera."""
        law = self.scenario.controller
        return law is not None and law.looks

    @cached_property
    def twists(self) -> bool:
        """Whether torques along Euler angles or bends act, whose direction may hang on the step."""
        tau = self.scenario.tau
        return tau is not None and (callable(tau) or bool(np.any(np.asarray(tau)[..., 3:])))

    def step_error(self, sums: Array, chosen: Array) -> Array:
        """step_error (n,) or (n, models) of runs, by their indices, from a roll-out's sums.

        It is inf where the sums cannot tell, as no stage of a step has seen what an input does, and
        NaN where nothing is known. Where commands are abrupt it counts as unresolved, as halving
        tells what they cost.
        """
        found = step_error(sums, looking=self.looks)
        turned = turned_through(sums).reshape(len(chosen), -1).max(axis=1)
        self.turned[chosen] = np.fmax(self.turned[chosen], turned)
        chained, closed = max(self.coupled.vehicle.shape) > 1, self.scenario.controller is not None
        if chained or closed:
            may = may_multiply(sums, self._in_loop(sums, chosen), chained)
            self.sensitive[chosen] |= may.reshape(len(chosen), -1).any(axis=1)
        found[self.abrupt[chosen] > 0.0] += _UNRESOLVED
        found[self.missed[chosen]] += np.inf
        return found

    def _in_loop(self, sums: Array, chosen: Array) -> Array | float:
        """By which a loop multiplies errors of runs (n,) or (n, models), by their indices, at the
        most; 1 where there is none."""
        if self.looks:
            return most_in_sight(sums)
        most = self._most_in_loop
        return 1.0 if most is None else most[chosen].reshape(-1, *(1,) * (sums.ndim - 2))

    @cached_property
    def _most_in_loop(self) -> Array | None:
        """By which a loop without a camera does, of each of its runs (runs,)."""
        law = self.scenario.controller
        if law is None:
            return None
        reach, h = per_run(self.vehicle.reach, self.runs), self.steps
        slowest = np.inf if law.bandwidths is None else law.bandwidths(law.gains)
        # What nothing brings back lasts until the end.
        held = np.maximum(slowest, 1.0 / self.duration)
        position, attitude = np.broadcast_to(held, (self.runs, 2)).T
        phase = INTEGRATORS[self.method].phase
        return most_in_loop(self.scenario.gravity / reach / position**2, phase / h / attitude)

    def improvable(self, errors: Array) -> Array:
        """Runs that half an automatic step may resolve, by step_error (runs,) or (runs, models)."""
        return (
            unresolved(np.where(np.isinf(errors), 0.0, errors))
            if self.automatic
            else np.zeros(0, int)
        )

    def unmeasured(self, errors: Array) -> Array:
        """Runs of given steps whose inputs are abrupt, which only halving the step measures: all
        that it changes is theirs, and errors (runs, …) lose what stood for it."""
        runs = np.flatnonzero((self.abrupt > 0.0) & ~self.missed & (not self.automatic))
        self.abrupt[runs] = 1.0
        errors[runs] -= _UNRESOLVED
        return runs

    def halved(self, runs: Array) -> Flight:
        """The same flight, but some runs, by their indices, take half the step."""
        steps = np.array(self.steps)
        steps[runs] *= 0.5
        return replace(self, steps=steps)

    def engine(self, model: str, dtype: str = "float64") -> Engine:
        """The engine of a model for this flight's vehicle."""
        one, key = self.coupled, (model, dtype)
        # The derivatives that DOP853 drives are those of any engine.
        taken = one.method if self.adaptive else self.method
        if (*key, taken) == (one.model, one.dtype.name, one.method):
            return one
        if key not in self._engines:
            at = one.device, one.threads
            made = Engine(self.vehicle, model, dtype, *at, beside=one, method=taken)
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
            drive = self.drive(times, runs)
            if not self.adaptive:
                warn_of_jumps(drive, grid.starts, self.coupled.layout, self.told, stacklevel=3)
                self.look_for_pulses(drive, grid, runs, stacklevel=4)
            self._sampled.clear()
            self._sampled[key] = drive
        return self._sampled[key]

    def look_for_pulses(self, drive: Drive, grid: Grid, runs: Array, stacklevel: int) -> None:
        """Mark runs of which inputs move roughly or unseen in some steps; warn of the latter."""
        scenario, rotors = within_limits(self.vehicle, self.scenario), self.vehicle.uav.rotors
        highest = np.reshape(np.inf if rotors is None else rotors.highest, (-1, 1))
        pulses = Pulses(scenario, highest, self.coupled.layout, drive, grid, runs)
        rough, unseen = pulses.found(self.unseen, stacklevel + 1)
        self.abrupt[runs] = np.maximum(self.abrupt[runs], rough)
        self.missed[runs] |= unseen

    def drive(self, times: Array, runs: Array) -> Drive:
        """What acts on some runs at some times."""
        table, timed = sample_inputs(self.scenario, times, self.coupled.layout, runs)
        return Drive(table, timed, self.groups, self.scenario.gravity)
