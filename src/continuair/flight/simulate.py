"""`simulate`: vehicle, scenario, model -> trajectory."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.engine.adaptive import Tolerance
from continuair.errors import InputError, nearest, shown
from continuair.flight.called import record_called
from continuair.flight.limits import warn_of_limits, with_limited_command
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
from continuair.flight.rollout import record
from continuair.flight.trajectory import (
    OF_ROTORS,
    OF_SECTION,
    VARIABLES,
    WATCHED_VARIABLES,
    Recorder,
    default_variables,
)
from continuair.kernels.dynamics import MODELS
from continuair.kernels.integrators import INTEGRATORS, TSIT5
from continuair.memory import check_memory
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import OF_ARM
from continuair.vehicle.vehicle import Vehicle, check_vehicle

Array = np.ndarray


def simulate(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    model: str = "coupled",
    method: str = TSIT5,
    rtol: float = DEFAULT_TOLERANCE,
    atol: float | None = None,
    max_step: float = np.inf,
    step: float | str | Array | None = None,
    check: bool = False,
    duration: float | None = None,
    sample: float = 1e-3,
    variables: Iterable[str] | None = None,
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
        Start, inputs and duration. One with a force_callback is flown by RK4.
    model : {"coupled", "decoupled", "independent"}
        "decoupled" is the paper's: the UAV-arm blocks of M and C are zero.
    method : {"Tsit5", "RK4", "implicit"}
        "Tsit5" is an embedded pair of order 5(4) with steps of each run's own, controlled by their
        error. "RK4" and "implicit" (order 2, for stiff arms of several sections) take steps of one
        length.
    rtol, atol : float, optional
        "Tsit5" keeps the error of a step in every component below `rtol` times its natural unit:
        an arm length, 1 rad, and these per √(length / 9.81 m/s²). With `atol` the bound is
        ``atol * unit + rtol * abs(component)``.
    max_step : float, optional
        Longest step of "Tsit5" [s].
    step : float, array_like of shape (runs,), or "auto", optional
        Step of "RK4" and "implicit" [s], which need it. "auto" is 0.2 over the fastest rate at the
        start (0.05 over the first mode's, "implicit"), at most `sample`; it does not know what
        comes later, as `check` does.
    check : bool, optional
        Fly a second time, at a tenth of the tolerance with steps of at most half a control period,
        or at half the step, and add `error_estimate`.
    duration : float, optional
        The scenario's by default [s].
    sample : float, optional
        Time between samples [s]; the last interval may be shorter.
    variables : iterable of str, optional
        Names to keep; all but `q` by default.
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
        `steps_rejected` and `evaluations`, the others `step`; `check` adds `error_estimate`: the
        largest distance of a tip from that of the second flight, in arm lengths.

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
    )
    recorder = Recorder(flight, model, with_limited_command(names, scenario), dtype)
    check_memory(recorder.needed())
    if scenario.force_callback is not None:
        record_called(recorder, stacklevel=3)
    else:
        record(recorder, check=checked)
    if recorder.error_estimate is not None:
        warn_of_errors(recorder.error_estimate, stacklevel=3)
    warn_of_saturation(recorder.saturation, stacklevel=3)
    warn_of_limits(recorder, stacklevel=3)
    recorder.names = names
    return recorder.dataset(recorder.step)


def _check_called(method: str, tolerance: Tolerance | None, check: bool) -> None:
    """Raise InputError for choices that a flight under a force_callback, by RK4, does not have."""
    if method == "implicit" or tolerance not in (None, tolerance_for(TSIT5)):
        raise InputError(
            "the scenario has a force_callback, which is flown by RK4; leave method='implicit', "
            "rtol, atol and max_step out, or write the force as a continuair.Term."
        )
    if check:
        raise InputError(
            "check is True, but the scenario has a force_callback, which is called for one flight; "
            "leave check out, or write the force as a continuair.Term."
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
        if name in (*OF_ARM, *OF_SECTION) and not vehicle.arms:
            raise InputError(
                f"variables holds {name}, but vehicle {shown(vehicle.name)} has no arm; leave it "
                "out, or give the vehicle a table [arm]."
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
