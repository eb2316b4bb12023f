"""Simulation with a scenario's force_callback: piece by piece between its calls."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.engine.engine import Drive, Engine, Logs, Start
from continuair.engine.rows import forget_unreached
from continuair.errors import InputError, shown
from continuair.flight.cohorts import Cohort
from continuair.flight.time_grid import Grid, call_times
from continuair.flight.trajectory import Recorder
from continuair.kernels.step import OK
from continuair.scenario.wrench import FlightState, Wrench
from continuair.typing import Array
from continuair.vehicle.coordinates import branches_in
from continuair.vehicle.layout import OF_TIPS, Layout
from continuair.warning import warn


def record_called(recorder: Recorder, stacklevel: int) -> None:
    """Simulate the runs of a recorder, all at once; warn `stacklevel` frames up that it is slow.

    All runs use the shortest of their steps, as one call is for all of them.
    """
    flight = recorder.flight
    shortest = np.full(flight.runs, flight.steps.min())
    recorder.flight = flight = dataclasses.replace(flight, steps=shortest)
    calls = call_times(flight.duration, flight.scenario.callback_rate)
    warn(
        f"force_callback is Python, called {len(calls)} times, and slow; write it as a "
        "continuair.Term for full speed.",
        stacklevel + 1,
    )
    ((runs, grid),) = flight.grids()
    cohort = flight.cohort(runs, grid)
    engine = flight.engine(recorder.model, recorder.dtype)
    recorder.keep(cohort, _Pieces(cohort, engine, calls).fly(recorder.observed))


class _Pieces:
    """The simulation of a group of runs from call to call."""

    def __init__(self, cohort: Cohort, engine: Engine, calls: Array) -> None:
        self.cohort, self.engine, self.calls = cohort, engine, calls
        self.flight, self.layout, self.grid = cohort.flight, engine.layout, cohort.grid
        # The step that begins at each call; breakpoints agree with calls up to rounding.
        ends = np.searchsorted(self.grid.starts, calls - 0.5 * self.grid.steps.min())
        self.edges = np.append(ends, len(self.grid.steps))

    def fly(self, names: Collection[str]) -> Logs:
        """Simulate all pieces, and compute the named observed variables at the samples."""
        cohort, grid, layout, n = self.cohort, self.grid, self.layout, len(self.cohort.runs)
        log = np.full((n, len(grid.samples), layout.log), np.nan, self.engine.dtype)
        status, last = np.full(n, OK, np.int32), np.zeros(n, np.int32)
        saturation = np.zeros(n, self.engine.dtype)
        first = cohort.start
        start = Start(first.states, first.angle, frozen=first.states)
        held = np.zeros((len(grid.samples), n, layout.inputs))
        states = np.array(first.states, self.engine.dtype)
        for begin, end in zip(self.edges[:-1], self.edges[1:], strict=True):
            time = float(grid.starts[begin])
            row = self._called(time, states)
            piece, at = _piece(grid, begin, end)
            logs = self.engine.roll_out(cohort.runs, start, piece, self._drive(begin, end, row))
            going = status == OK
            log[np.ix_(going, at[at >= 0])] = logs.log[going][:, at >= 0]
            # A sample at a call shows the inputs after it, as the next piece overwrites it.
            held[at[at >= 0]] = row
            saturation[going] = np.maximum(saturation[going], logs.saturation[going])
            last[going] = begin + logs.last_step[going]
            status[going] = logs.status[going]
            going = status == OK
            ends = logs.log[:, -1]
            states[going] = ends[going, : layout.state]
            angle = np.array(start.angle)
            angle[going] = branches_in(ends[going], layout)
            start = Start(states, angle, frozen=first.states)
        observed = None
        if names:
            acting = cohort.at_samples
            table = acting.table + held
            seen = Drive(table, len(table) > 1, acting.groups, acting.gravity)
            observed = self.engine.observe(log, seen, names, cohort.runs)
        for each in (log, observed) if observed is not None else (log,):
            forget_unreached(each, status, last, grid.sample_after)
        return Logs(log, status, last, saturation, observed)

    def _drive(self, begin: int, end: int, row: Array) -> Drive:
        """Return the inputs in the steps from `begin` to before `end`, with a row (runs, inputs)
        added."""
        drive = self.cohort.drive
        table = drive.table[3 * begin : 3 * end] if drive.timed else drive.table
        return Drive(table + row, drive.timed, drive.groups, drive.gravity)

    def _called(self, time: float, states: Array) -> Array:
        """Return the callback's wrenches as a row of inputs (runs, inputs)."""
        state = self._state(states)
        given = state if self.flight.batched else _of_first(state)
        callback = self.flight.scenario.force_callback
        assert callback is not None
        try:
            found = callback(time, given)
        except Exception as error:  # whatever a user's function raises
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise InputError(
                "force_callback",
                f"cannot be evaluated at t = {time:g} s ({reason})",
                "return a continuair.Wrench for every state",
            ) from error
        wrenches = found if isinstance(found, (list, tuple)) else [found]
        row = np.zeros((len(states), self.layout.inputs))
        for wrench in wrenches:
            if not isinstance(wrench, Wrench):
                raise InputError(
                    "force_callback",
                    f"returns {shown(found)} at t = {time:g} s",
                    "return a continuair.Wrench(force), or a list of them",
                )
            _add(row, wrench, state.attitude, self.layout, time)
        return row

    def _state(self, states: Array) -> FlightState:
        """Return the state of all runs for the callback."""
        layout, vehicle, n = self.layout, self.flight.vehicle, len(states)
        rows = np.zeros((n, 1, layout.log))
        rows[:, 0, : layout.state] = states
        still = Drive(np.zeros((1, 1, layout.inputs)), False, 0, self.flight.scenario.gravity)
        seen = self.engine.observe(rows, still, OF_TIPS, self.cohort.runs, among=np.inf)
        seen = seen[:, 0].astype(float)
        state = rows[:, 0]
        many = vehicle.has_arm_list
        sections = (n, layout.sections, 2) if many else (n, 2)
        sections = (n, layout.bends) if layout.strains else sections
        arms = (n, layout.arms, 3) if many else (n, 3)
        return FlightState(
            state[:, layout.position],
            state[:, layout.attitude],
            state[:, layout.velocity],
            state[:, layout.angular_velocity],
            state[:, layout.bend].reshape(sections),
            state[:, layout.bend_rate].reshape(sections),
            seen[:, layout.observed["tip_position"]].reshape(arms),
            seen[:, layout.observed["tip_velocity"]].reshape(arms),
        )


def _of_first(state: FlightState) -> FlightState:
    """Return the state of the only run."""
    return FlightState(*(getattr(state, each.name)[0] for each in dataclasses.fields(state)))


def _add(row: Array, wrench: Wrench, attitude: Array, layout: Layout, time: float) -> None:
    """Add a wrench to a row of inputs (runs, inputs)."""
    runs = len(row)
    force = _three("force", wrench.force, runs, time)
    moment = _three("moment", np.zeros(3) if wrench.moment is None else wrench.moment, runs, time)
    if wrench.at == "uav":
        row[:, layout.force] += force
        row[:, layout.moment] += Rotation.from_quat(attitude).inv().apply(moment)
        return
    arm = wrench.at[1] if isinstance(wrench.at, tuple) else 0
    if not 0 <= arm < layout.arms:
        raise InputError(
            "force_callback",
            f"returns a wrench at {wrench.at!r}, but the vehicle has {layout.arms} arms",
            f"give an index from 0 to {layout.arms - 1}",
        )
    first = layout.tip_wrench.start + 6 * arm
    row[:, first : first + 3] += force
    row[:, first + 3 : first + 6] += moment


def _three(name: str, value: object, runs: int, time: float) -> Array:
    """Return three numbers per run, or for all runs."""
    found = checks.finite_array(value)
    if found is None or found.shape not in ((3,), (runs, 3)):
        rows = f" or {runs} rows of them" if runs > 1 else ""
        raise InputError(
            "force_callback",
            f"returns the {name} {shown(value)} at t = {time:g} s",
            f"return 3 finite numbers{rows}",
        )
    return found


def _piece(grid: Grid, begin: int, end: int) -> tuple[Grid, NDArray[np.intp]]:
    """Return the grid of the steps from `begin` to before `end`, and its samples' indices.

    Its first and last samples are its start and end. The index is that of the whole grid, or -1.
    """
    after = grid.sample_after[begin:end]
    before = grid.sample_after[begin - 1] if begin else 0
    inner = np.flatnonzero(after[:-1] >= 0)
    at = np.concatenate([[before], after[inner], after[-1:]]).astype(int)
    sample_after = np.full(end - begin, -1, np.int32)
    sample_after[inner] = 1 + np.arange(len(inner))
    sample_after[-1] = 1 + len(inner)
    starts, steps = grid.starts[begin:end], grid.steps[begin:end]
    samples = np.concatenate([starts[:1], (starts + steps)[inner], [starts[-1] + steps[-1]]])
    within = slice(begin, end)
    return Grid(samples, starts, steps, sample_after, grid.opens[within], grid.closes[within]), at
