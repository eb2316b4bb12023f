"""Inputs of a scenario as signals, and the update times of its controller."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.engine.adaptive import Inputs, Ticks, Track
from continuair.errors import InputError
from continuair.flight.inputs import asked, evaluated, times_at_once
from continuair.flight.time_grid import Grid, control_times
from continuair.scenario.scenarios import Scenario
from continuair.signals import Signal, UnresolvedSignal, constant, fit
from continuair.typing import Array
from continuair.vehicle.layout import FIELDS, Layout

_AT_ONCE = 2048
"""Times at which a function of time is evaluated at once."""

_LONGEST = 5000.0
"""Longest flight with a function of time [s], whose samples must fit into memory."""


def inputs_of(
    scenario: Scenario,
    duration: float,
    layout: Layout,
    groups: int,
    runs: NDArray[np.intp] | None = None,
    among: int = 1,
) -> Inputs:
    """Return the inputs of a vehicle over a flight.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    duration : float
        Duration of the flight [s].
    layout : Layout
        Columns of the inputs.
    groups : int
        Bits of the groups of inputs in use.
    runs : ndarray of int, optional
        Runs that are wanted, for inputs with a row per run. Default: all.
    among : int, optional
        Runs of the whole flight, which limit the times at which a function is evaluated at once.

    Returns
    -------
    Inputs
        Constants, and signals over time.

    Raises
    ------
    InputError
        If a function of time fails, returns no numbers or another shape, or changes too fast to be
        resolved.
    """
    constants = np.zeros((1, layout.inputs))
    tracks = []
    for name in FIELDS:
        value = getattr(scenario, name)
        if value is None:
            continue
        columns = np.concatenate(
            [np.arange(layout.inputs)[layout.of_input[given]] for given in FIELDS[name]]
        )
        sign = scenario.tip_wrench_sign if name == "tip_wrench" else 1.0
        if callable(value):
            signal = signal_of(name, value, duration, len(columns), scenario.jumps, runs, among)
            if not signal.is_constant:
                tracks.append(Track(signal.scaled(sign), columns))
                continue
            rows = signal.coefficients[..., 0]
        else:
            rows = np.atleast_2d(value)
            rows = rows if runs is None or len(rows) == 1 else rows[runs]
        constants = np.array(
            np.broadcast_to(constants, (max(len(rows), len(constants)), layout.inputs))
        )
        constants[:, columns] += sign * rows
    tracks += _switches(scenario, duration)
    tracks += _beside(constants, tracks, duration)
    return Inputs(constants, tuple(tracks), groups, scenario.gravity)


def _switches(scenario: Scenario, duration: float) -> list[Track]:
    """Return a track of zeros with a breakpoint where a payload is picked up or released."""
    if scenario.payload is None:
        return []
    times = np.array(scenario.payload.within((), duration))
    none = constant([0.0], duration)
    return [Track(replace(none, breaks=(times,)), np.zeros(1, int))]


def _beside(constants: Array, tracks: list[Track], duration: float) -> list[Track]:
    """Return tracks of the constants in columns that other tracks use, and set these constants to
    0.

    Such as a lift in tau beside a force over time; in these columns only tracks are added.
    """
    driven = np.unique(np.concatenate([np.zeros(0, int), *(each.columns for each in tracks)]))
    shared = driven[np.any(constants[:, driven] != 0.0, axis=0)]
    if not len(shared):
        return []
    track = Track(constant(constants[:, shared], duration), shared)
    constants[:, shared] = 0.0
    return [track]


def signal_of(
    name: str,
    value: Any,
    duration: float,
    width: int,
    jumps: tuple[float, ...] = (),
    runs: NDArray[np.intp] | None = None,
    among: int = 1,
) -> Signal:
    """Return a function of time as a signal: its own, if it has one, or a fit.

    Raises InputError as `inputs_of` does.
    """
    own = getattr(value, "signal", None)
    if own is not None:
        found: Signal = own(duration)
        return found if runs is None or found.rows == 1 else found.of_runs(runs)
    if duration > _LONGEST:
        raise InputError(
            "duration",
            f"is {duration:g} s, but {name} is a function of time, limited to {_LONGEST:g} s",
            "shorten it, or give a method and a step",
        )
    first = True

    def evaluate(times: Array) -> Array:
        """Return the values of wanted runs; the first call checks that they repeat."""
        nonlocal first
        given = evaluated if first else asked
        parts = []
        most = min(_AT_ONCE, times_at_once(among, width))
        # In blocks, as rows of all runs are returned, but only the wanted ones kept.
        for at in range(0, len(times), most):
            rows = given(name, value, times[at : at + most], width)
            parts.append(rows if runs is None or rows.shape[1] == 1 else rows[:, runs])
        first = False
        if len({part.shape[1] for part in parts}) > 1:
            # Raises the error of a function whose number of rows changes.
            given(name, value, times, width)
        return np.concatenate(parts)

    try:
        return fit(evaluate, duration, jumps=jumps)
    except UnresolvedSignal as error:
        raise InputError(
            name,
            f"changes too fast near t = {error.time:g} s to be resolved in {error.calls:,} calls",
            "give a smoother function, or interpolate samples",
        ) from error


def ticks_of(scenario: Scenario, duration: float, samples: Array) -> Ticks:
    """Return the update times of the scenario's controller, and those at which its commands act."""
    late = 0.0 if scenario.controller is None else scenario.controller.latency
    return Ticks(control_times(duration, scenario.period, late), samples)


def grid_of_ticks(ticks: Ticks) -> Grid:
    """Return the intervals between ticks as a grid, for controller loops."""
    starts, steps = ticks.times[:-1], np.diff(ticks.times)
    none = np.zeros(len(steps), bool)
    return Grid(ticks.samples, starts, steps, np.full(len(steps), -1, np.int32), none, none)
