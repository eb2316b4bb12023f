"""Simulation of a recorded flight, and its differences from the measurements."""

from __future__ import annotations

import dataclasses
from bisect import bisect
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import extensions
from continuair.engine.engine import Engine, Start
from continuair.errors import InputError, shown
from continuair.flight.cohorts import Cohort, Flight
from continuair.flight.prepare import prepare
from continuair.flight.rotors import lag_rate, still
from continuair.flight.time_grid import marks_at
from continuair.identification.measurements import Measured
from continuair.identification.recording import Recording
from continuair.identification.sensors import accelerometer
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.bending import bent_shares
from continuair.vehicle.coordinates import (
    branches_of,
    continuous_euler,
    paper_rates,
    polar_of_bends,
)
from continuair.vehicle.layout import ACTUATORS, ONE_SECTION, PUSH, Layout
from continuair.vehicle.vehicle import Vehicle

START = 16
"""Unknowns of the initial state of one section.

Position 3 [m], rotation 3 [rad], bend 2 [1/m], and their rates: velocity in world axes, angular
velocity in body axes. Every further coordinate of a section has 2 more, and every rotor with a lag
its speed over the largest.
"""

# Margin of the step, which is kept for all vehicles of a fit, relative to the first one's.
_FINER = 0.5

# Factor by which the step may exceed the fitted vehicle's, before the fit is refined.
_LEEWAY = 1.25
# Largest factor by which the first step is divided; the fit becomes slower by as much.
_MOST_FINER = 100.0
_LONGEST_STEP = 1e-3
_ROWS_OF_START = 5
# Smallest initial rotor speed in a fit, as thrust has no slope at 0.
_SLOWEST = 0.1


class Replay:
    """A recorded flight that similar vehicles can fly, with one time grid for all."""

    def __init__(self, vehicle: Vehicle, recording: Recording, test: str | None) -> None:
        self.layout = vehicle.layout
        _check_sections(vehicle, recording, test)
        _check_bends(vehicle, recording)
        acting = recording.inputs, recording.rotor_command, recording.tendon_command
        if test is None and all(each is None for each in acting):
            raise InputError(
                "recording",
                "has no column of inputs",
                f"add some of {', '.join(ACTUATORS)}, name their topics of a log, or give --test",
            ).located(recording.name)
        self.recording, self.test = recording, test
        self.measured = Measured(recording)
        if test:
            flown = extensions.scenario("open_loop_test")(test)
        else:
            flown = _held(recording, self.layout)
        if flown.rotor_command is None:
            flown = flown.replace(**still(vehicle))
        self._scenario = flown
        self._flown = self._cohort(vehicle)
        self._lags = bool(lag_rate(vehicle).any())
        self._finest = self.step / _MOST_FINER

    @cached_property
    def first(self) -> Array:
        """Initial state (unknowns,) for the fit, empty if the test gives it.

        Straight lines through the first rows; rotors with a lag have the speeds of their first
        command.
        """
        if self.test:
            return np.zeros(0)
        motion, commands = first_motion(self.recording), self.recording.rotor_command
        if commands is None or not self._lags:
            return motion
        settled = self._settled[0, : commands.shape[1]]
        return np.concatenate([motion, np.maximum(settled, _SLOWEST)])

    @property
    def _settled(self) -> Array:
        """Speeds (1, rotors), over the largest, of the first row's commands; states of tendons."""
        return self._flown.start.states[:, self.layout.state :]

    @property
    def step(self) -> float:
        """Longest step of the flights [s]."""
        return float(self._flown.grid.steps.max())

    def resolves(self, vehicle: Vehicle) -> bool:
        """Return whether the step is short enough for a vehicle.

        The errors of a longer one would act as damping and stiffness.
        """
        return self.step <= self._allowed(vehicle)

    def refine(self, vehicle: Vehicle) -> bool:
        """Use a vehicle's step if it is shorter; return whether it was changed."""
        if self.resolves(vehicle) or self._allowed(vehicle) < self._finest:
            return False
        self._flown = self._cohort(vehicle)
        return True

    def _allowed(self, vehicle: Vehicle) -> float:
        """Return the longest step [s] for a vehicle; 0 if none fits into memory."""
        try:
            return _LEEWAY * float(self._flight(vehicle).steps[0])
        except InputError:  # no step that fits into memory is fine enough
            return 0.0

    def cut_off(self, vehicle: Vehicle) -> tuple[str, ...]:
        """Return a sentence if recorded commands exceed the limits of a vehicle's rotors."""
        commands, rotors = self.recording.rotor_command, vehicle.uav.rotors
        if self.test or commands is None or rotors is None:
            return ()
        beyond = (commands < 0.0) | (commands > rotors.highest)
        share = float(beyond.any(axis=1).mean())
        if not share:
            return ()
        worst = int(np.argmax(beyond.mean(axis=0)))
        limits = f"0 to {rotors.highest[worst]:g} N of {rotors.limits_field(worst)}"
        return (
            f"rotor_command is beyond the {limits} in "
            f"{100.0 * share:.2g} % of the rows, and is clipped; give the true limits.",
        )

    def _flight(self, vehicle: Vehicle) -> Flight:
        """Return the recorded flight of a vehicle, with its step."""
        scenario, times = self._scenario, self.recording.time
        apart = min(_LONGEST_STEP / _FINER, times[-1])
        flight = prepare(vehicle, scenario, sample=apart, duration=times[-1], strain=True)
        marks = marks_at(times, scenario.jumps)
        return dataclasses.replace(flight, steps=_FINER * flight.steps, marks=marks)

    def _cohort(self, vehicle: Vehicle) -> Cohort:
        """Return the runs of the recorded flight of a vehicle."""
        return next(self._flight(vehicle).cohorts())

    def residuals(self, vehicle: Vehicle, start: Array | None, runs: int) -> Array:
        """Return simulated minus measured values (runs, samples, width), less biases of sensors.

        Columns are those of `measured`. NaN: the run failed. start: (runs, unknowns of an initial
        state); None: that of the test.
        """
        return self.measured.without_biases(self.differences(vehicle, start, runs))

    def differences(self, vehicle: Vehicle, start: Array | None, runs: int) -> Array:
        """Return simulated minus measured values (runs, samples, width), with biases."""
        engine, log = self._log(vehicle, start, runs)
        found = np.full((*log.shape[:2], self.measured.width), np.nan)
        for name, where in self.measured.of.items():
            found[..., where] = self._difference(name, engine, log)
        return found

    def _difference(self, name: str, engine: Engine, log: Array) -> Array:
        """Return simulated minus measured values (runs, samples, columns) of one quantity."""
        measured = getattr(self.recording, name)
        if name == "attitude":
            return _turn(measured, log[..., self.layout.attitude])
        if name == "accelerometer":
            place = self.recording.imu_position
            return accelerometer(engine, log, self._flown.at_samples, place) - measured
        column = "angular_velocity" if name == "gyro" else name
        found: Array = log[..., getattr(self.layout, column)] - measured
        return found

    def _log(self, vehicle: Vehicle, start: Array | None, runs: int) -> tuple[Engine, Array]:
        """Return the engine of a vehicle, and the log of its flights; NaN: the run failed."""
        flown, engine = self._flown, Engine(vehicle, "coupled")
        if start is None:
            begin = Start(*(np.repeat(x, runs, 0) for x in (flown.start.states, flown.start.angle)))
        else:
            begin = _start(start, self.layout, self._settled)
        logs = engine.roll_out(np.arange(runs), begin, flown.grid, flown.drive)
        log = logs.log
        log[logs.status != 0] = np.nan
        return engine, log


def _check_sections(vehicle: Vehicle, recording: Recording, test: str | None) -> None:
    """Raise InputError unless recording and test fit the vehicle's sections and actuators."""
    commands = recording.tendon_command
    if commands is not None and commands.shape[1] != vehicle.tendons:
        raise InputError(
            "tendon_command",
            f"of the recording has {commands.shape[1]} columns, but the vehicle has "
            f"{vehicle.tendons} tendons",
            "load it with load_recording(path, vehicle)",
        ).located(recording.name)
    if test is not None and vehicle.uav.rotors is not None:
        raise InputError(
            "test",
            (
                f"is {shown(test)}, which does not include rotor thrusts, but the vehicle "
                "has [uav.rotors]"
            ),
            "omit it, and record the inputs",
        )
    if recording.bend.shape[1] != vehicle.layout.bends:
        raise InputError(
            "recording",
            f"has {recording.bend.shape[1]} coordinates of sections, but the vehicle has "
            f"{vehicle.layout.bends}",
            "load it with load_recording(path, vehicle)",
        ).located(recording.name)
    if test is not None and vehicle.layout.widths != ONE_SECTION.widths:
        raise InputError(
            "test",
            f"is {shown(test)}, which is for one arm of one section",
            "omit it, and record the inputs",
        )


def _check_bends(vehicle: Vehicle, recording: Recording) -> None:
    """Raise InputError for bends beyond a full circle."""
    shares = bent_shares(vehicle, recording.bend)
    if (shares > 1.0).any():
        row, part = np.argwhere(shares > 1.0)[0]
        raise InputError(
            "bend",
            f"in row {row + 1} bends a section to {shares[row, part]:.4g} of a full circle",
            "give bends in 1/m",
        ).located(recording.name)


def first_motion(recording: Recording) -> Array:
    """Return the initial state (unknowns,), without rotors, from straight lines through the first
    rows.

    Level at the origin where the pose was not measured; its rates are then those measured, or 0.
    """
    place, velocity = _line(recording, recording.position, recording.velocity)
    first = Rotation.from_quat(recording.attitude[0]) if recording.attitude.size else None
    turns = np.empty((0, 0))
    if first is not None:
        turns = (first.inv() * Rotation.from_quat(recording.attitude)).as_rotvec()
    turn, spin = _line(recording, turns, recording.gyro)
    attitude = Rotation.from_rotvec(turn)
    attitude = attitude if first is None else first * attitude
    rows = slice(_ROWS_OF_START)
    rate, bend = np.polyfit(recording.time[rows], recording.bend[rows], 1)
    return np.concatenate([place, attitude.as_rotvec(), bend, velocity, spin, rate])


def _line(recording: Recording, values: Array, rates: Array) -> tuple[Array, Array]:
    """Return the value (3,) and the rate (3,) at the first row, of values (n, 3 or 0) and rates."""
    n = _ROWS_OF_START
    time = recording.time[:n]
    if values.size:
        rate, value = np.polyfit(time, values[:n], 1)
        return value, rate
    if rates.size:
        return np.zeros(3), np.polyfit(time, rates[:n], 1)[1]
    return np.zeros(3), np.zeros(3)


def _start(rows: Array, layout: Layout, speeds: Array) -> Start:
    """Return the initial states of runs, from rows of unknowns.

    speeds (1, states): of rotors, and states of tendons; the first ones may have unknowns.
    """
    attitude = Rotation.from_rotvec(rows[:, 3:6]).as_quat()
    held = rows.shape[1] - 2 * layout.coordinates
    rotors = np.repeat(speeds[:, held:], len(rows), 0)
    states = np.hstack([rows[:, :3], attitude, rows[:, 6:], rotors])
    euler = continuous_euler(attitude[:, None])[:, 0]
    polar = polar_of_bends(rows[:, layout.polar], layout)
    return Start(states, branches_of(np.hstack([rows[:, :3], euler, polar]), layout))


def _held(recording: Recording, layout: Layout) -> Scenario:
    """Return the recorded flight as a scenario, with inputs held from row to row.

    It starts level, with the motion and bends of the first rows; the attitude does not affect
    steps.
    """
    times, rows = recording.time.tolist(), recording.inputs
    state = _start(first_motion(recording)[None], layout, np.zeros((1, 0))).states
    polar = polar_of_bends(state[:, layout.bend], layout)
    q = np.hstack([state[:, layout.position], np.zeros((1, 3)), polar])

    def held(values: Array) -> Callable[[float], Array]:
        # The last row is at the end of the flight, and is not held.
        return lambda t: values[min(bisect(times, t), len(times) - 1) - 1]

    acting: dict[str, Any] = {}
    if rows is not None:
        there = [name for name in PUSH if layout.bends or name != "bend_moment"]
        acting = {name: held(rows[:, layout.of_input[name]]) for name in there}
    if recording.rotor_command is not None:
        acting["rotor_command"] = held(recording.rotor_command)
    if recording.tendon_command is not None:
        acting["tendon_command"] = held(recording.tendon_command)
    acting |= {"duration": times[-1], "jumps": tuple(times[1:-1])}
    return Scenario("recording", q[0], paper_rates(q, state, layout=layout)[0], **acting)


def _turn(measured: Array, simulated: Array) -> Array:
    """Return rotation vectors (runs, samples, 3) from measured to simulated attitudes; NaN if
    failed."""
    flown = np.isfinite(simulated).all(-1)
    found = np.full((*simulated.shape[:2], 3), np.nan)
    wanted = np.broadcast_to(measured, simulated.shape)[flown]
    turn = Rotation.from_quat(wanted).inv() * Rotation.from_quat(simulated[flown])
    found[flown] = turn.as_rotvec()
    return found
