"""What a recorder keeps of a prepared flight's runs, flown in parts that fit into memory."""

from __future__ import annotations

import numpy as np
import xarray as xr

from continuair.engine.engine import Engine
from continuair.engine.lanes import packs_of
from continuair.flight import adaptive
from continuair.flight.cohorts import Cohort, Flight
from continuair.flight.trajectory import OBSERVED_VARIABLES, Recorder

Array = np.ndarray

# Numbers that are logged at once before they are kept: on the CPU they stay near the core.
_LOGGED_AT_ONCE = {"cpu": 1.0e6, "cuda": 2.0e7}
_NUMBERS_PER_SAMPLE = 50


def fly(
    flight: Flight,
    model: str,
    names: tuple[str, ...],
    runs: Array | None = None,
    check: bool = False,
) -> xr.Dataset:
    """Trajectories of one model of a prepared flight, or of some of its runs, by their indices.

    check: whether steps that follow from their errors are checked by a second flight.
    """
    recorder = Recorder(flight, model, names, "float64", runs)
    if not flight.counted:
        record(recorder, runs)
    elif check:
        adaptive.checked_record(recorder)
    else:
        adaptive.record(recorder)
    return recorder.dataset(recorder.step)


def record(recorder: Recorder, runs: Array | None = None) -> None:
    """Fly what a recorder keeps, or some of its runs."""
    flight = recorder.flight
    engine = flight.engine(recorder.model, recorder.dtype)
    observe = any(name in OBSERVED_VARIABLES for name in recorder.names)
    alone = engine.on_one_thread()
    for cohort in flight.parts(runs):
        size = _runs_at_once(cohort, engine)
        alone.load_rollout(cohort.loop, observe, size)
        parts = (
            cohort.part(slice(first, first + size), observe)
            for first in range(0, len(cohort.runs), size)
        )
        engine.side_by_side(lambda part: recorder.keep(part, part.fly(alone, observe)), parts)


def _runs_at_once(cohort: Cohort, engine: Engine) -> int:
    """How many runs of a cohort fit into memory, in whole packs."""
    kind, runs = engine.device.split(":")[0], len(cohort.runs)
    size = most_runs(cohort.grid.samples, _LOGGED_AT_ONCE[kind])
    if kind == "cpu":
        size = min(size, -(-runs // engine.threads))
    lanes = engine.kernels_for(size).lanes
    return lanes * packs_of(size, lanes)


def most_runs(samples: Array, numbers: float) -> int:
    """How many runs of some samples make that many numbers."""
    return max(1, int(numbers / (len(samples) * _NUMBERS_PER_SAMPLE)))
