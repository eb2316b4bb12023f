"""`simulate`: vehicle, scenario, model -> trajectory."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.errors import InputError, nearest, shown
from continuair.flight.adaptive import checked_record, record
from continuair.flight.called import record_called
from continuair.flight.cohorts import Flight
from continuair.flight.limits import warn_of_limits, with_limited_command
from continuair.flight.prepare import DEFAULT_TOLERANCE, check_scenario, prepare, tolerance_for
from continuair.flight.resolution import (
    warn_of_coarse_steps,
    warn_of_rounded_places,
    warn_of_saturation,
)
from continuair.flight.resolving import POSE, error_of_steps, record_resolved
from continuair.flight.trajectory import (
    OF_ROTORS,
    VARIABLES,
    WATCHED_VARIABLES,
    Recorder,
    default_variables,
)
from continuair.kernels.dynamics import MODELS
from continuair.kernels.integrators import INTEGRATORS, TSIT5
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle, check_vehicle

Array = np.ndarray

_FINEST_TOLERANCE = 1e-13
"""Relative tolerance below which rounding errors of float64 would steer DOP853's steps."""


def simulate(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    model: str = "coupled",
    step: float | str | Array = "auto",
    duration: float | None = None,
    sample: float = 1e-3,
    variables: Iterable[str] | None = None,
    method: str = "RK4",
    tolerance: float = 1e-9,
    rtol: float = DEFAULT_TOLERANCE,
    atol: float | None = None,
    max_step: float = np.inf,
    check: bool = False,
    dtype: str = "float64",
    device: str = "cpu",
    threads: int | None = None,
    **others: Any,
) -> xr.Dataset:
    """Simulate one model of a vehicle in a scenario, one run or a batch.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.
    scenario : Scenario
        Start, inputs and duration.
    model : {"coupled", "decoupled", "independent"}
        "decoupled" is the paper's: the UAV-arm blocks of M and C are zero.
    method : {"RK4", "Tsit5", "implicit", "DOP853"}
        "Tsit5" is an embedded pair of order 5(4) with steps of each run's own, controlled by their
        error. "RK4" and "implicit" (order 2, for stiff arms of several sections) take steps of one
        length. "DOP853" is SciPy's, for single runs.
    rtol, atol : float, optional
        "Tsit5" keeps the error of a step in every component below `rtol` times its natural unit:
        an arm length, 1 rad, and these per √(length / gravity). With `atol` the bound is
        ``atol * unit + rtol * abs(component)``.
    max_step : float, optional
        Longest step of "Tsit5" [s].
    check : bool, optional
        Fly a second time, at a tenth of the tolerance with steps of at most half a control period,
        or at half the step, and add `error_estimate`.
    step : float, array_like of shape (runs,), or "auto", optional
        Step of "RK4" and "implicit" [s]. "auto" is 0.2 over the fastest rate of vehicle and start
        (0.05 over the first mode's, "implicit"), at most `sample`; runs that these steps do not
        resolve are flown again at half the step.
    duration : float, optional
        The scenario's by default [s].
    sample : float, optional
        Time between samples [s]; the last interval may be shorter.
    variables : iterable of str, optional
        Names to keep; all by default.
    tolerance : float, optional
        Relative tolerance of "DOP853".
    dtype : {"float64", "float32"}
        Single precision rounds positions to 6e-8 of their distance from the origin.
    device : str
        "cpu" or a CUDA device.
    threads : int, optional
        CPU threads of a batch.

    Returns
    -------
    xarray.Dataset
        Variables over time (and run, for a batch), with axes and units in their attributes, and
        per run `status`, `end_time` [s] and, of rotors, `largest_saturation`, the largest thrust
        that was asked for beyond their limits, in parts of their range. "Tsit5" adds `steps`,
        `steps_rejected`, `evaluations`, and with `check` `error_estimate`: the largest distance of
        a tip from that of the second flight, in arm lengths. Methods with steps of one length add
        `step_error`, an estimate of the same from the steps themselves, and `step`.

    Raises
    ------
    InputError
        If an argument cannot be used.
    """
    checks.renamed("simulate", others, integrator="method")
    checks.choice("model", model, MODELS)
    names = _checked_names(vehicle, scenario, variables)
    _check_method(scenario, method, tolerance, dtype)
    if dtype == "float32":
        warn_of_rounded_places(np.asarray(scenario.q)[..., :3], vehicle.reach, stacklevel=3)
    if checks.flag("check", check) and scenario.force_callback is not None:
        raise InputError(
            "check is True, but the scenario has a force_callback, which is called for one flight; "
            "leave check out, or write the force as a continuair.Term."
        )
    chosen = tolerance_for(method, step, rtol, atol, max_step, dtype)
    flight = prepare(
        vehicle,
        scenario,
        tolerance=chosen,
        step=step,
        sample=sample,
        duration=duration,
        device=device,
        threads=threads,
        stacklevel=3,
        method=method,
        plain=scenario.force_callback is not None,
        with_callback=True,
    )
    if scenario.force_callback is not None:
        return _fly_called(flight, model, names, dtype)
    if flight.counted:
        return _fly_controlled(flight, model, names, dtype, check)
    if flight.adaptive:
        return _fly_adaptive(flight, model, names, tolerance)
    kept = with_limited_command(names, scenario)
    if scenario.controller is None or check:
        kept = tuple(dict.fromkeys((*kept, *POSE)))
    recorder = Recorder(flight, model, kept, dtype)
    flown_again = record_resolved(recorder)
    if check:
        recorder.error_estimate = error_of_steps(recorder)
    warn_of_coarse_steps(recorder.step_error, recorder.flight.steps, stacklevel=3)
    warn_of_saturation(recorder.saturation, stacklevel=3)
    warn_of_limits(recorder, stacklevel=3)
    recorder.names = names
    return recorder.dataset(recorder.step | {"flown_again": flown_again})


def _fly_controlled(
    flight: Flight,
    model: str,
    names: tuple[str, ...],
    dtype: str,
    check: bool,
) -> xr.Dataset:
    """The trajectories of runs whose steps follow from their errors."""
    kept = with_limited_command(names, flight.scenario)
    if check:
        kept = tuple(dict.fromkeys((*kept, "tip_position")))
    recorder = Recorder(flight, model, kept, dtype)
    (checked_record if check else record)(recorder)
    warn_of_saturation(recorder.saturation, stacklevel=4)
    warn_of_limits(recorder, stacklevel=4)
    recorder.names = names
    return recorder.dataset(recorder.step)


def _fly_called(flight: Flight, model: str, names: tuple[str, ...], dtype: str) -> Any:
    """The trajectory under a force_callback."""
    recorder = Recorder(flight, model, names, dtype)
    record_called(recorder, stacklevel=4)
    warn_of_saturation(recorder.saturation, stacklevel=4)
    return recorder.dataset(recorder.step)


def _fly_adaptive(flight: Flight, model: str, names: tuple[str, ...], tolerance: float) -> Any:
    """The trajectory by the reference integrator, one run."""
    if flight.runs > 1:
        raise InputError(
            f"method is 'DOP853', but there are {flight.runs} runs; give one run, or "
            "use method='RK4'."
        )
    # SciPy's integrators are slow to import, and few runs need them.
    from continuair.flight.dop853 import integrate_reference

    cohort = next(flight.cohorts())
    recorder = Recorder(flight, model, names, "float64")
    recorder.keep(cohort, integrate_reference(flight, flight.engine(model), cohort, tolerance))
    warn_of_saturation(recorder.saturation, stacklevel=4)
    return recorder.dataset({"step": "adaptive", "tolerance": tolerance})


def _check_method(scenario: Any, method: Any, tolerance: Any, dtype: Any) -> None:
    """Raise InputError unless a method flies the scenario in this precision."""
    checks.choice("method", method, (*INTEGRATORS, TSIT5, "DOP853"))
    checks.choice("dtype", dtype, ("float64", "float32"))
    checks.positive("tolerance", tolerance)
    if scenario.force_callback is not None and method != "RK4":
        raise InputError(
            f"method is {shown(method)}, but the scenario has a force_callback; use method='RK4', "
            "or write the force as a continuair.Term."
        )
    if method != "DOP853":
        return
    if dtype != "float64":
        raise InputError(f"dtype is {shown(dtype)}, but method='DOP853' needs 'float64'.")
    if tolerance < _FINEST_TOLERANCE:
        raise InputError(
            f"tolerance is {shown(tolerance)}, finer than float64 can hold; give "
            f"{_FINEST_TOLERANCE:g} or more."
        )
    if scenario.controller is not None:
        raise InputError("method is 'DOP853', but a controller closes the loop; use method='RK4'.")


def _checked_names(vehicle: Any, scenario: Any, variables: Any) -> tuple[str, ...]:
    """The variables to keep, which vehicle and scenario must have."""
    check_vehicle(vehicle)
    check_scenario(scenario)
    if variables is None:
        return default_variables(vehicle, scenario)
    try:
        names = () if isinstance(variables, str) else tuple(variables)
    except TypeError:
        names = ()
    if not names:
        raise InputError(f"variables is {shown(variables)}; give a list of names.")
    looking = scenario.controller is not None and bool(scenario.targets)
    for name in names:
        if not isinstance(name, str) or name not in VARIABLES:
            raise InputError(f"variables holds {shown(name)}; {nearest(str(name), VARIABLES)}.")
        if name in WATCHED_VARIABLES and not looking:
            raise InputError(
                f"variables holds {name}, which needs a scenario with a controller and a target; "
                "give both, or leave it out."
            )
        if name == "term_energy" and name not in default_variables(vehicle, scenario):
            raise InputError(
                "variables holds term_energy, which needs a term with an energy in the vehicle; "
                "leave it out."
            )
        if name in OF_ROTORS and name not in default_variables(vehicle, scenario):
            raise InputError(
                f"variables holds {name}, which needs [uav.rotors]"
                f"{' with a radius' * (name == 'rotor_power')} in the vehicle; give that, or leave "
                "it out."
            )
    return names
