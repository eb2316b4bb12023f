"""Simulation of a prepared flight's runs, in parts that fit into memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.flight import adaptive, chunks
from continuair.flight.cohorts import Flight
from continuair.flight.trajectory import Recorder
from continuair.typing import Array
from continuair.vehicle.runs import per_run

_PLACES = 4e8
"""Memory for the tips of runs that are simulated a second time [bytes]."""

_COPIES = 8
"""Arrays of their size that a comparison of tips needs."""


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
    return recorder.dataset(recorder.step)


def fly_models(
    flight: Flight,
    models: Sequence[str],
    names: tuple[str, ...],
    runs: NDArray[np.intp] | None = None,
    check: bool = False,
) -> list[xr.Dataset]:
    """Return the trajectories of several models, side by side; as `fly`."""
    found: dict[str, xr.Dataset] = {}
    for model in models:
        # Before threads do: they share an engine of each model.
        flight.engine(model)

    def one(model: str) -> None:
        """Fly one model."""
        found[model] = fly(flight, model, names, runs, check)

    flight.coupled.side_by_side(one, models)
    return [found[model] for model in models]


def record(recorder: Recorder, *, check: bool = False) -> None:
    """Simulate the runs of a recorder; check: also with finer steps, for error_estimate."""
    if not check:
        _record(recorder, recorder.runs)
        return
    place = "tip_position" if recorder.flight.vehicle.arms else "position"
    finer, size = recorder.flight.finer(), _compared_at_once(recorder)
    estimate = recorder.error_estimate = np.empty(len(recorder.runs))
    for first in range(0, len(recorder.runs), size):
        at = slice(first, first + size)
        runs = recorder.runs[at]
        coarse, fine = (
            Recorder(each, recorder.model, (place,), recorder.dtype, runs)
            for each in (recorder.flight, finer)
        )
        with recorder.beside(coarse):
            _record(recorder, runs)
        _record(fine, runs, len(recorder.runs))
        estimate[at] = error_between(coarse, fine, place)


def working_bytes(recorder: Recorder, check: bool = False) -> float:
    """Return the memory that the simulation of a recorder needs besides its results [bytes]."""
    flight = recorder.flight
    bytes_used = chunks.working_bytes(flight, flight.engine(recorder.model, recorder.dtype))
    compared = min(_compared_at_once(recorder), len(recorder.runs))
    return bytes_used + check * compared * _bytes_of_place(recorder)


def _compared_at_once(recorder: Recorder) -> int:
    """Return of how many runs the tips of two flights fit into memory."""
    return max(1, int(_PLACES / _bytes_of_place(recorder)))


def _bytes_of_place(recorder: Recorder) -> float:
    """Return the memory for a comparison of a run's tips [bytes]."""
    numbers = 3 * max(1, len(recorder.flight.vehicle.arms)) * len(recorder.flight.marks.samples)
    return 8.0 * _COPIES * numbers


def error_between(recorder: Recorder, finer: Recorder, place: str) -> Array:
    """Return the largest distance of a point from that of a finer flight (runs,), in arm lengths.

    inf if the two have different statuses.
    """
    tips, others = (each.values(place) for each in (recorder, finer))
    reach = per_run(recorder.flight.vehicle.reach, recorder.flight.runs)[recorder.runs]
    apart = np.asarray(tips - others, float).reshape(*tips.shape[:2], -1, 3)
    largest = np.nanmax(np.linalg.norm(apart, axis=-1), axis=(1, 2), initial=0.0)
    return np.where(recorder.status == finer.status, largest / reach, np.inf)


def _record(recorder: Recorder, runs: NDArray[np.intp], among: int | None = None) -> None:
    """Simulate some runs of a recorder once; among: the runs of the whole flight."""
    flight = recorder.flight
    among = len(recorder.runs) if among is None else among
    if flight.counted:
        adaptive.record(recorder, runs, among)
        return
    engine = flight.engine(recorder.model, recorder.dtype)
    names = recorder.observed
    alone = engine.on_one_thread()
    for cohort in flight.parts(runs):
        size = chunks.cached_runs_at_once(cohort.grid.samples, len(cohort.runs), engine)
        alone.load_rollout(cohort.loop, size)
        parts = (
            cohort.part(slice(first, first + size), bool(names))
            for first in range(0, len(cohort.runs), size)
        )
        engine.side_by_side(lambda part: recorder.keep(part, part.fly(alone, names, among)), parts)
