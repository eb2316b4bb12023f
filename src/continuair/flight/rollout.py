"""Simulation of a prepared flight's runs, in parts that fit into memory."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.engine.engine import Engine
from continuair.engine.lanes import packs_of
from continuair.flight import adaptive
from continuair.flight.cohorts import Cohort, Flight
from continuair.flight.trajectory import OBSERVED_VARIABLES, Recorder
from continuair.typing import Array
from continuair.vehicle.runs import per_run

# Numbers that are logged at once before they are recorded: on the CPU they fit the cache.
_LOGGED_AT_ONCE = {"cpu": 1.0e6, "cuda": 2.0e7}
_NUMBERS_PER_SAMPLE = 50


def fly(
    flight: Flight,
    model: str,
    names: tuple[str, ...],
    runs: NDArray[np.intp] | None = None,
    check: bool = False,
) -> xr.Dataset:
    """Return the trajectories of one model of a prepared flight, or of some of its runs by index.

    check: compute error_estimate by a second simulation.
    """
    recorder = Recorder(flight, model, names, "float64", runs)
    record(recorder, check=check)
    recorder.names = names
    return recorder.dataset(recorder.step)


def record(recorder: Recorder, *, check: bool = False) -> None:
    """Simulate the runs of a recorder; check: also with finer steps, for error_estimate."""
    if not check:
        _record(recorder)
        return
    place = "tip_position" if recorder.flight.vehicle.arms else "position"
    recorder.names = tuple(dict.fromkeys((*recorder.names, place)))
    _record(recorder)
    flight, runs = recorder.flight.finer(), recorder.runs
    second = Recorder(flight, recorder.model, (place,), recorder.dtype, runs)
    _record(second)
    recorder.error_estimate = error_between(recorder, second, place)


def error_between(recorder: Recorder, finer: Recorder, place: str) -> Array:
    """Return the largest distance of a point from that of a finer flight (runs,), in arm lengths.

    inf if the two have different statuses.
    """
    tips, others = (each.values(place) for each in (recorder, finer))
    reach = per_run(recorder.flight.vehicle.reach, recorder.flight.runs)[recorder.runs]
    apart = np.asarray(tips - others, float).reshape(*tips.shape[:2], -1, 3)
    largest = np.nanmax(np.linalg.norm(apart, axis=-1), axis=(1, 2), initial=0.0)
    return np.where(recorder.status == finer.status, largest / reach, np.inf)


def _record(recorder: Recorder) -> None:
    """Simulate the runs of a recorder once."""
    flight = recorder.flight
    if flight.counted:
        adaptive.record(recorder)
        return
    engine = flight.engine(recorder.model, recorder.dtype)
    observe = any(name in OBSERVED_VARIABLES for name in recorder.names)
    alone, among = engine.on_one_thread(), len(recorder.runs)
    for cohort in flight.parts(recorder.runs):
        size = _runs_at_once(cohort, engine)
        alone.load_rollout(cohort.loop, size)
        parts = (
            cohort.part(slice(first, first + size), observe)
            for first in range(0, len(cohort.runs), size)
        )
        engine.side_by_side(
            lambda part: recorder.keep(part, part.fly(alone, observe, among)), parts
        )


def _runs_at_once(cohort: Cohort, engine: Engine) -> int:
    """Return how many runs of a group fit into memory, in whole packs."""
    kind, runs = engine.device.split(":")[0], len(cohort.runs)
    size = most_runs(cohort.grid.samples, _LOGGED_AT_ONCE[kind])
    if kind == "cpu":
        size = min(size, -(-runs // engine.threads))
    lanes = engine.kernels_for(size).lanes
    return lanes * packs_of(size, lanes)


def most_runs(samples: Array, numbers: float) -> int:
    """Return how many runs with some samples have that many numbers."""
    return max(1, int(numbers / (len(samples) * _NUMBERS_PER_SAMPLE)))
