"""Batches of paired closed loops in memory, reduced to metrics of the tip and of the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair.analysis.metrics import compare
from continuair.controllers.controller import Controller
from continuair.flight.simulate import simulate
from continuair.kernels.deviations import DEVIATIONS
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.runs import take
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

# What the logs of one block of runs take at most, and what a sample of them takes.
_BLOCK_BYTES = {"cpu": 1e8, "cuda": 8e9}
_BYTES_PER_SAMPLE = 1000


@dataclass(frozen=True)
class Reduced:
    """What is kept of flights: metrics, status and end_time (runs, models), and the tip's pose at
    the end (runs, models, 7)."""

    metrics: dict[str, Array]
    tip: Array
    status: Array
    end_time: Array


def track(
    vehicle: Vehicle,
    scenario: Scenario,
    models: tuple[str, ...],
    steps: Array,
    settle: float,
    **options: Any,
) -> Reduced:
    """Fly each model's closed loop; steps: of each run (runs,) [s]; options: `simulate`'s."""
    samples = options["duration"] / options["sample"]
    most = _BLOCK_BYTES[options["device"].split(":")[0]] / (_BYTES_PER_SAMPLE * samples)
    size = max(1, int(most))
    parts, order = [], []
    for step in np.unique(steps):
        same = np.flatnonzero(steps == step)
        for at in (same[first : first + size] for first in range(0, len(same), size)):
            scene = _some_runs(scenario, at)
            flights = [
                _fly(take(vehicle, at), scene, model, step=float(step), **options)
                for model in models
            ]
            parts.append(_reduced(flights, settle))
            order.append(at)
    back = np.argsort(np.concatenate(order))

    def joined(arrays: list[Array]) -> Array:
        return np.concatenate(arrays)[back]

    return Reduced(
        {name: joined([part.metrics[name] for part in parts]) for name in parts[0].metrics},
        joined([part.tip for part in parts]),
        joined([part.status for part in parts]),
        joined([part.end_time for part in parts]),
    )


def _fly(vehicle: Vehicle, scenario: Scenario, model: str, **options: Any) -> xr.Dataset:
    names = ["tip_position", "tip_attitude"] + ["feature_error"] * bool(scenario.targets)
    flight = simulate(vehicle, scenario, model=model, variables=names, **options)
    return flight if "run" in flight.dims else flight.expand_dims("run")


def _some_runs(scenario: Scenario, at: Array) -> Scenario:
    """The scenario of some runs; each block of them has a stream of camera noise of its own."""
    changes: dict[str, Any] = {}
    for name in ("q", "qd", "tau", "force", "moment", "bend_moment", "tip_wrench"):
        value = getattr(scenario, name)
        if callable(value):
            changes[name] = _SomeRows(value, at)
        elif np.ndim(value) == 2 and len(value) > 1:
            changes[name] = value[at]
    controller, target = scenario.controller, scenario.target
    if controller is not None and controller.runs not in (None, 1):
        gains = {name: np.asarray(value)[at] for name, value in controller.gains.items()}
        changes["controller"] = Controller(
            controller.name, controller.law, gains, controller.looks, runs=len(at)
        )
    if isinstance(target, (list, tuple)) and len(target) > 1:
        changes["target"] = [target[run] for run in at]
    if at[0] > 0:
        seed = np.random.SeedSequence([scenario.seed, int(at[0])]).generate_state(1)[0]
        changes["seed"] = int(seed)
    return scenario.replace(**changes)


class _SomeRows:
    """A function of time that returns some of the rows of another."""

    def __init__(self, function: Any, at: Array) -> None:
        self.function, self.at = function, at

    def __call__(self, t: float) -> Array:
        rows = np.asarray(self.function(t))
        return rows[self.at] if rows.ndim == 2 and len(rows) > 1 else rows


def _reduced(flights: list[xr.Dataset], settle: float) -> Reduced:
    """Metrics of each flight against the first; NaN where a flight has not ended well."""
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
    end_time = np.stack([flight["end_time"].to_numpy() for flight in flights], axis=-1)
    return Reduced(metrics, np.stack(poses, axis=1), status, end_time)


def _metrics(reference: xr.Dataset, flight: xr.Dataset, settle: float) -> dict[str, Array]:
    if flight is reference:
        found = {name: np.zeros(flight.sizes["run"]) for name in DEVIATIONS}
    else:
        found = {name: compare(reference, flight)[name] for name in DEVIATIONS}
    if "feature_error" in flight:
        late = flight["time"].to_numpy() >= settle
        error = flight["feature_error"].to_numpy()[:, late]
        other = reference["feature_error"].to_numpy()[:, late]
        found["rms_px"] = np.sqrt(np.mean(error**2, axis=(1, 2)))
        found["max_px"] = np.abs(error).max(axis=(1, 2))
        gap = np.linalg.norm(error, axis=-1) - np.linalg.norm(other, axis=-1)
        found["ds_max_px"] = np.abs(gap).max(axis=1)
    return found
