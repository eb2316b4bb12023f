"""Flights that their steps resolve: errors that grow are counted, and coarse steps are halved."""

from __future__ import annotations

import numpy as np

from continuair.flight.cohorts import Flight
from continuair.flight.growing import count_growth, parted
from continuair.flight.halving import error_by_halving
from continuair.flight.rollout import record
from continuair.flight.trajectory import Recorder

Array = np.ndarray

POSE = ("tip_position", "tip_attitude")
"""What a recorder keeps by which errors that grow are told, unless a controller closes the loop."""


def record_resolved(recorder: Recorder) -> int:
    """Fly what a recorder keeps, and runs that an automatic step does not resolve again at half of
    it; return how many. Its step_error is that of what it keeps then."""
    flight, model = recorder.flight, recorder.model
    record(recorder)
    count_growth_of(recorder)
    flown_again = flight.improvable(recorder.step_error)
    if len(flown_again):
        recorder.flight = flight.halved(flown_again)
        record(recorder, flown_again)
        measured = error_by_halving(flight, model, flown_again, recorder.dtype)
        recorder.step_error[flown_again] = measured
    if len(abrupt := flight.unmeasured(recorder.step_error)):
        measured = error_by_halving(flight, model, abrupt)
        recorder.step_error[abrupt] = np.fmax(recorder.step_error[abrupt], measured)
    return len(flown_again)


def count_growth_of(recorder: Recorder) -> None:
    """Count errors that grow with the flight in the step_error of a recorder's runs."""

    def fly_coarser(other: Flight, runs: Array) -> tuple[Array, Array]:
        twin = Recorder(other, recorder.model, POSE, recorder.dtype, runs)
        record(twin, runs)
        apart = parted(_ends(recorder)[runs], _ends(twin)).max(axis=-1)
        return apart[:, None], np.abs(recorder.end_time[runs] - twin.end_time)[:, None]

    errors = recorder.step_error[:, None]
    count_growth(recorder.flight, (recorder.model,), errors, fly_coarser, recorder.dtype)


def _ends(recorder: Recorder) -> Array:
    """Poses of the tips at the end (runs, arms, 7)."""
    parts = [recorder.values(name)[:, -1] for name in POSE]
    place, turn = (each.reshape(len(each), -1, n) for each, n in zip(parts, (3, 4), strict=True))
    return np.concatenate([place, turn], axis=-1)
