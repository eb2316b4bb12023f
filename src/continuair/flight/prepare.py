"""What a flight is made of: vehicle, scenario and choices, made into one immutable `Flight`.

Every way to fly starts here: `simulate`, `run_pairs`, `Simulation`, sweeps, couplings and studies.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from continuair import checks
from continuair.engine.engine import Drive, Engine, Logs, Start, check_device
from continuair.engine.loop import Loop
from continuair.errors import InputError, shown
from continuair.flight.camera_timing import check_view, loop_over
from continuair.flight.inputs import groups_in_use, sample_inputs
from continuair.flight.probing import Probe, warn_of_jumps
from continuair.flight.resolution import UNSEEN, step_error, unresolved
from continuair.flight.rotors import (
    check_air_and_rotors,
    lag_rate,
    rotor_speeds,
    with_rotors_running,
    within_limits,
)
from continuair.flight.steps import (
    automatic_step,
    declared_rate,
    steps_of,
    warn_of_fast_inputs,
)
from continuair.flight.time_grid import (
    Grid,
    Marks,
    check_steps,
    marks_of,
    shared_grids,
    stage_times,
)
from continuair.kernels.integrators import INTEGRATORS
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import COMMAND, FIELDS, Layout
from continuair.vehicle.vehicle import Vehicle, check_vehicle

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
        return self.sampled or self.flight.drive(self.grid.samples, self.runs)

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
    of each run (runs,) [s]; missed: whether its steps miss what its inputs do (runs,); marks: times
    that steps end at. coupled: an engine of that model, which others share what they can with.
    automatic: whether the steps may be made finer; integrator: "rk4", "implicit", or "dop853",
    which takes steps of its own; told: inputs whose jumps have been told of; lost: times near which
    samples did not follow the Euler angles of q [s].
    """

    vehicle: Vehicle
    scenario: Scenario
    duration: float
    sample: float
    runs: int
    batched: bool
    start: Start
    steps: Array
    missed: Array
    marks: Marks
    coupled: Engine
    automatic: bool
    integrator: str
    told: set[str] = field(default_factory=set)
    lost: list[float] = field(default_factory=list)
    _sampled: dict[tuple[bytes, bytes], Drive] = field(default_factory=dict)
    _engines: dict[tuple[str, str], Engine] = field(default_factory=dict)

    @property
    def adaptive(self) -> bool:
        """Whether the integrator takes steps of its own."""
        return self.integrator not in INTEGRATORS

    @property
    def groups(self) -> int:
        """Bits of the groups of inputs that act."""
        return groups_in_use(self.scenario) | COMMAND * (self.scenario.controller is not None)

    def step_error(self, sums: Array, chosen: Array) -> Array:
        """step_error (n,) or (n, models) of runs, by their indices, from a roll-out's sums.

        It is inf where the sums cannot tell, as no stage of a step has seen what an input does, and
        NaN where nothing is known.
        """
        law = self.scenario.controller
        found = step_error(sums, looking=law is not None and law.looks)
        found[self.missed[chosen]] += np.inf
        return found

    def improvable(self, errors: Array) -> Array:
        """Runs that half an automatic step may resolve, by step_error (runs,) or (runs, models)."""
        return (
            unresolved(np.where(np.isinf(errors), 0.0, errors))
            if self.automatic
            else np.zeros(0, int)
        )

    def halved(self, runs: Array) -> Flight:
        """The same flight, but some runs, by their indices, take half the step."""
        steps = np.array(self.steps)
        steps[runs] *= 0.5
        return replace(self, steps=steps)

    def engine(self, model: str, dtype: str = "float64") -> Engine:
        """The engine of a model for this flight's vehicle."""
        one, key = self.coupled, (model, dtype)
        # The derivatives that DOP853 drives are those of any engine.
        taken = one.integrator if self.adaptive else self.integrator
        if (*key, taken) == (one.model, one.dtype.name, one.integrator):
            return one
        if key not in self._engines:
            at = one.device, one.threads
            made = Engine(self.vehicle, model, dtype, *at, beside=one, integrator=taken)
            self._engines[key] = made
        return self._engines[key]

    @cached_property
    def provenance(self) -> dict[str, str]:
        """Vehicle and scenario as JSON."""
        described = {"vehicle": self.vehicle.describe(), "scenario": self.scenario.describe()}
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
            self._sampled.clear()
            self._sampled[key] = drive
        return self._sampled[key]

    def drive(self, times: Array, runs: Array) -> Drive:
        """What acts on some runs at some times."""
        table, timed = sample_inputs(self.scenario, times, self.coupled.layout, runs)
        return Drive(table, timed, self.groups, self.scenario.gravity)


def prepare(
    vehicle: Any,
    scenario: Any,
    *,
    step: Any = "auto",
    sample: Any = 1e-3,
    duration: Any = None,
    device: Any = "cpu",
    threads: Any = None,
    integrator: str = "rk4",
    horizon: float = 0.0,
    stacklevel: int = 2,
) -> Flight:
    """Check vehicle, scenario and choices, as `continuair.simulate` describes them, and join them.

    integrator: as a `Flight` has it. horizon: until when inputs are probed, beyond the duration
    [s]. Raises InputError; warns of a step that is too coarse, `stacklevel` frames up.
    """
    check_vehicle(vehicle)
    check_scenario(scenario)
    asked = None if isinstance(step, str) and step == "auto" else checked_step(step)
    duration, sample = _times(scenario, duration, sample)
    check_device(device)
    if threads is not None:
        checks.whole("threads", threads, 1)
    coupled = _engine(vehicle, device, threads)
    check_fits(scenario, coupled.layout)
    check_air_and_rotors(vehicle, scenario, coupled.layout)
    q, qd = np.atleast_2d(scenario.q), np.atleast_2d(scenario.qd)
    runs, batched = _runs(vehicle, scenario, coupled)
    scenario = with_rotors_running(coupled, scenario)
    if asked is not None:
        check_same_runs(runs, {"step": len(asked)})
    driven = np.broadcast_to(np.maximum(declared_rate(scenario), lag_rate(vehicle)), runs)
    adaptive = integrator not in INTEGRATORS
    by_default = "rk4" if adaptive else integrator
    fine = np.broadcast_to(automatic_step(coupled, q, qd, driven, by_default), runs)
    probed = within_limits(vehicle, scenario)
    probe = Probe(probed, coupled.layout, max(duration, horizon))
    if asked is None:
        fine = np.minimum(fine, probe.following_step(sample))
    # What an implicit step does to modes that it does not resolve, its step_error tells.
    distorts = not adaptive and not INTEGRATORS[integrator].stiff
    steps = steps_of(scenario, asked, fine, sample, stacklevel + 1 if distorts else None)
    check_steps(duration, min(float(steps.min()), sample))
    missed = np.zeros(runs, bool)
    if not adaptive:
        probe.warn_of_blur(steps, stacklevel + 1)
        missed = probe.missed(steps) | (driven * steps > UNSEEN)
        if not distorts:
            warn_of_fast_inputs(steps, driven, stacklevel + 1)
    states = state_from_paper(*np.broadcast_arrays(q, qd))
    parts = states, rotor_speeds(vehicle, scenario), branches_of(q)
    *state, branches = (np.broadcast_to(each, (runs, each.shape[1])) for each in parts)
    start = Start(np.hstack(state), branches)
    late = scenario.controller.latency if scenario.controller is not None else 0.0
    marks = marks_of(duration, sample, scenario.breaks, scenario.period, late)
    check_view(coupled, scenario, start)
    return Flight(
        vehicle,
        scenario,
        duration,
        sample,
        runs,
        batched,
        start,
        steps,
        missed,
        marks,
        coupled,
        automatic=asked is None and not adaptive,
        integrator=integrator,
    )


def _engine(vehicle: Vehicle, device: str, threads: int | None) -> Engine:
    """An engine of the coupled model; one that is at hand for a vehicle of one run."""
    of = _engine_of_one if vehicle.runs is None else _new_engine
    return of(vehicle, device, threads)


def _new_engine(vehicle: Vehicle, device: str, threads: int | None) -> Engine:
    return Engine(vehicle, "coupled", device=device, threads=threads)


# Packing takes longer than a short flight.
_engine_of_one = lru_cache(maxsize=16)(_new_engine)


def check_scenario(scenario: Any) -> None:
    """Raise InputError unless it is a scenario."""
    if not isinstance(scenario, Scenario):
        raise InputError(
            f"scenario is {shown(scenario)}; give a continuair.Scenario, such as "
            "continuair.open_loop_test('A')."
        )


def check_fits(scenario: Scenario, layout: Layout) -> None:
    """Raise InputError unless a scenario is for as many sections and arms as a vehicle has."""
    if scenario.sections != layout.sections:
        raise InputError(
            f"scenario.q holds {np.shape(scenario.q)[-1]} numbers, but the vehicle has "
            f"{layout.sections} sections; give {layout.coordinates}: x y z roll pitch yaw, and "
            "kappa psi_a of each section."
        )
    wrench = scenario.tip_wrench
    given = wrench(0.0) if callable(wrench) else wrench
    if given is not None and np.shape(given)[-1] != 6 * layout.arms:
        raise InputError(
            f"scenario.tip_wrench holds {np.shape(given)[-1]} numbers, but the vehicle has "
            f"{layout.arms} arms; give 6 for each."
        )


def checked_step(step: Any) -> Array:
    """Return steps (runs or 1,) [s] that are not "auto"."""
    given = step if np.ndim(step) == 1 and len(step) else [step]
    return np.array([checks.positive("step", each, " or 'auto'") for each in given])


def _times(scenario: Scenario, duration: Any, sample: Any) -> tuple[float, float]:
    """Duration and time between samples [s]."""
    lasts = scenario.duration if duration is None else checks.positive("duration", duration)
    if checks.positive("sample", sample) > lasts * (1.0 + 1e-9):
        raise InputError(
            f"sample is {shown(sample)} s, longer than the flight of {lasts:g} s; give a "
            "shorter one."
        )
    return lasts, float(sample)


def _runs(vehicle: Vehicle, scenario: Scenario, engine: Engine) -> tuple[int, bool]:
    """The number of runs of a batch, all parts of which agree on it, and whether it is one."""
    width = sample_inputs(scenario, np.zeros(1), engine.layout)[0].shape[1]
    controller, seed = scenario.controller, scenario.seed
    believed = controller.believes if controller is not None else None
    listed = isinstance(scenario.target, (list, tuple))
    sizes: Mapping[str, int | None] = {
        "vehicle": vehicle.runs,
        "scenario.q": _rows(scenario.q),
        "scenario.qd": _rows(scenario.qd),
        "scenario.controller": controller.runs if controller is not None else None,
        "the vehicle that scenario.controller believes in": believed.runs if believed else None,
        "scenario.target": len(scenario.targets) if listed else None,
        "scenario.seed": len(seed) if isinstance(seed, tuple) else None,
        "scenario.setpoints": None if scenario.setpoints is None else scenario.setpoints.runs,
        "scenario.rotor_thrust": _rows(scenario.rotor_thrust),
        "the scenario's inputs": width if width > 1 else None,
    }
    runs = max(size or 1 for size in sizes.values())
    check_same_runs(runs, sizes)
    return runs, any(size is not None for size in sizes.values())


def _rows(state: Any) -> int | None:
    return len(state) if np.ndim(state) == 2 else None


def check_same_runs(runs: int, sizes: Mapping[str, int | None]) -> None:
    """Raise InputError unless each part holds that many runs, or one for all."""
    for name, size in sizes.items():
        if size not in (None, 1, runs):
            raise InputError(
                f"{name} holds {size} runs, but the batch has {runs}; give every "
                "array one row per run, or a single row."
            )
