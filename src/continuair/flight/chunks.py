"""How many runs of a flight are simulated at once: as many as fit into a part of the memory.

All that a simulation needs besides its results is made for these runs only: logs, inputs over time,
and what a controller follows. Runs do not depend on those that they are simulated with.
"""

from __future__ import annotations

import numpy as np

from continuair.engine.compiling import kind_of
from continuair.engine.engine import Engine
from continuair.engine.lanes import packs_of
from continuair.engine.pack import MOST_KEPT
from continuair.flight.cohorts import INPUT_BYTES, Flight
from continuair.flight.inputs import BYTES_AT_ONCE, field_width
from continuair.signals.approximation import LEAST_SCAN, SCAN
from continuair.typing import Array
from continuair.vehicle.layout import FIELDS, MOTION, setpoint_columns, watched_columns, width_of

LOGGED = {"cpu": 1e8, "cuda": 2e9}
"""Memory of the logs, and the samples of inputs, of the runs of one thread [bytes]."""

LOGGED_TOGETHER = 1.6e9
"""Most of that memory for all threads of a CPU [bytes]."""

CACHED = {"cpu": 8e6, "cuda": 1.6e8}
"""The same in steps of one length: on the CPU these logs fit the cache [bytes]."""

_NUMBERS_PER_SAMPLE = 50
_COPIES = 3
"""Arrays of their size that inputs over time need while they are sampled."""

_BYTES_PER_RUN = 1200.0
"""Memory for a run of any duration: start, counts, and its row in the provenance [bytes]."""

_BYTES_PER_VEHICLE = 1000.0
"""Memory for a packed vehicle without its coefficients, of which some are made at once [bytes]."""

_BYTES_OF_COEFFICIENTS = 5000.0

_DERIVED = 25
"""Columns of the arrays from which a variable is derived."""


def runs_at_once(flight: Flight, engine: Engine, signals_alone: bool = False) -> int:
    """Return how many runs with adaptive steps fit into memory, in whole packs.

    With their logs, of which every thread has some, or with their inputs alone.
    """
    kind = kind_of(engine.device)
    numbers = 1 if signals_alone else _NUMBERS_PER_SAMPLE * len(flight.marks.samples)
    numbers += _input_numbers(flight) + _followed_numbers(flight)
    size = max(1, min(flight.runs, int(_bytes_of_thread(kind, engine.threads) / (8 * numbers))))
    if kind == "cpu" and not signals_alone:
        size = min(size, -(-flight.runs // engine.threads))
    lanes = engine.lanes(size)
    return lanes * packs_of(size, lanes)


def cached_runs_at_once(samples: Array, runs: int, engine: Engine) -> int:
    """Return how many of some runs with steps of one length are simulated at once."""
    kind = kind_of(engine.device)
    size = max(1, int(CACHED[kind] / (8 * len(samples) * _NUMBERS_PER_SAMPLE)))
    if kind == "cpu":
        size = min(size, -(-runs // engine.threads))
    lanes = engine.kernels_for(size).lanes
    return lanes * packs_of(size, lanes)


def working_bytes(flight: Flight, engine: Engine) -> float:
    """Return the memory that the simulation of a flight needs besides its results [bytes]."""
    timed = _input_numbers(flight)
    size = cached_runs_at_once(flight.marks.samples, flight.runs, engine)
    if flight.scenario.force_callback is not None:
        size = flight.runs
    elif flight.counted:
        size = runs_at_once(flight, engine)
    size = min(size, flight.runs)
    threads = min(engine.threads, -(-flight.runs // size)) if engine.device == "cpu" else 1
    targets, log = flight.scenario.targets, flight.coupled.layout.log
    # The kernel's log, and its copy in the order of runs, or variables that follow from it.
    seen = width_of(watched_columns(len(targets[0].depths))) if targets else 0
    columns = log + max(log, engine.observed_columns + 2 * seen + _DERIVED)
    each = engine.dtype.itemsize * columns * len(flight.marks.samples)
    each += 8 * _COPIES * (timed + _followed_numbers(flight))
    # A function of time returns the rows of all runs; fixed steps sample it for many of them.
    inputs = (timed > 0) * min(threads * BYTES_AT_ONCE, 8.0 * _COPIES * timed * flight.runs)
    inputs += (timed > 0) * (not flight.counted) * _COPIES * INPUT_BYTES[kind_of(engine.device)]
    vehicles = flight.vehicle.runs or 0
    kept = vehicles if vehicles <= MOST_KEPT else threads * size
    per_run = _BYTES_PER_RUN * flight.runs + _BYTES_PER_VEHICLE * vehicles
    return float(threads * size * each + inputs + per_run + _BYTES_OF_COEFFICIENTS * kept)


def _bytes_of_thread(kind: str, threads: int) -> float:
    """Return the memory of the logs of one thread [bytes]."""
    return min(LOGGED[kind], LOGGED_TOGETHER / threads) if kind == "cpu" else LOGGED[kind]


def _input_numbers(flight: Flight) -> int:
    """Return how many samples of inputs over time a run has while they are fitted."""
    scenario, layout = flight.scenario, flight.coupled.layout
    timed = [name for name in FIELDS if callable(getattr(scenario, name))]
    scanned = 2 * LEAST_SCAN + int(np.ceil(flight.duration / SCAN))
    return scanned * sum(field_width(name, layout) for name in timed)


def _followed_numbers(flight: Flight) -> int:
    """Return how many numbers on set-points and target a controlled run has over time."""
    scenario, times = flight.scenario, len(flight.marks.times)
    if scenario.controller is None:
        return 0
    guided = scenario.controller.guided
    columns = width_of(setpoint_columns(flight.coupled.layout.bends)) * guided
    return times * (columns + 2 * width_of(MOTION) * bool(scenario.targets))
