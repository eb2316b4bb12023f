"""Flying vehicles through a recorded flight, and how far they are from what was measured."""

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
from continuair.identification.recording import Recording
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.arc import bend_vectors, polar_of
from continuair.vehicle.coordinates import continuous_euler, paper_rates
from continuair.vehicle.layout import ACTUATORS, ONE_SECTION, PUSH, Layout
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

START = 16
"""Unknowns of a start of one section: position 3 [m], rotation 3 [rad], bend 2 [1/m], and their
rates: velocity in world axes, angular velocity in body axes. Every further section has 4 more, and
every rotor that lags behind a command its speed over the greatest."""

# The step is kept for all vehicles of a fit: a margin over what the first one needs.
_FINER = 0.5

# Share of it by which that of the fitted vehicle may be finer, without a fit from there.
_LEEWAY = 1.25
# What the first step is divided by at most; a fit becomes slower by as much.
_MOST_FINER = 100.0
_LONGEST_STEP = 1e-3
_ROWS_OF_START = 5
# Speed that a fit takes a rotor to have at the least before it starts: a thrust has no slope at 0.
_SLOWEST = 0.1


class Replay:
    """A recorded flight, to be flown by vehicles like the one given, with one time grid for all."""

    def __init__(self, vehicle: Vehicle, recording: Recording, test: str | None) -> None:
        self.layout = vehicle.layout
        _check_sections(vehicle, recording, test)
        _check_bends(vehicle, recording)
        if test is None and recording.inputs is None and recording.rotor_command is None:
            raise InputError(
                f"{recording.name}: has no column of inputs; add some of "
                f"{', '.join(ACTUATORS)}, name topics of a log that hold them, or say with --test "
                "which open-loop test was flown."
            )
        self.recording, self.test = recording, test
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
        """Start (unknowns,) to fit from, empty where the test gives it: lines through the first
        rows, and speeds of commanded rotors that lag as if they had settled."""
        if self.test:
            return np.zeros(0)
        motion, settled = first_motion(self.recording), self._settled[0]
        if self.recording.rotor_command is None or not self._lags:
            return motion
        return np.concatenate([motion, np.maximum(settled, _SLOWEST)])

    @property
    def _settled(self) -> Array:
        """Speeds (1, rotors), over the greatest, that the commands of the first row lead to."""
        return self._flown.start.states[:, self.layout.state :]

    @property
    def step(self) -> float:
        """The longest step of the flights [s]."""
        return float(self._flown.grid.steps.max())

    def resolves(self, vehicle: Vehicle) -> bool:
        """Whether the step is one that a vehicle allows: errors of a longer one would pass for its
        damping and stiffness."""
        return self.step <= self._allowed(vehicle)

    def refine(self, vehicle: Vehicle) -> bool:
        """Take the step of a vehicle where it is finer; whether it was taken."""
        if self.resolves(vehicle) or self._allowed(vehicle) < self._finest:
            return False
        self._flown = self._cohort(vehicle)
        return True

    def _allowed(self, vehicle: Vehicle) -> float:
        try:
            return _LEEWAY * float(self._flight(vehicle).steps[0])
        except InputError:  # no step that fits into memory is fine enough
            return 0.0

    def cut_off(self, vehicle: Vehicle) -> tuple[str, ...]:
        """What is in doubt where recorded commands are beyond what a vehicle's rotors give."""
        commands, rotors = self.recording.rotor_command, vehicle.uav.rotors
        if self.test or commands is None or rotors is None:
            return ()
        highest = float(rotors.highest)
        share = float(((commands < 0.0) | (commands > highest)).any(axis=1).mean())
        if not share:
            return ()
        return (
            f"rotor_command is beyond the 0 to {highest:g} N of uav.rotors.thrust_limits in "
            f"{100.0 * share:.2g} % of the rows, and flown as cut off there; give the limits that "
            "the rotors had.",
        )

    def _flight(self, vehicle: Vehicle) -> Flight:
        """The recorded flight of a vehicle, with its step [s]."""
        scenario, times = self._scenario, self.recording.time
        apart = min(_LONGEST_STEP / _FINER, times[-1])
        flight = prepare(vehicle, scenario, sample=apart, duration=times[-1])
        marks = marks_at(times, scenario.jumps)
        return dataclasses.replace(flight, steps=_FINER * flight.steps, marks=marks)

    def _cohort(self, vehicle: Vehicle) -> Cohort:
        return next(self._flight(vehicle).cohorts())

    def residuals(self, vehicle: Vehicle, start: Array | None, runs: int) -> Array:
        """Simulated minus measured (runs, samples, coordinates): position, rotation, bends.

        NaN: it failed. start: (runs, unknowns of a start) as differences from the recording's
        axes; None: that of the test.
        """
        flown, engine = self._flown, Engine(vehicle, "coupled")
        if start is None:
            begin = Start(*(np.repeat(x, runs, 0) for x in (flown.start.states, flown.start.angle)))
        else:
            begin = _start(start, self.layout, self._settled)
        logs = engine.roll_out(np.arange(runs), begin, flown.grid, flown.drive)
        log = logs.log
        log[logs.status != 0] = np.nan
        layout, measured = self.layout, self.recording
        difference = np.full((*log.shape[:2], layout.coordinates), np.nan)
        difference[..., :3] = log[..., layout.position] - measured.position
        difference[..., 3:6] = _turn(measured.attitude, log[..., layout.attitude])
        difference[..., 6:] = log[..., layout.bend] - measured.bend
        return difference


def _check_sections(vehicle: Vehicle, recording: Recording, test: str | None) -> None:
    """Raise InputError unless a recording and a test are of as many sections as a vehicle, and the
    test tells all that acted."""
    if test is not None and vehicle.uav.rotors is not None:
        raise InputError(
            f"test is {shown(test)}, which does not tell the thrusts that held the vehicle, and "
            "this one has [uav.rotors]; leave it out, and record the inputs."
        )
    if recording.bend.shape[1] != vehicle.layout.bends:
        held = len(bend_vectors(recording.bend[0]))
        raise InputError(
            f"{recording.name}: holds the bends of {held} sections, but "
            f"the vehicle has {vehicle.sections}; load it with load_recording(path, vehicle)."
        )
    if test is not None and vehicle.layout.widths != ONE_SECTION.widths:
        raise InputError(
            f"test is {shown(test)}, which is for one arm of one section; leave it out, and record "
            "the inputs."
        )


def _check_bends(vehicle: Vehicle, recording: Recording) -> None:
    """Raise InputError for bends beyond a full circle, which no flight of the vehicle reaches."""
    lengths = np.array([section.length for arm in vehicle.arms for section in arm.section])
    angles = np.linalg.norm(bend_vectors(recording.bend), axis=-1) * lengths
    if (angles > 2.0 * np.pi).any():
        row, section = np.argwhere(angles > 2.0 * np.pi)[0]
        raise InputError(
            f"{recording.name}: bend of section {section + 1} is {angles[row, section]:.4g} rad in "
            f"row {row + 1}, more than a full circle; give bends in 1/m."
        )


def first_motion(recording: Recording) -> Array:
    """Start (unknowns,) without rotors, by straight lines through the first rows of a recording."""
    n = _ROWS_OF_START
    t = recording.time[:n]
    first = Rotation.from_quat(recording.attitude[0])
    turned = (first.inv() * Rotation.from_quat(recording.attitude[:n])).as_rotvec()
    rows = np.hstack([recording.position[:n], turned, recording.bend[:n]])
    slope, value = np.polyfit(t, rows, 1)
    attitude = (first * Rotation.from_rotvec(value[3:6])).as_rotvec()
    return np.concatenate([value[:3], attitude, value[6:], slope])


def _start(rows: Array, layout: Layout, speeds: Array) -> Start:
    """Where runs begin, from rows of unknowns of a start, and the speeds (1, rotors) of rotors
    where these hold none."""
    attitude = Rotation.from_rotvec(rows[:, 3:6]).as_quat()
    held = rows.shape[1] - 2 * layout.coordinates
    rotors = np.repeat(speeds[:, held:], len(rows), 0)
    states = np.hstack([rows[:, :3], attitude, rows[:, 6:], rotors])
    euler = continuous_euler(attitude[:, None])[:, 0]
    bends = bend_vectors(rows[:, layout.polar])
    return Start(states, np.hstack([np.arctan2(bends[..., 1], bends[..., 0]), euler]))


def _held(recording: Recording, layout: Layout) -> Scenario:
    """What was recorded: a level start that moves and bends as in its first rows, whose attitude
    changes no step, and each row of inputs held to the next."""
    times, rows = recording.time.tolist(), recording.inputs
    start = _start(first_motion(recording)[None], layout, np.zeros((1, 0)))
    state = start.states
    q = np.hstack([state[:, layout.position], np.zeros((1, 3 + layout.bends))])
    kappa, psi = polar_of(q)
    kappa[:], psi[:] = np.hypot(*bend_vectors(state[0, layout.bend]).T), start.angle[0, :-3]

    def held(values: Array) -> Callable[[float], Array]:
        # The last row ends the flight, and is not held.
        return lambda t: values[min(bisect(times, t), len(times) - 1) - 1]

    acting: dict[str, Any] = {}
    if rows is not None:
        there = [name for name in PUSH if layout.bends or name != "bend_moment"]
        acting = {name: held(rows[:, layout.of_input[name]]) for name in there}
    if recording.rotor_command is not None:
        acting["rotor_command"] = held(recording.rotor_command)
    acting |= {"duration": times[-1], "jumps": tuple(times[1:-1])}
    return Scenario("recording", q[0], paper_rates(q, state)[0], **acting)


def _turn(measured: Array, simulated: Array) -> Array:
    """Rotation vectors (runs, samples, 3) from measured to simulated attitudes; NaN where it is."""
    flown = np.isfinite(simulated).all(-1)
    found = np.full((*simulated.shape[:2], 3), np.nan)
    wanted = np.broadcast_to(measured, simulated.shape)[flown]
    turn = Rotation.from_quat(wanted).inv() * Rotation.from_quat(simulated[flown])
    found[flown] = turn.as_rotvec()
    return found
