"""Launches of roll-outs with adaptive steps: packed signals and tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import warp as wp

from continuair.engine.engine import Engine, Start
from continuair.engine.lanes import packs_of
from continuair.engine.pack import natural_units, units_of_own_states
from continuair.kernels.adaptive import COUNTS, STEPS
from continuair.kernels.embedded import TSIT5, Pair
from continuair.kernels.signals import signal_struct
from continuair.kernels.step_control import FIRST, GROWTH, control_arguments
from continuair.signals import Signal

Array = np.ndarray

MOST_STEPS = 10_000_000
"""Most steps of one run, rejected ones included."""

_GRAVITY = 9.81
"""Gravity in natural units [m/s²]."""

TRIAL = 0.05
"""Length of the trial run [s] whose step counts group runs into packs."""


@dataclass(frozen=True, eq=False)
class Track:
    """A signal, and the columns of a table to which its values are added."""

    signal: Signal
    columns: Array

    def of_runs(self, runs: Array) -> Track:
        """Return the track of some runs."""
        return Track(self.signal.of_runs(runs), self.columns)


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of runs over time.

    constants (runs or 1, inputs); tracks: signals added to them; groups: bits of the groups of
    inputs in use; gravity [m/s²].
    """

    constants: Array
    tracks: tuple[Track, ...]
    groups: int
    gravity: float

    def __call__(self, times: Array) -> Array:
        """Return inputs (times, runs or 1, inputs), at a jump the limit from the right."""
        rows = max([len(self.constants), *(track.signal.rows for track in self.tracks)])
        table = np.empty((len(times), rows, self.constants.shape[1]))
        table[:] = self.constants
        for track in self.tracks:
            table[..., track.columns] += track.signal(times)
        return table

    @property
    def nbytes(self) -> int:
        """Return the size in memory [bytes]."""
        return (
            sum(track.signal.coefficients.nbytes for track in self.tracks) + self.constants.nbytes
        )

    def of_runs(self, runs: Array) -> Inputs:
        """Return the inputs of some runs."""
        constants = self.constants if len(self.constants) == 1 else self.constants[runs]
        tracks = tuple(track.of_runs(runs) for track in self.tracks)
        return Inputs(constants, tracks, self.groups, self.gravity)


@dataclass(frozen=True, eq=False)
class Ticks:
    """Times of controller updates (n + 1,), from start to end, and of samples [s]."""

    times: Array
    samples: Array


@dataclass(frozen=True)
class Tolerance:
    """Error tolerance of a step, and its maximum length `longest` [s].

    `absolute` is in natural units: arm lengths, radians, and these per √(length / 9.81 m/s²).
    Without it, `relative` is the absolute tolerance in these units.
    """

    relative: float
    absolute: float | None = None
    longest: float = np.inf

    def finer(self, period: float | None, kinked: bool = False) -> Tolerance:
        """Return a tenth of the tolerance, with steps of at most half a controller's period [s].

        The difference between runs with both tolerances estimates the error of the first. Where
        forces have kinks, errors depend on where steps end beside these, and a tenth of the
        tolerance may even raise them; a hundredth is returned then.
        """
        share = 0.01 if kinked else 0.1
        absolute = None if self.absolute is None else share * self.absolute
        longest = self.longest if period is None else min(self.longest, 0.5 * period)
        return Tolerance(share * self.relative, absolute, longest)


@dataclass(frozen=True, eq=False)
class Launch:
    """A roll-out of some runs.

    runs: their indices into the vehicles. loop: struct of a packed loop. motion: of its targets, if
    the law acts at every stage. All fields but `ticks` and `tolerance` belong to these runs.
    """

    runs: Array
    start: Start
    inputs: Inputs
    ticks: Ticks
    tolerance: Tolerance
    loop: Any = None
    motion: Track | None = None
    pair: Pair = TSIT5

    def on(self, engine: Engine, kernel: wp.Kernel, lanes: int, log: Any) -> tuple[Array, Array]:
        """Simulate with a kernel of an engine's model into a log (runs, samples, columns).

        The log is on the engine's device. Rows after the end of a run stay unchanged. Returns
        status (runs,) and counts (runs, COUNTS) of kernels/adaptive.py.
        """
        n = len(self.runs)
        status, counts = np.zeros(n, np.int32), np.zeros((n, COUNTS), engine.dtype)
        out = [engine.upload(status, wp.int32), engine.upload(counts)]
        arguments = [
            engine.vehicles(self.runs, engine.kernels_of(lanes)),
            engine.start(self.start, slice(None)),
            _drive(engine, self.inputs, n),
            packed_signals(engine, self.inputs.tracks, n),
            packed_signals(engine, (self.motion,) if self.motion else (), n),
            _method(engine.dtype.name, engine.device, self.pair),
            _control(engine, self.tolerance, self.pair, self.runs),
            _ticks(engine, self.ticks),
            engine.no_loop() if self.loop is None else self.loop,
            log,
            *out,
        ]
        engine.launch(kernel, packs_of(n, lanes), arguments)
        for source, target in zip(out, (status, counts), strict=True):
            engine.download(source, target)
        return status, counts

    def order(self, engine: Engine, kernel: wp.Kernel, lanes: int, columns: int) -> Array:
        """Return an order of the runs in which the runs of a pack need similar numbers of steps.

        A short trial run counts the steps. columns: of the kernel's log.
        """
        few = len(self.runs) <= lanes or self.ticks.times[-1] <= 2.0 * TRIAL
        if lanes == 1 or few or self.loop is not None:
            return np.arange(len(self.runs))
        times = np.array([0.0, TRIAL])
        log = wp.empty((len(self.runs), 2, columns), engine.kernels.types.Cell, engine.device)
        counts = replace(self, ticks=Ticks(times, times)).on(engine, kernel, lanes, log)[1]
        return np.argsort(counts[:, STEPS], kind="stable")

    def of_runs(self, chosen: Array) -> Launch:
        """Return the roll-out of some of its runs, by their positions in it, without a loop."""
        start, motion = self.start, self.motion
        return replace(
            self,
            runs=self.runs[chosen],
            start=Start(start.states[chosen], start.angle[chosen]),
            inputs=self.inputs.of_runs(chosen),
            motion=None if motion is None else motion.of_runs(chosen),
        )


def _drive(engine: Engine, inputs: Inputs, runs: int) -> Any:
    """Return the struct of inputs: one row of constants, per run if there are signals."""
    table = inputs.constants
    if inputs.tracks:
        table = np.array(np.broadcast_to(table, (runs, table.shape[1])))
    found = engine.kernels.arguments.Drive()
    found.inputs, found.stride = engine.upload(table[None]), 0
    found.groups, found.gravity = inputs.groups, inputs.gravity
    return found


def packed_signals(engine: Engine, tracks: Sequence[Track], runs: int) -> Any:
    """Return the struct of tracks (kernels/signals.py)."""
    return (
        _packed(engine, tracks, runs) if tracks else _no_signals(engine.dtype.name, engine.device)
    )


@lru_cache(maxsize=8)
def _no_signals(precision: str, device: str) -> Any:
    """Return the struct of no tracks."""
    found, Cell = signal_struct(precision)(), getattr(wp, precision)
    for name, kind in (("index", 3), ("kinds", 2), ("break_index", 2), ("cursor", 2)):
        shape = (1, 0, 2) if kind == 3 else (1, 2) if name == "break_index" else (0, 0)
        setattr(found, name, wp.zeros(shape, wp.int32, device=device))
    for name in ("columns", "driven", "offsets"):
        setattr(found, name, wp.zeros(0, wp.int32, device=device))
    for name in ("coefficients", "breaks"):
        setattr(found, name, wp.zeros(0, Cell, device=device))
    found.edges = wp.zeros((0, 2), Cell, device=device)
    return found


def _packed(engine: Engine, tracks: Sequence[Track], runs: int) -> Any:
    found = signal_struct(engine.dtype.name)()
    signals = [track.signal for track in tracks]
    rows = max([1, *(signal.rows for signal in signals)])
    index = np.zeros((rows, len(tracks), 2), np.int32)
    kinds = np.zeros((len(tracks), 3), np.int32)
    offsets, coefficients, pieces, columns, numbers = [], [], 0, 0, 0
    for q, signal in enumerate(signals):
        index[:, q, 0] = pieces + signal.first[:-1]
        index[:, q, 1] = np.diff(signal.first)
        own = signal.coefficients
        kinds[q] = own.shape[2], own.shape[1], columns
        offsets.append(numbers + own[0].size * np.arange(len(own)))
        coefficients.append(own.ravel())
        pieces, columns, numbers = pieces + len(own), columns + own.shape[1], numbers + own.size
    targets = [track.columns for track in tracks]
    breaks = [_breaks(signals, row) for row in range(rows)]
    counts = np.array([len(own) for own in breaks])
    found.index = engine.upload(index, wp.int32)
    found.kinds = engine.upload(kinds, wp.int32)
    found.columns = engine.upload(_joined(targets), wp.int32)
    found.driven = engine.upload(np.unique(_joined(targets)), wp.int32)
    found.edges = engine.upload(_joined([signal.edges for signal in signals]).reshape(-1, 2))
    found.offsets = engine.upload(_joined(offsets), wp.int32)
    found.coefficients = engine.upload(_joined(coefficients))
    found.breaks = engine.upload(_joined(breaks))
    first = np.append(0, np.cumsum(counts)[:-1])
    found.break_index = engine.upload(np.stack([first, counts], axis=1), wp.int32)
    found.cursor = engine.upload(np.zeros((runs, len(tracks))), wp.int32)
    return found


def _breaks(signals: Sequence[Signal], row: int) -> Array:
    """Return the breakpoints of a run, of all its signals, in order."""
    own = [signal.breaks[row if signal.rows > 1 else 0] for signal in signals]
    return np.unique(_joined(own))


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate([*parts]) if len(parts) else np.zeros(0)


@lru_cache(maxsize=8)
def _method(precision: str, device: str, pair: Pair) -> Any:
    found, Cell = control_arguments(precision).Method(), getattr(wp, precision)
    for name in ("stages", "nodes", "error", "dense"):
        setattr(found, name, wp.array(getattr(pair, name), dtype=Cell, device=device))
    found.own, found.before = (exponent / pair.order for exponent in GROWTH)
    found.rejected = -1.0 / pair.order
    return found


def _control(engine: Engine, tolerance: Tolerance, pair: Pair, runs: Array) -> Any:
    found = control_arguments(engine.dtype.name).Control()
    scales, period = error_scales(engine, runs)
    absolute = tolerance.relative if tolerance.absolute is None else tolerance.absolute
    found.allowed = engine.upload(absolute * scales)
    found.absolute = absolute
    found.relative = 0.0 if tolerance.absolute is None else tolerance.relative
    first = np.minimum(0.1 * period, tolerance.longest)
    longest = np.full(len(first), min(tolerance.longest, 1e30))
    found.longest = engine.upload(np.stack([first, longest], axis=1))
    # The step length is proportional to a root of its error, which is at most `absolute`.
    found.begin = (FIRST * absolute) ** (1.0 / pair.order) / absolute
    found.most = MOST_STEPS
    return found


def error_scales(engine: Engine, runs: Array) -> tuple[Array, Array]:
    """Return natural units of a state (runs or 1, state) and of time (runs or 1,).

    They are arm lengths, radians, and these per √(length / 9.81 m/s²), whatever the gravity of a
    simulation is. Those of the state are in kernel units, that of time in seconds.
    """
    plants = engine.plants if len(engine.plants) == 1 else engine.plants[runs]
    lengths = plants["length"]
    period = np.sqrt(lengths / _GRAVITY)
    layout = engine.layout
    scales = np.ones((len(lengths), layout.state))
    scales[:, layout.position] = lengths[:, None]
    # A quaternion changes by half the rotation angle.
    scales[:, layout.attitude] = 0.5
    bends = natural_units(engine.vehicle, layout, len(engine.plants))
    bends = (bends if len(bends) == 1 else bends[runs]) * plants["unit"]
    scales[:, layout.bend] = bends
    scales[:, layout.velocity] = (lengths / period)[:, None]
    scales[:, layout.angular_velocity] = 1.0 / period[:, None]
    scales[:, layout.bend_rate] = bends / period[:, None]
    own = units_of_own_states(engine.vehicle, len(engine.plants))
    scales[:, layout.bend_rate.stop :] = own if len(own) == 1 else own[runs]
    return scales, period


def _ticks(engine: Engine, ticks: Ticks) -> Any:
    found = control_arguments(engine.dtype.name).Ticks()
    found.starts, found.ends = engine.upload(ticks.times[:-1]), engine.upload(ticks.times[1:])
    found.samples = engine.upload(ticks.samples)
    return found
