"""Flights that their steps resolve: errors that grow are counted, and coarse steps are halved."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from continuair.flight.adaptive import error_between
from continuair.flight.cohorts import Flight
from continuair.flight.growing import count_growth, parted
from continuair.flight.halving import error_by_halving
from continuair.flight.rollout import record
from continuair.flight.trajectory import Recorder

Array = np.ndarray

POSE = ("tip_position", "tip_attitude")
"""What a recorder keeps by which errors that grow are told, unless a controller closes the loop."""


def resolve(
    flight: Flight,
    models: tuple[str, ...],
    errors: Array,
    fly_coarser: Callable[[Flight, Array], tuple[Array, Array]],
    fly_again: Callable[[Flight, Array], Array],
    dtype: str = "float64",
) -> tuple[Flight, Array]:
    """Make step_error (runs, models) that of flights as they are kept: errors that grow count, and
    runs that an automatic step does not resolve are flown again at half of it.

    errors: as single steps have them, written in place. fly_coarser: as of `count_growth`.
    fly_again(finer, runs) flies runs of another Flight, by their indices, in the place of what was
    kept of them, and returns the errors of all, which are written in turn. Returns the Flight that
    is kept, and the runs that were flown again.
    """
    count_growth(flight, models, errors, fly_coarser, dtype)
    chosen, kept = flight.improvable(errors), flight
    if len(chosen):
        kept = flight.halved(chosen)
        errors = fly_again(kept, chosen)
        for column, model in enumerate(models):
            errors[chosen, column] = error_by_halving(flight, model, chosen, dtype)
        # Half the step may miss what inputs do, too.
        errors[flight.missed] = np.inf
    if len(abrupt := flight.unmeasured(errors)):
        for column, model in enumerate(models):
            measured = error_by_halving(flight, model, abrupt, dtype)
            errors[abrupt, column] = np.fmax(errors[abrupt, column], measured)
    return kept, chosen


def record_resolved(recorder: Recorder) -> int:
    """Fly what a recorder keeps, resolved, and return how many runs were flown again."""

    def fly_again(finer: Flight, runs: Array) -> Array:
        recorder.flight = finer
        record(recorder, runs)
        return recorder.step_error[:, None]

    record(recorder)
    first, model, dtype = recorder.flight, recorder.model, recorder.dtype
    errors, coarser = recorder.step_error[:, None], coarser_than(recorder)
    _, again = resolve(first, (model,), errors, coarser, fly_again, dtype)
    return len(again)


def error_of_steps(recorder: Recorder) -> Array:
    """Largest distance of a tip from that of a flight at half the step (runs,), in arm lengths.

    The recorder must keep tip_position.
    """
    flight, runs = recorder.flight, recorder.runs
    finer = Recorder(flight.halved(runs), recorder.model, ("tip_position",), recorder.dtype, runs)
    record(finer)
    return error_between(recorder, finer)


def coarser_than(recorder: Recorder) -> Callable[[Flight, Array], tuple[Array, Array]]:
    """What `count_growth` flies beside what a recorder has kept, which must have the POSE."""

    def fly_coarser(other: Flight, runs: Array) -> tuple[Array, Array]:
        twin = Recorder(other, recorder.model, POSE, recorder.dtype, runs)
        record(twin, runs)
        apart = parted(_ends(recorder)[runs], _ends(twin)).max(axis=-1)
        return apart[:, None], np.abs(recorder.end_time[runs] - twin.end_time)[:, None]

    return fly_coarser


def _ends(recorder: Recorder) -> Array:
    """Poses of the tips at the end (runs, arms, 7)."""
    parts = [recorder.values(name)[:, -1] for name in POSE]
    place, turn = (each.reshape(len(each), -1, n) for each, n in zip(parts, (3, 4), strict=True))
    return np.concatenate([place, turn], axis=-1)
