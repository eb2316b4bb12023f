"""`simulate`: vehicle, scenario, model -> trajectory."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np
import xarray as xr

from continuair import checks
from continuair.engine.adaptive import Tolerance
from continuair.errors import InputError, nearest, shown
from continuair.flight.called import record_called
from continuair.flight.limits import (
    warn_of_limits,
    warn_of_side_forces,
    watch_limits,
    watch_side_forces,
)
from continuair.flight.prepare import (
    DEFAULT_TOLERANCE,
    check_scenario,
    prepare,
    step_for,
    tolerance_for,
)
from continuair.flight.resolution import (
    warn_of_errors,
    warn_of_rounded_places,
    warn_of_saturation,
)
from continuair.flight.rollout import record, working_bytes
from continuair.flight.trajectory import (
    NEEDS,
    OF_SECTION,
    OF_STRAIN,
    VARIABLES,
    WATCHED_VARIABLES,
    Recorder,
    default_variables,
)
from continuair.kernels.dynamics import MODELS
from continuair.kernels.integrators import INTEGRATORS, TSIT5
from continuair.memory import check_memory
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array, Method, Model
from continuair.vehicle.layout import OF_ARM
from continuair.vehicle.vehicle import Vehicle, check_vehicle


def simulate(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    model: Model = "coupled",
    method: Method = "Tsit5",
    rtol: float = DEFAULT_TOLERANCE,
    atol: float | None = None,
    max_step: float = np.inf,
    step: float | Literal["auto"] | Array | None = None,
    check: bool = False,
    duration: float | None = None,
    sample: float = 1e-3,
    variables: Iterable[str] | None = None,
    dtype: Literal["float64", "float32"] = "float64",
    device: str = "cpu",
    threads: int | None = None,
    **others: object,
) -> xr.Dataset:
    """Simulate one model of a vehicle in a scenario, one run or a batch.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.
    scenario : Scenario
        Start, inputs and duration. One with a `force_callback` uses RK4.
    model : {"coupled", "decoupled", "independent"}, default "coupled"
        "decoupled" is the paper's: the UAV-arm blocks of M and C are zero.
    method : {"Tsit5", "RK4", "implicit"}, default "Tsit5"
        "Tsit5" is an embedded pair of order 5(4) with adaptive steps of each run's own. "RK4" and
        "implicit" (order 2, for stiff arms of several sections) use steps of one length.
    rtol, atol : float, optional
        "Tsit5" keeps the error of a step in every component below `rtol` times its natural unit:
        an arm length, 1 rad, and these per √(length / 9.81 m/s²). With `atol` the bound is
        ``atol * unit + rtol * abs(component)``.
    max_step : float, optional
        Longest step of "Tsit5" [s].
    step : float, array_like of shape (runs,), or "auto", optional
        Step of "RK4" and "implicit" [s], which need it. "auto": ``min(sample, 0.2 / fastest_rate)``
        for each run; for "implicit", 0.05 over the rate of the first mode. Rates are those at the
        start; use `check` for later ones.
    check : bool, optional
        Simulate a second time and add `error_estimate`: at a tenth of the tolerance, a hundredth
        with contact or tendons that rub or can be slack, with steps of at most half a control
        period; or at half the step.
    duration : float, optional
        Duration [s]. Default: the scenario's.
    sample : float, optional
        Time between samples [s]; the last interval may be shorter.
    variables : iterable of str, optional
        Names of variables to keep. Default: all except `q`.
    dtype : {"float64", "float32"}, default "float64"
        Single precision rounds positions to 6e-8 of their distance from the origin.
    device : str, optional
        "cpu" or a CUDA device.
    threads : int, optional
        CPU threads of a batch. Default: all.
    **others : object
        None; older names of arguments are reported.

    Returns
    -------
    xarray.Dataset
        Variables over time (and run, for a batch), with axes and units in their attributes, and
        per run `status`, `end_time` [s] and, with rotors or tendons, `largest_saturation`: the
        largest command beyond their limits, in parts of their range. "Tsit5" adds `steps`,
        `steps_rejected` and `evaluations`, the others `step`. `check` adds `error_estimate`: the
        largest distance of a tip from that of the second simulation, in arm lengths.

    Raises
    ------
    InputError
        If an argument cannot be used.
    """
    checks.renamed("simulate", others, integrator="method", tolerance="rtol")
    checks.choice("model", model, MODELS)
    names = _checked_names(vehicle, scenario, variables)
    checks.choice("method", method, (TSIT5, *INTEGRATORS))
    checks.choice("dtype", dtype, ("float64", "float32"))
    if dtype == "float32":
        places, reach = np.asarray(scenario.q)[..., :3], np.asarray(vehicle.reach)
        warn_of_rounded_places(places, reach, stacklevel=3)
    tolerance = tolerance_for(method, rtol, atol, max_step, dtype)
    checked = checks.flag("check", check)
    if scenario.force_callback is not None:
        _check_called(method, tolerance, checked)
        tolerance, method, step = None, "RK4", "auto" if step is None else step
    flight = prepare(
        vehicle,
        scenario,
        tolerance=tolerance,
        step=step_for(method, step),
        sample=sample,
        duration=duration,
        device=device,
        threads=threads,
        stacklevel=3,
        method=method,
        with_callback=True,
        strain=True,
    )
    recorder = Recorder(flight, model, names, dtype)
    check_memory(recorder.needed(), working_bytes(recorder, checked))
    limits, aside = watch_limits(recorder), watch_side_forces(recorder)
    if scenario.force_callback is not None:
        record_called(recorder, stacklevel=3)
    else:
        record(recorder, check=checked)
    if recorder.error_estimate is not None:
        warn_of_errors(recorder.error_estimate, stacklevel=3)
    warn_of_saturation(vehicle, recorder.saturation, stacklevel=3)
    warn_of_limits(limits, stacklevel=3)
    warn_of_side_forces(aside, stacklevel=3)
    return recorder.dataset(recorder.step)


def _check_called(method: Method, tolerance: Tolerance | None, check: bool) -> None:
    """Raise InputError for options that are not supported with a force_callback, which uses RK4."""
    if method == "implicit" or tolerance not in (None, tolerance_for("Tsit5")):
        raise InputError(
            "force_callback",
            "of the scenario needs RK4",
            "omit method, rtol, atol and max_step, or write the force as a continuair.Term",
        )
    if check:
        raise InputError(
            "check",
            "is True, but the scenario has a force_callback, which does not support it",
            "omit check, or write the force as a continuair.Term",
        )


def _checked_names(
    vehicle: Vehicle, scenario: Scenario, variables: Iterable[str] | None
) -> tuple[str, ...]:
    """Return the variables to keep, which vehicle and scenario must have."""
    check_vehicle(vehicle)
    check_scenario(scenario)
    if variables is None:
        return default_variables(vehicle, scenario)
    try:
        names = () if isinstance(variables, str) else tuple(variables)
    except TypeError:
        names = ()
    if not names:
        raise InputError("variables", f"is {shown(variables)}", "give a list of names")
    others, fitting = OF_STRAIN, OF_SECTION
    if vehicle.layout.strains:
        others, fitting = fitting, others
    looking = scenario.controller is not None and bool(scenario.targets)
    for name in names:
        if not isinstance(name, str) or name not in VARIABLES:
            raise InputError("variables", f"has {shown(name)}", nearest(str(name), VARIABLES))
        if name in WATCHED_VARIABLES and not looking:
            raise InputError(
                "variables",
                f"has {name}, which needs a scenario with a controller and a target",
                "give both, or omit it",
            )
        if name in others and vehicle.arms:
            raise InputError(
                "variables",
                f"has {name}, which does not describe the sections of this vehicle",
                f"give {fitting[others.index(name)]}",
            )
        if name in (*OF_ARM, *OF_SECTION, *OF_STRAIN) and not vehicle.arms:
            raise InputError(
                "variables",
                f"has {name}, but vehicle {shown(vehicle.name)} has no arm",
                "omit it, or give the vehicle a table [arm]",
            )
        if name in NEEDS and name not in default_variables(vehicle, scenario):
            raise InputError(
                "variables", f"has {name}, which needs {NEEDS[name]}", "give that, or omit it"
            )
    return names
