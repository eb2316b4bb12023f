"""Flights with steps of each run's own, as its error allows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from continuair.engine.adaptive import Inputs, Ticks, Tolerance, Track, roll_out
from continuair.engine.engine import Drive, Engine, Logs, Start
from continuair.engine.loop import Loop
from continuair.flight.camera_timing import loop_over, motion_of
from continuair.flight.cohorts import Flight
from continuair.flight.inputs import field_width
from continuair.flight.signals import grid_of_ticks, inputs_of, ticks_of
from continuair.flight.trajectory import OBSERVED_VARIABLES, Recorder
from continuair.kernels.adaptive import STEPS
from continuair.kernels.embedded import TSIT5
from continuair.signals import fit
from continuair.vehicle.layout import FIELDS, MOTION, width_of
from continuair.vehicle.runs import per_run

Array = np.ndarray

_BYTES = {"cpu": 1e8, "cuda": 2e9}
"""What the logs, and the scans of inputs, of runs flown at once may take."""

_NUMBERS_PER_SAMPLE = 50
_SCANNED = 4000
"""Values of an input that are looked at for each second, of every run with an input of its own."""

_TRIAL = 0.05
"""Length of the trial flight [s] by whose steps runs are put together in packs."""


@dataclass(frozen=True, eq=False)
class _Part:
    """Some runs of a flight, by their indices, with what acts on them."""

    flight: Flight
    runs: Array
    inputs: Inputs
    ticks: Ticks
    loop: Loop | None
    motion: Track | None

    def fly(self, engine: Engine, tolerance: Tolerance, observe: bool) -> tuple[Logs, Array]:
        """Return the logs of these runs, and what the roll-out counted (runs, COUNTS)."""
        lanes = engine.load_rollout(self.loop, observe, len(self.runs))
        order = self._order(engine, lanes, tolerance)
        logs, counts = self._flown(engine, lanes, self.ticks, tolerance, order)
        if observe:
            table = self.inputs(self.ticks.samples)
            acting = Drive(table, True, self.inputs.groups, self.inputs.gravity)
            logs = replace(logs, observed=engine.observe(logs.log, acting, self.runs))
        if self.loop is None:
            return logs, counts
        watched = self.loop.watch(engine, logs.log, self.runs)
        return replace(logs, watched=watched, scene=self.loop.scene), counts

    def _order(self, engine: Engine, lanes: int, tolerance: Tolerance) -> Array:
        """An order in which runs of a pack take about as many steps."""
        everyone = np.arange(len(self.runs))
        end = self.ticks.times[-1]
        if lanes == 1 or len(self.runs) <= lanes or self.loop is not None or end <= 2.0 * _TRIAL:
            return everyone
        times = np.array([0.0, _TRIAL])
        trial = self._flown(engine, lanes, Ticks(times, times), tolerance, everyone)[1]
        return np.argsort(trial[:, STEPS], kind="stable")

    def _flown(
        self, engine: Engine, lanes: int, ticks: Ticks, tolerance: Tolerance, order: Array
    ) -> tuple[Logs, Array]:
        runs, start = self.runs[order], self.flight.start
        closed = None if self.loop is None else self.loop.on(engine, len(runs))
        rollout = engine.kernels_of(lanes).rollout if closed is None else closed.kernels.rollout
        found = roll_out(
            engine, rollout, lanes, runs, Start(start.states[runs], start.angle[runs]),
            self.inputs.of_runs(order), ticks, TSIT5, tolerance,
            None if closed is None else closed.struct(engine, runs),
            None if self.motion is None else self.motion.of_runs(order),
        )  # fmt: skip
        back = np.argsort(order)
        log, status, counts = (each[back] for each in (found.log, found.status, found.counts))
        nothing = np.zeros(len(runs), np.int32)
        return Logs(log, status, nothing, np.zeros((len(runs), 0))), counts


def record(recorder: Recorder, tolerance: Tolerance) -> None:
    """Fly what a recorder keeps."""
    flight = recorder.flight
    engine = flight.engine(recorder.model, recorder.dtype)
    observe = any(name in OBSERVED_VARIABLES for name in recorder.names)
    alone = engine.on_one_thread()
    ticks = ticks_of(flight.scenario, flight.duration, flight.marks.samples)
    loop = _loop(flight, ticks)
    size = _runs_at_once(flight, engine)
    alone.load_rollout(loop, observe, size)

    def work(runs: Array) -> None:
        inputs = inputs_of(
            flight.scenario, flight.duration, flight.coupled.layout, flight.groups, runs
        )
        motion = _motion(flight, loop, runs)
        part = _Part(flight, runs, inputs, ticks, loop, motion)
        recorder.keep_counted(runs, *part.fly(alone, tolerance, observe))

    runs = recorder.runs
    engine.side_by_side(work, [runs[at : at + size] for at in range(0, len(runs), size)])


def checked_record(recorder: Recorder, tolerance: Tolerance) -> None:
    """Fly what a recorder keeps twice, and tell how far the tips of both flights are apart."""
    record(recorder, tolerance)
    flight = recorder.flight
    period = flight.scenario.period
    finer = Tolerance(
        0.1 * tolerance.relative,
        None if tolerance.absolute is None else 0.1 * tolerance.absolute,
        tolerance.longest if period is None else min(tolerance.longest, 0.5 * period),
    )
    second = Recorder(flight, recorder.model, ("tip_position",), recorder.dtype, recorder.runs)
    record(second, finer)
    arms = flight.coupled.layout.arms
    tips = [
        each.values("tip_position").reshape(len(recorder.runs), -1, arms, 3)
        for each in (recorder, second)
    ]
    apart = np.linalg.norm(tips[1] - tips[0], axis=-1)
    reach = per_run(flight.vehicle.reach, flight.runs)[recorder.runs]
    largest = np.nanmax(apart, axis=(1, 2), initial=0.0) / reach
    alike = recorder.status == second.status
    recorder.error_estimate = np.where(alike, largest, np.inf)


def _loop(flight: Flight, ticks: Ticks) -> Loop | None:
    if flight.scenario.controller is None:
        return None
    return loop_over(flight.vehicle, flight.scenario, grid_of_ticks(ticks), flight.runs)


def _motion(flight: Flight, loop: Loop | None, runs: Array) -> Track | None:
    """The motion of the targets, where a law looks at it at every stage."""
    if loop is None or loop.scene is None or not loop.timing.every_stage:
        return None

    def evaluate(times: Array) -> Array:
        rows = motion_of(flight.scenario, times)
        return rows if rows.shape[1] == 1 else rows[:, runs]

    return Track(fit(evaluate, flight.duration), np.arange(width_of(MOTION)))


def _runs_at_once(flight: Flight, engine: Engine) -> int:
    """How many runs fit into memory, in whole packs, and some for every thread."""
    kind = engine.device.split(":")[0]
    numbers = _NUMBERS_PER_SAMPLE * len(flight.marks.samples)
    scenario, layout = flight.scenario, flight.coupled.layout
    timed = [name for name in FIELDS if callable(getattr(scenario, name))]
    width = sum(field_width(name, layout) for name in timed)
    numbers += int(_SCANNED * max(1.0, flight.duration)) * width
    size = max(1, int(_BYTES[kind] / (8 * numbers)))
    if kind == "cpu":
        size = min(size, -(-flight.runs // engine.threads))
    lanes = engine.lanes(size)
    return lanes * -(-size // lanes)
