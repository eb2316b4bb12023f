"""Simulation with adaptive steps, each run's own."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from continuair.engine.adaptive import Inputs, Launch, Ticks, Tolerance, Track
from continuair.engine.compiling import load_together
from continuair.engine.engine import Drive, Engine, Logs, Start
from continuair.engine.loop import Loop
from continuair.flight.camera_timing import loop_over, motion_of
from continuair.flight.chunks import runs_at_once
from continuair.flight.cohorts import Flight
from continuair.flight.signals import grid_of_ticks, inputs_of, ticks_of
from continuair.flight.trajectory import Recorder
from continuair.kernels.adaptive import SATURATION
from continuair.signals import fit
from continuair.typing import Array
from continuair.vehicle.layout import MOTION, width_of

_KEPT = 2e8
"""Largest size of the inputs that a flight keeps [bytes]."""


@dataclass(frozen=True, eq=False)
class Part:
    """Some runs of a flight, with their inputs and controller loop."""

    launch: Launch
    loop: Loop | None

    def fly(self, engine: Engine, names: Collection[str], among: int) -> tuple[Logs, Array]:
        """Return the logs of these runs, and the counts of the roll-out (runs, COUNTS).

        names: of the observed columns that are needed; among: the runs of the whole flight.
        """
        launch, given = self.launch, self.launch.runs
        lanes = engine.load_rollout(self.loop, len(given))
        if self.loop is None:
            kernel = engine.kernels_of(lanes).rollout
        else:
            closed = self.loop.on(engine, len(given))
            kernel = closed.kernels.rollout
            launch = replace(launch, loop=closed.struct(engine, given))
        columns, samples = engine.layout.log, launch.ticks.samples
        order = launch.order(engine, kernel, lanes, columns)
        if self.loop is None:
            launch = launch.of_runs(order)
        log = np.full((len(given), len(samples), columns), np.nan, engine.dtype)
        out = engine.upload(log)
        status, counts = launch.on(engine, kernel, lanes, out)
        engine.download(out, log)
        back = np.argsort(order)
        log, status, counts = log[back], status[back], counts[back]
        nothing = np.zeros(len(given), np.int32)
        logs = Logs(log, status, nothing, counts[:, SATURATION])
        if names:
            acting = self.launch.inputs
            drive = Drive(acting(samples), True, acting.groups, acting.gravity)
            logs = replace(logs, observed=engine.observe(log, drive, names, given, among))
        if self.loop is not None:
            watched = self.loop.watch(engine, log, given)
            logs = replace(logs, watched=watched, scene=self.loop.scene)
        return logs, counts


def whole(flight: Flight) -> Part:
    """Return all runs of a flight as one part."""
    assert flight.tolerance is not None
    ticks, runs = _ticks(flight), np.arange(flight.runs)
    loop = _loop(flight, ticks)
    motion = _motion(flight, loop, runs)
    return Part(launch_of(flight, runs, ticks, flight.tolerance, motion), loop)


def launch_of(
    flight: Flight,
    runs: NDArray[np.intp],
    ticks: Ticks,
    tolerance: Tolerance,
    motion: Track | None = None,
) -> Launch:
    """Return the roll-out of some runs of a flight, by their indices."""
    begin = Start(flight.start.states[runs], flight.start.angle[runs])
    return Launch(runs, begin, _inputs(flight, runs), ticks, tolerance, motion=motion)


def _inputs(flight: Flight, runs: NDArray[np.intp]) -> Inputs:
    """Return the inputs of some runs; small ones are kept for other models and finer flights."""
    kept, key = flight.kept_inputs, runs.tobytes()
    # Several models fly at the same time: one of them makes the inputs of all.
    with flight.making_inputs.setdefault(key, Lock()):
        if key in kept:
            return kept[key]
        of = flight.scenario, flight.duration, flight.coupled.layout, flight.groups
        found = inputs_of(*of, runs, flight.runs)
        if sum(each.nbytes for each in [*kept.values()]) + found.nbytes < _KEPT:
            kept[key] = found
        return found


def record(recorder: Recorder, runs: NDArray[np.intp], among: int) -> None:
    """Simulate some runs of a recorder, by their indices, within the tolerance of its flight.

    among: the runs of the whole flight.
    """
    flight = recorder.flight
    tolerance = flight.tolerance
    assert tolerance is not None
    engine = flight.engine(recorder.model, recorder.dtype)
    names = recorder.observed
    alone = engine.on_one_thread()
    ticks = _ticks(flight)
    loop = _loop(flight, ticks)
    size = runs_at_once(flight, engine)
    alone.load_rollout(loop, size)

    def work(some: NDArray[np.intp]) -> None:
        """Simulate and record some of these runs."""
        launch = launch_of(flight, some, ticks, tolerance, _motion(flight, loop, some))
        recorder.keep_counted(some, *Part(launch, loop).fly(alone, names, among))

    engine.side_by_side(work, [runs[at : at + size] for at in range(0, len(runs), size)])


def compile_models(flight: Flight, models: Iterable[str]) -> None:
    """Compile the kernels of several models at the same time, before they are flown in turn."""
    if not flight.counted:
        return
    loop = _loop(flight, _ticks(flight))
    kernels = []
    for model in models:
        engine = flight.engine(model).on_one_thread()
        size = runs_at_once(flight, engine)
        own = engine.kernels_of(engine.lanes(size))
        kernels.append(own.rollout if loop is None else loop.rollout(engine, size))
    load_together(kernels, flight.coupled.device)


def _ticks(flight: Flight) -> Ticks:
    """Return the controller updates and samples of a flight."""
    return ticks_of(flight.scenario, flight.duration, flight.marks.samples)


def _loop(flight: Flight, ticks: Ticks) -> Loop | None:
    """Return the controller loop of a flight, or None."""
    if flight.scenario.controller is None:
        return None
    return loop_over(flight.vehicle, flight.scenario, grid_of_ticks(ticks), flight.runs)


def _motion(flight: Flight, loop: Loop | None, runs: NDArray[np.intp]) -> Track | None:
    """Return the motion of the targets if a controller uses it at every stage."""
    if loop is None or loop.scene is None or not loop.timing.every_stage:
        return None

    def evaluate(times: Array) -> Array:
        """Return position and velocity of each run's target."""
        return motion_of(flight.scenario, times, runs)

    return Track(fit(evaluate, flight.duration), np.arange(width_of(MOTION)))
