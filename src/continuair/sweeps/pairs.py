"""Batches of paired flights in memory: several models of the same runs, reduced to metrics."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from continuair.engine.engine import Engine, check_device
from continuair.engine.pairs import Flight, Pairs
from continuair.errors import ContinuairWarning, InputError, shown
from continuair.flight.simulate import MODELS
from continuair.flight.steps import STEP_PHASE, fastest_frequency
from continuair.flight.time_grid import groups_in_use, make_grid, sample_inputs, stage_times
from continuair.kernels.deviations import DEVIATIONS
from continuair.kernels.step import STATUS
from continuair.scenario.scenarios import Scenario
from continuair.sweeps.closed_pairs import Reduced, track
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.vehicle import Vehicle

REFERENCE = "coupled"
"""The model that the others are compared with."""

LARGEST_STEP = 1e-3
"""The automatic step is at most this [s]."""

METRICS: dict[str, tuple[str, str]] = {
    "nrmse_t": ("1", "NRMSE of the tip's position, as the paper prints it"),
    "nrmse_r": ("1", "NRMSE of the tip's Euler angles, as the paper prints it"),
    "rmse_t_m": ("m", "RMSE of the tip's position"),
    "rmse_r_rad": ("rad", "RMSE of the tip's Euler angles"),
    "angle_rad": ("rad", "RMS of the angle between the tips"),
    "rms_px": ("px", "RMS of the feature error over coordinates and samples"),
    "max_px": ("px", "largest feature error of a coordinate"),
    "ds_max_px": ("px", "largest difference of the feature error's norm from that of the first"),
}
"""Metric -> (units, meaning); the last three are those of a closed loop with a target."""

Array = np.ndarray


def run_pairs(
    vehicle: Vehicle,
    scenario: Scenario,
    models: Sequence[str] = ("decoupled",),
    *,
    step: float | str = "auto",
    sample: float = 1e-3,
    duration: float | None = None,
    settle: float = 0.0,
    device: str = "cpu",
    threads: int | None = None,
) -> xr.Dataset:
    """Fly models of many runs beside the coupled one, and return metrics, not trajectories.

    vehicle, scenario: plain, or batched over runs as for `continuair.simulate`; inputs may be
    functions of time that return a row per run. models: those compared with "coupled".
    step: seconds, or "auto": for every run its own, ω_max h <= 0.2 and at most 1 ms, so that no
    result depends on the batch it was in. sample: seconds between the samples that are compared.
    duration: seconds, the scenario's by default. settle: seconds at the start that the metrics in
    pixels leave out. device: "cpu" or a CUDA device. threads: CPU threads, all by default.

    Returns a Dataset over (run, model), "coupled" first: the metrics of `continuair.compare`
    nrmse_t, nrmse_r, rmse_t_m, rmse_r_rad, angle_rad against the coupled run (0 for itself); with
    a controller that looks at a target also rms_px, max_px and ds_max_px (of the norm of the
    feature error, against the coupled run's); tip_position and tip_attitude at the end; status
    (0: ok; the meanings are in its attributes), end_time [s] and step [s]. A run of a status other
    than 0, or beside such a coupled run, has NaN metrics. Raises InputError.
    """
    names = _checked(vehicle, scenario, models, step, sample, duration, settle)
    check_device(device)
    duration = scenario.duration if duration is None else float(duration)
    coupled = Engine(vehicle, REFERENCE, device=device, threads=threads)
    runs = _runs(vehicle, scenario, coupled)
    # Steps divide the time between samples or, closed loops', between the controller's instants.
    whole = sample if scenario.controller is None else scenario.control_period or sample
    pieces = _pieces(coupled, scenario, runs, step, whole)
    if scenario.controller is not None:
        options = {"duration": duration, "sample": sample, "device": device, "threads": threads}
        found = track(vehicle, scenario, names, whole / pieces, settle, **options)
    else:
        on: dict[str, Any] = {"device": device, "threads": threads, "beside": coupled}
        engines = [coupled, *(Engine(vehicle, name, **on) for name in names[1:])]
        found = _fly(engines, scenario, pieces, sample, duration)
    data = _variables(found)
    data["step"] = ("run", whole / pieces, {"units": "s", "long_name": "integration step"})
    return xr.Dataset(data, {"model": list(names), "axis": list("xyz"), "quaternion": list("xyzw")})


def _fly(
    engines: list[Engine], scenario: Scenario, pieces: Array, sample: float, duration: float
) -> Reduced:
    """Fly in open loop: the runs of one step together."""
    runs, layout = len(pieces), engines[0].layout
    q, qd = (np.broadcast_to(rows, (runs, 8)) for rows in (scenario.q, scenario.qd))
    start, groups = state_from_paper(q, qd), groups_in_use(scenario)
    pairs, end_time = Pairs(engines, runs), np.zeros((runs, len(engines)))
    for count in np.unique(pieces):
        at = np.flatnonzero(pieces == count)
        grid = make_grid(duration, sample / count, sample, scenario.jumps)
        table, stride = sample_inputs(scenario, stage_times(grid), layout)
        if table.shape[1] > 1 and len(at) < runs:
            table = table[:, at]
        flight = Flight(at, grid, (table, stride))
        pairs.fly(flight, start, q[:, -1], scenario.gravity, groups)
        end_time[at] = np.append(grid.starts, grid.samples[-1])[pairs.last_step[at]]
    metrics = {name: pairs.deviations[..., i] for i, name in enumerate(DEVIATIONS)}
    return Reduced(metrics, pairs.tip, pairs.status, end_time)


def _variables(found: Reduced) -> dict[str, Any]:
    """Variables of a result over (run, model), with their units."""
    dims = ("run", "model")
    data: dict[str, Any] = {}
    for name, values in found.metrics.items():
        units, meaning = METRICS[name]
        data[name] = (dims, values, {"units": units, "long_name": meaning})
    where = {"units": "m", "long_name": "tip of the arm at the end, world axes"}
    turn = {"units": "1", "long_name": "untwisted tip frame at the end to world, x y z w"}
    codes = ", ".join(f"{code} {text}" for code, text in STATUS.items())
    data["tip_position"] = ((*dims, "axis"), found.tip[..., :3], where)
    data["tip_attitude"] = ((*dims, "quaternion"), found.tip[..., 3:], turn)
    data["status"] = (
        dims,
        found.status.astype(np.int8),
        {"long_name": f"how the run ended: {codes}"},
    )
    until = {"units": "s", "long_name": "time up to which the run is valid"}
    data["end_time"] = (dims, found.end_time, until)
    return data


def _runs(vehicle: Vehicle, scenario: Scenario, engine: Engine) -> int:
    """The number of runs of a batch, all parts of which agree on it."""
    table, _ = sample_inputs(scenario, np.zeros(1), engine.layout)
    listed = isinstance(scenario.target, (list, tuple))
    sizes = {
        "vehicle": vehicle.runs,
        "scenario": scenario.runs,
        "the scenario's inputs": table.shape[1],
        "scenario.controller": scenario.controller.runs if scenario.controller else None,
        "scenario.target": len(scenario.targets) if listed else None,
    }
    runs = max(size or 1 for size in sizes.values())
    for name, size in sizes.items():
        if size not in (None, 1, runs):
            raise InputError(
                f"{name} holds {size} runs, but the batch has {runs}; give every array one row "
                "per run, or a single row."
            )
    return runs


def _pieces(engine: Engine, scenario: Scenario, runs: int, step: Any, whole: float) -> Array:
    """Steps in a whole time [s] (runs,), from the step asked for or each run's stiffness."""
    q = np.atleast_2d(np.asarray(scenario.q, float))
    straight = np.array(q)
    straight[:, 6::2] = 0.0
    fastest = np.fmax(*(fastest_frequency(engine, at) for at in (straight, q)))
    # A run that starts bent past a full circle has no frequency; it ends with a status.
    fine = STEP_PHASE / np.broadcast_to(np.nan_to_num(fastest, nan=1.0), runs)
    largest = np.minimum(fine, LARGEST_STEP) if isinstance(step, str) else np.full(runs, step)
    needed = np.ceil(whole / largest * (1.0 - 1e-9)).astype(int)
    if isinstance(step, str):
        return _few_values(needed)
    coarse = largest > fine * (1.0 + 1e-9)
    if coarse.any():
        warnings.warn(
            f"step is {step:g} s, which is too coarse for the stiffest bending mode of "
            f"{coarse.sum()} of {runs} runs: RK4 will damp it; use {fine.min():.3g} s or less, or "
            "step='auto'.",
            ContinuairWarning,
            stacklevel=3,
        )
    return needed


def _few_values(needed: Array) -> Array:
    """At least as many steps, from 1 to 8, 10, 12, 14, 16, 20, …: runs of one step fly together."""
    grain = 2 ** np.maximum(np.floor(np.log2(needed)).astype(int) - 2, 0)
    return -(-needed // grain) * grain


def _checked(
    vehicle: Any, scenario: Any, models: Any, step: Any, sample: Any, duration: Any, settle: Any
) -> tuple[str, ...]:
    """Validate the options; return the models to fly, the reference first."""
    if not isinstance(vehicle, Vehicle):
        raise InputError(f"vehicle is {shown(vehicle)}; load one with continuair.load_vehicle.")
    if not isinstance(scenario, Scenario):
        raise InputError(f"scenario is {shown(scenario)}; give a continuair.Scenario.")
    known = [name for name in MODELS if name != REFERENCE]
    if isinstance(models, str) or any(name not in MODELS for name in models):
        raise InputError(f"models is {shown(models)}; give a list of {', '.join(known)}.")
    positive = {"sample": sample, "duration": scenario.duration if duration is None else duration}
    if step != "auto":
        positive["step"] = step
    for name, value in positive.items():
        if not _number(value) or not 0.0 < value < np.inf:
            remedy = " or 'auto'" if name == "step" else ""
            raise InputError(f"{name} is {shown(value)}; give a finite number above 0{remedy} [s].")
    if not _number(settle) or not 0.0 <= settle < positive["duration"]:
        raise InputError(
            f"settle is {shown(settle)}; give a time from 0 to below the duration "
            f"{positive['duration']:g} s."
        )
    return (REFERENCE, *(name for name in dict.fromkeys(models) if name != REFERENCE))


def _number(value: Any) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
