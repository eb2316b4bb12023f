"""`simulate`: vehicle, scenario, model -> trajectory."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.errors import InputError, nearest, shown
from continuair.flight.adaptive import checked_record, record
from continuair.flight.cohorts import Flight
from continuair.flight.limits import warn_of_limits, with_limited_command
from continuair.flight.prepare import check_scenario, checked_tolerance, prepare
from continuair.flight.resolution import (
    warn_of_coarse_steps,
    warn_of_rounded_places,
    warn_of_saturation,
)
from continuair.flight.resolving import POSE, record_resolved
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
    integrator: str = "rk4",
    tolerance: float = 1e-9,
    rtol: float = 1e-4,
    atol: float | None = None,
    max_step: float = np.inf,
    check: bool = False,
    dtype: str = "float64",
    device: str = "cpu",
    threads: int | None = None,
) -> xr.Dataset:
    """Roll out one model of a vehicle through a scenario, one run or a batch.

    model: "coupled", "decoupled" (the paper's: UAV-arm blocks of M and C zero) or "independent".
    step: seconds, one number or one per run, or "auto": every run's own, of whose fastest rate,
    stiffest mode with its damping or initial motion, it makes 0.2, and at most `sample`. duration:
    seconds, the scenario's by default. sample: seconds between logged samples, the last interval
    shorter if need be; steps end at samples. variables: names to keep, all by default. integrator:
    "rk4"; "implicit", of second order, for arms of several sections whose stiffest modes make RK4's
    steps short: its automatic step makes 0.05 of the arms' first modes and the initial motion; or
    "dop853" with relative `tolerance` (single runs, float64; `step` then only times the end of a
    run that ends early). dtype: "float64" or "float32", which rounds places to 6e-8 of their
    distance from the origin. device: "cpu" or a CUDA device. threads: CPU threads for a batch.
    Returns a Dataset over time (and run, for a batch) with `status`,
    `end_time` and `step_error` per run, and for a batch `step` and the coordinate `batch_row`; the
    variables, their axes and units are in its attributes. step_error estimates the largest error of
    the tip that the step makes, in arm lengths: above 1e-3 it warns, but at an automatic step flies
    that run again at half the step first; attribute `flown_again` counts those runs, each of which
    costs six flights instead of one, as what halving changes is measured, and up to twelve where
    errors multiply, as in a loop around a camera. Rotors add
    largest_saturation, the most that one was asked for beyond its limits, of which it warns too.
    Raises InputError.
    """
    checks.choice("model", model, MODELS)
    names = _checked_names(vehicle, scenario, variables)
    _check_integrator(scenario, integrator, tolerance, dtype)
    if dtype == "float32":
        warn_of_rounded_places(np.asarray(scenario.q)[..., :3], vehicle.reach, stacklevel=3)
    chosen = None
    if integrator == TSIT5:
        chosen = checked_tolerance(rtol, atol, max_step, dtype)
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
        integrator=integrator,
    )
    if flight.counted:
        return _fly_controlled(flight, model, names, dtype, checks.flag("check", check))
    if flight.adaptive:
        return _fly_adaptive(flight, model, names, tolerance)
    kept = with_limited_command(names, scenario)
    if scenario.controller is None:
        kept = tuple(dict.fromkeys((*kept, *POSE)))
    recorder = Recorder(flight, model, kept, dtype)
    flown_again = record_resolved(recorder)
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


def _fly_adaptive(flight: Flight, model: str, names: tuple[str, ...], tolerance: float) -> Any:
    """The trajectory by the reference integrator, one run."""
    if flight.runs > 1:
        raise InputError(
            f"integrator is 'dop853', but there are {flight.runs} runs; give one run, or "
            "use integrator='rk4'."
        )
    # SciPy's integrators are slow to import, and few runs need them.
    from continuair.flight.dop853 import integrate_reference

    cohort = next(flight.cohorts())
    recorder = Recorder(flight, model, names, "float64")
    recorder.keep(cohort, integrate_reference(flight, flight.engine(model), cohort, tolerance))
    warn_of_saturation(recorder.saturation, stacklevel=4)
    return recorder.dataset({"step": "adaptive", "tolerance": tolerance})


def _check_integrator(scenario: Any, integrator: Any, tolerance: Any, dtype: Any) -> None:
    """Raise InputError unless an integrator flies the scenario in this precision."""
    checks.choice("integrator", integrator, (*INTEGRATORS, TSIT5, "dop853"))
    checks.choice("dtype", dtype, ("float64", "float32"))
    checks.positive("tolerance", tolerance)
    if integrator != "dop853":
        return
    if dtype != "float64":
        raise InputError(f"dtype is {shown(dtype)}, but integrator='dop853' needs 'float64'.")
    if tolerance < _FINEST_TOLERANCE:
        raise InputError(
            f"tolerance is {shown(tolerance)}, finer than float64 can hold; give "
            f"{_FINEST_TOLERANCE:g} or more."
        )
    if scenario.controller is not None:
        raise InputError(
            "integrator is 'dop853', but a controller closes the loop; use integrator='rk4'."
        )


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
        if name in OF_ROTORS and name not in default_variables(vehicle, scenario):
            raise InputError(
                f"variables holds {name}, which needs [uav.rotors]"
                f"{' with a radius' * (name == 'rotor_power')} in the vehicle; give that, or leave "
                "it out."
            )
    return names
