"""Batches of paired closed-loop flights in memory, reduced to metrics of tip and image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.metrics import at_camera, differences, feature_rms, norm_difference
from continuair.engine.compiling import kind_of
from continuair.flight.cohorts import Flight
from continuair.flight.limits import share_at_limits, with_limited_command
from continuair.flight.rollout import fly_models
from continuair.flight.trajectory import COUNTED
from continuair.typing import Array
from continuair.vehicle.layout import DEVIATIONS

# Most bytes of the logs of one block of runs, and bytes of a sample.
_BLOCK_BYTES = {"cpu": 1e8, "cuda": 8e9}
_BYTES_PER_SAMPLE = 1000


@dataclass(frozen=True)
class Reduced:
    """Results of flights.

    (runs, models): metrics, status, end_time, error_estimate (NaN without a second flight), the
    largest saturation, and the share of samples at the controller's limits. tip: final pose (runs,
    models, 7). counts (runs, models, COUNTS) of adaptive steps: those of kernels/adaptive.py.
    """

    metrics: dict[str, Array]
    tip: Array
    status: NDArray[np.integer]
    end_time: Array
    error_estimate: Array
    saturation: Array
    at_limits: Array
    counts: Array | None = None


def track(
    flight: Flight,
    models: tuple[str, ...],
    settle: float,
    check: bool = False,
) -> Reduced:
    """Simulate each model's closed loop, in blocks of runs that fit into memory."""
    kind = kind_of(flight.coupled.device)
    most = _BLOCK_BYTES[kind] / (_BYTES_PER_SAMPLE * len(flight.marks.samples))
    size = max(1, int(most))
    names = ("tip_position", "tip_attitude") + ("feature_error",) * bool(flight.scenario.targets)
    names = with_limited_command(names, flight.scenario)
    parts, order = [], []
    alike = [np.arange(flight.runs)]
    if not flight.counted:
        alike = [same for same, _ in flight.grids()]
    for same in alike:
        for runs in (same[first : first + size] for first in range(0, len(same), size)):
            flown = fly_models(flight, models, names, runs, check)
            flights = [_with_runs(at_camera(each, flight.vehicle)) for each in flown]
            at_limits = [share_at_limits(flight.scenario, each, runs) for each in flights]
            parts.append(replace(reduced(flights, settle), at_limits=np.stack(at_limits, -1)))
            order.append(runs)
    back = np.argsort(np.concatenate(order))

    def joined(arrays: list[NDArray[Any]]) -> NDArray[Any]:
        """Return arrays of all blocks in the order of runs."""
        return np.concatenate(arrays)[back]

    return Reduced(
        {name: joined([part.metrics[name] for part in parts]) for name in parts[0].metrics},
        joined([part.tip for part in parts]),
        joined([part.status for part in parts]),
        joined([part.end_time for part in parts]),
        joined([part.error_estimate for part in parts]),
        joined([part.saturation for part in parts]),
        joined([part.at_limits for part in parts]),
        joined([part.counts for part in parts if part.counts is not None])
        if flight.counted
        else None,
    )


def _with_runs(flight: xr.Dataset) -> xr.Dataset:
    """Return a flight with a dimension of runs."""
    return flight if "run" in flight.dims else flight.expand_dims("run")


def reduced(flights: list[xr.Dataset], settle: float) -> Reduced:
    """Return metrics of each model's flight against the first's; NaN for runs that stopped early.

    flights: of the same runs, with the tip's pose, and feature_error if there is a target; settle:
    time from which feature_error, or else the tip, counts [s].
    """
    reference = flights[0]
    status = np.stack([flight["status"].to_numpy() for flight in flights], axis=-1)
    well = status == 0
    both = well & well[:, :1]
    rows = [_metrics(reference, flight, settle) for flight in flights]
    metrics = {
        name: np.where(both, np.stack([row[name] for row in rows], axis=-1), np.nan)
        for name in rows[0]
    }
    poses = [
        np.concatenate(
            [flight[name].to_numpy()[:, -1] for name in ("tip_position", "tip_attitude")], -1
        )
        for flight in flights
    ]

    def each(name: str) -> Array:
        """Return a variable of all models (runs, models)."""
        return np.stack([flight[name].to_numpy() for flight in flights], axis=-1)

    counted = "steps" in reference
    error = np.full(status.shape, np.nan)
    if "error_estimate" in reference:
        error = each("error_estimate")
    counts = np.stack([each(name) for name in COUNTED], axis=-1) if counted else None
    saturated = np.zeros(status.shape)
    if "largest_saturation" in reference:
        saturated = each("largest_saturation")
    free, tips = np.zeros(status.shape), np.stack(poses, axis=1)
    return Reduced(metrics, tips, status, each("end_time"), error, saturated, free, counts)


def _metrics(reference: xr.Dataset, flight: xr.Dataset, settle: float) -> dict[str, Array]:
    # The sample there may be a rounding error before it.
    """Return the metrics (runs,) of a flight against the reference."""
    since = slice(settle * (1.0 - 1e-9), None)
    first, late = (each.sel(time=since) for each in (reference, flight))
    if flight is reference:
        found = {name: np.zeros(flight.sizes["run"]) for name in DEVIATIONS}
    else:
        tracks = "feature_error" in flight
        compared = differences(reference, flight) if tracks else differences(first, late)
        found = {name: np.asarray(compared[name]) for name in DEVIATIONS}
    if "feature_error" in flight:
        found["rms_px"] = np.asarray(feature_rms(late))
        found["max_px"] = np.abs(late["feature_error"].to_numpy()).max(axis=(1, 2))
        found["ds_max_px"] = np.abs(norm_difference(first, late)).max(axis=1)
    return found
