"""Flying vehicles through a recorded flight, and how far they are from what was measured."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.engine.engine import Drive, Engine, Start
from continuair.errors import InputError
from continuair.flight.inputs import groups_in_use, sample_inputs
from continuair.flight.steps import automatic_step
from continuair.flight.time_grid import Grid, Marks, grid_of, stage_times
from continuair.identification.recording import INPUTS, Recording
from continuair.scenario.paper_tests import open_loop_test
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.layout import GENERAL, ONE_SECTION
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

START = 16
"""Unknowns of a start: position 3 [m], rotation 3 [rad], bend 2 [1/m], and their rates: velocity
in world axes, angular velocity in body axes."""

_GRAVITY = 9.81
# The step is kept for all vehicles of a fit: a margin over what the first one needs.
_FINER = 0.5
_LONGEST_STEP = 1e-3
_ROWS_OF_START = 5


class Replay:
    """A recorded flight, to be flown by vehicles like the one given, with one time grid for all."""

    def __init__(self, vehicle: Vehicle, recording: Recording, test: str | None) -> None:
        if test is None and recording.inputs is None:
            raise InputError(
                f"{recording.name}: has no column of inputs; add some of {', '.join(INPUTS)}, or "
                "say with --test which open-loop test was flown."
            )
        self.recording, self.test = recording, test
        start = first_start(recording)
        q = np.zeros(8)
        q[6] = float(np.hypot(*start[6:8]))
        step = _FINER * float(automatic_step(Engine(vehicle, "coupled"), q).min())
        times = recording.time
        self.grid = grid_of(Marks(times, times, times[:0]), min(step, _LONGEST_STEP))
        scenario = open_loop_test(test) if test else None
        self._start = np.zeros((1, ONE_SECTION.state))
        if scenario is not None:
            self._start = state_from_paper(np.atleast_2d(scenario.q), np.atleast_2d(scenario.qd))
            table, timed = sample_inputs(scenario, stage_times(self.grid), ONE_SECTION)
            self._drive = Drive(table, timed, groups_in_use(scenario), _GRAVITY)
        else:
            self._drive = Drive(_held(recording, self.grid), True, GENERAL, _GRAVITY)

    def residuals(self, vehicle: Vehicle, start: Array | None, runs: int) -> Array:
        """Simulated minus measured (runs, samples, 8): position, rotation, bend. NaN: it failed.

        start: (runs, START) as differences from the recording's axes; None: that of the test.
        """
        states = np.repeat(self._start, runs, 0) if start is None else _states(start)
        engine = Engine(vehicle, "coupled")
        begin = Start(states, np.zeros(runs))
        logs = engine.roll_out(np.arange(runs), begin, self.grid, self._drive)
        log = logs.log
        log[logs.status != 0] = np.nan
        layout, measured = ONE_SECTION, self.recording
        difference = np.full((*log.shape[:2], 8), np.nan)
        difference[..., :3] = log[..., layout.position] - measured.position
        difference[..., 3:6] = _turn(measured.attitude, log[..., layout.attitude])
        difference[..., 6:] = log[..., layout.bend] - measured.bend
        return difference


def first_start(recording: Recording) -> Array:
    """Start (START,) by straight lines through the first rows of a recording."""
    n = _ROWS_OF_START
    t = recording.time[:n]
    first = Rotation.from_quat(recording.attitude[0])
    turned = (first.inv() * Rotation.from_quat(recording.attitude[:n])).as_rotvec()
    rows = np.hstack([recording.position[:n], turned, recording.bend[:n]])
    slope, value = np.polyfit(t, rows, 1)
    attitude = (first * Rotation.from_rotvec(value[3:6])).as_rotvec()
    return np.concatenate([value[:3], attitude, value[6:], slope])


def _states(start: Array) -> Array:
    """States (runs, state) from rows of START."""
    attitude = Rotation.from_rotvec(start[:, 3:6]).as_quat()
    return np.hstack([start[:, :3], attitude, start[:, 6:]])


def _held(recording: Recording, grid: Grid) -> Array:
    """The input table: every stage of a step takes the row at or before the step's start."""
    assert recording.inputs is not None
    middle = grid.starts + 0.5 * grid.steps
    row = np.searchsorted(recording.time, middle, side="right") - 1
    table = np.zeros((3 * len(row), 1, ONE_SECTION.inputs))
    table[:, 0, ONE_SECTION.push] = np.repeat(recording.inputs[row], 3, axis=0)
    return table


def _turn(measured: Array, simulated: Array) -> Array:
    """Rotation vectors (runs, samples, 3) from measured to simulated attitudes; NaN where it is."""
    flown = np.isfinite(simulated).all(-1)
    found = np.full((*simulated.shape[:2], 3), np.nan)
    wanted = np.broadcast_to(measured, simulated.shape)[flown]
    turn = Rotation.from_quat(wanted).inv() * Rotation.from_quat(simulated[flown])
    found[flown] = turn.as_rotvec()
    return found
