"""Batches of paired flights in memory: several models of the same runs, reduced to metrics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair import checks
from continuair.engine.pairs import ControlledPairs, Pairs
from continuair.errors import InputError, shown
from continuair.flight.adaptive import compile_models, launch_of
from continuair.flight.chunks import runs_at_once
from continuair.flight.cohorts import Flight
from continuair.flight.limits import warn_of_runs_at_limits
from continuair.flight.prepare import DEFAULT_TOLERANCE, prepare, step_for, tolerance_for
from continuair.flight.resolution import (
    warn_of_errors,
    warn_of_lost_angles,
    warn_of_overstated_angles,
    warn_of_saturation,
)
from continuair.flight.signals import ticks_of
from continuair.flight.trajectory import COUNTED, ERROR_ESTIMATE, LARGEST_SATURATION
from continuair.kernels.adaptive import SATURATION
from continuair.kernels.dynamics import MODELS, REFERENCE, SIMPLER
from continuair.kernels.integrators import INTEGRATORS, TSIT5
from continuair.kernels.step import STATUS
from continuair.scenario.scenarios import Scenario
from continuair.sweeps.closed_pairs import Reduced, track
from continuair.typing import Array, Method, Model
from continuair.vehicle.layout import DEVIATIONS, EULER_DEVIATIONS
from continuair.vehicle.runs import per_run, varying
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_vehicle

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
"""Metric -> (units, meaning); the last three need a closed loop with a target."""


def run_pairs(
    vehicle: Vehicle,
    scenario: Scenario,
    models: Sequence[Model] = ("decoupled",),
    *,
    method: Method = "Tsit5",
    rtol: float = DEFAULT_TOLERANCE,
    atol: float | None = None,
    max_step: float = np.inf,
    step: float | Literal["auto"] | Array | None = None,
    check: bool = False,
    sample: float = 1e-3,
    duration: float | None = None,
    settle: float = 0.0,
    device: str = "cpu",
    threads: int | None = None,
    **others: object,
) -> xr.Dataset:
    """Simulate models of many runs beside the coupled one, and return metrics.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with arms, or a batch.
    scenario : Scenario
        One scenario, or a batch. Inputs may be functions of time that return a row per run.
    models : sequence of str, optional
        Models that are compared with "coupled".
    method : {"Tsit5", "RK4", "implicit"}, default "Tsit5"
        As in `simulate`.
    rtol, atol, max_step : float, optional
        As in `simulate`.
    step : float, array_like of shape (runs,), or "auto", optional
        As in `simulate`.
    check : bool, optional
        As in `simulate`; with "Tsit5" only.
    sample : float, optional
        Time between the samples that are compared [s].
    duration : float, optional
        Duration [s]. Default: the scenario's.
    settle : float, optional
        Time at the start that metrics in pixels exclude, and without a target those of the tip [s].
        Needs a controller.
    device : str, optional
        "cpu" or a CUDA device.
    threads : int, optional
        CPU threads. Default: all.
    **others : object
        None; older names of arguments are reported.

    Returns
    -------
    xarray.Dataset
        Over (run, model), "coupled" first, with the vehicle's varying fields as coordinates:

        * ``nrmse_t``, ``nrmse_r``, ``rmse_t_m``, ``rmse_r_rad`` and ``angle_rad`` of `compare`,
          against the coupled run (0 for itself);
        * with a target, ``rms_px``, ``max_px``, and ``ds_max_px`` (of the norm of the feature
          error, against the coupled run); NaN if a point is behind the camera at a sample;
        * ``tip_position`` and ``tip_attitude`` at the end;
        * ``status`` (0: ok; its attributes explain the codes), ``end_time`` [s] and, with rotors,
          ``largest_saturation``;
        * ``steps``, ``steps_rejected``, ``evaluations`` and, with `check`, ``error_estimate``; or
          ``step`` [s]. As in `simulate`.

    Raises
    ------
    InputError
        If an argument cannot be used.

    Notes
    -----
    Metrics are NaN for a run with a status other than 0, or whose coupled run has one. ``nrmse_r``
    and ``rmse_r_rad`` are NaN, with a warning, if samples do not determine the Euler angles of the
    tip. Results do not depend on the batch that a run was in.
    """
    checks.renamed("run_pairs", others, integrator="method")
    check_has_arms(check_vehicle(vehicle))
    names = _checked_models(models)
    checks.choice("method", method, (TSIT5, *INTEGRATORS))
    tolerance = tolerance_for(method, rtol, atol, max_step)
    if checks.flag("check", check) and tolerance is None:
        raise InputError(
            "check",
            f"is True, but method is {shown(method)}",
            f"give method='{TSIT5}', or use simulate",
        )
    flight = prepare(
        vehicle,
        scenario,
        step=step_for(method, step),
        sample=sample,
        duration=duration,
        device=device,
        threads=threads,
        stacklevel=3,
        method=method,
        tolerance=tolerance,
        strain=True,
    )
    found = _fly(flight, names, _checked_settle(settle, flight), check)
    if check:
        warn_of_errors(found.error_estimate, stacklevel=3)
    warn_of_saturation(vehicle, found.saturation, stacklevel=3)
    warn_of_runs_at_limits(found.at_limits, scenario, stacklevel=3)
    lost = lost_angles(found.metrics["nrmse_r"], found.status)
    warn_of_lost_angles(lost, flight.sample, stacklevel=3)
    euler, angle = found.metrics["rmse_r_rad"], found.metrics["angle_rad"]
    warn_of_overstated_angles(euler, angle, stacklevel=3)
    data = _variables(found)
    if vehicle.limited:
        data["largest_saturation"] = (("run", "model"), found.saturation, LARGEST_SATURATION)
    if found.counts is None:
        data["step"] = ("run", flight.steps, {"units": "s", "long_name": "integration step"})
    else:
        for column, (name, (_, meaning)) in enumerate(COUNTED.items()):
            counted = found.counts[..., column].astype(int)
            data[name] = (("run", "model"), counted, {"units": "1", "long_name": meaning})
    if check:
        data["error_estimate"] = (("run", "model"), found.error_estimate, ERROR_ESTIMATE)
    coordinates: dict[str, Any] = {"run": np.arange(flight.runs), "model": list(names)}
    coordinates |= {name: ("run", values) for name, values in varying(vehicle).items()}
    coordinates |= {"axis": list("xyz"), "quaternion": list("xyzw")}
    return xr.Dataset(data, coordinates)


def check_pairs(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    method: Method,
    rtol: float,
    step: float | str | None,
    sample: float,
    settle: float,
    device: str,
) -> None:
    """Raise InputError for arguments that `run_pairs` would refuse, without a simulation."""
    flight = prepare(
        vehicle,
        scenario,
        step=step_for(method, step),
        sample=sample,
        device=device,
        threads=1,
        method=method,
        tolerance=tolerance_for(method, rtol),
        strain=True,
    )
    _checked_settle(settle, flight)


def lost_angles(metric: Array, status: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Return which runs (runs,) have a model whose Euler angles samples do not determine.

    metric: one of Euler angles, NaN then; status: both (runs, models).
    """
    well = (status == 0) & (status[:, :1] == 0)
    return np.asarray((np.isnan(metric) & well).any(axis=1))


def _fly(flight: Flight, models: tuple[str, ...], settle: float, check: bool) -> Reduced:
    """Simulate all runs."""
    if flight.scenario.controller is not None:
        compile_models(flight, models)
        found = track(flight, models, settle, check)
    elif flight.counted:
        found = _fly_controlled(flight, models, check)
    else:
        found = _fly_open(flight, models)
    spin = flight.start.states[:, flight.coupled.layout.angular_velocity]
    # Full revolutions between samples are invisible in attitudes.
    lost = np.linalg.norm(spin, axis=1) * flight.sample > np.pi
    for name in EULER_DEVIATIONS:
        found.metrics[name][lost, 1:] = np.nan
    return found


def _fly_open(flight: Flight, models: tuple[str, ...]) -> Reduced:
    """Simulate all runs without a controller, in steps of one length."""
    pairs = Pairs([flight.engine(model) for model in models], flight.runs)
    end_time = np.zeros((flight.runs, len(models)))
    for cohort in flight.parts():
        runs, grid = cohort.runs, cohort.grid
        pairs.fly(runs, cohort.start, grid, cohort.drive)
        end_time[runs] = np.append(grid.starts, grid.samples[-1])[pairs.last_step[runs]]
    metrics = {name: pairs.deviations[..., i] for i, name in enumerate(DEVIATIONS)}
    unknown, free = np.full(pairs.status.shape, np.nan), np.zeros(pairs.status.shape)
    return Reduced(metrics, pairs.tip, pairs.status, end_time, unknown, pairs.saturation, free)


def _fly_controlled(flight: Flight, models: tuple[str, ...], check: bool) -> Reduced:
    """Simulate all runs without a controller, in steps controlled by their errors."""
    assert flight.tolerance is not None
    pairs = ControlledPairs([flight.engine(model) for model in models], flight.runs)
    ticks = ticks_of(flight.scenario, flight.duration, flight.marks.samples)
    finer = flight.finer().tolerance if check else None
    size = runs_at_once(flight, flight.coupled, signals_alone=True)
    for first in range(0, flight.runs, size):
        runs = np.arange(first, min(first + size, flight.runs))
        pairs.fly_controlled(launch_of(flight, runs, ticks, flight.tolerance), finer)
    metrics = {name: pairs.deviations[..., i] for i, name in enumerate(DEVIATIONS)}
    reach = per_run(flight.vehicle.reach, flight.runs)[:, None]
    return Reduced(
        metrics,
        pairs.tip,
        pairs.status,
        pairs.end_time,
        pairs.distance / reach,
        pairs.counts[..., SATURATION],
        np.zeros(pairs.status.shape),
        pairs.counts,
    )


def _variables(found: Reduced) -> dict[str, Any]:
    """Return the variables of a result over (run, model), with their units."""
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


def _checked_models(models: Sequence[Model]) -> tuple[Model, ...]:
    """Return the models to simulate, the reference first."""
    listed = isinstance(models, Sequence) and not isinstance(models, str)
    if not listed or any(name not in MODELS for name in models):
        raise InputError("models", f"is {shown(models)}", f"give a list of {', '.join(SIMPLER)}")
    return (REFERENCE, *(name for name in dict.fromkeys(models) if name != REFERENCE))


def _checked_settle(settle: float, flight: Flight) -> float:
    """Return a valid settling time [s], or raise InputError."""
    if not checks.is_number(settle) or not 0.0 <= settle < flight.duration:
        raise InputError(
            "settle",
            f"is {shown(settle)}",
            f"give a time from 0 to below the duration {flight.duration:g} s",
        )
    if settle and flight.scenario.controller is None:
        raise InputError(
            "settle",
            f"is {shown(settle)}, but the scenario has no controller",
            "omit it, or use `compare` from that time on",
        )
    return float(settle)
