"""Derivatives of a cost of a flight with respect to its start, inputs and vehicle.

The flight is that of `simulate`, with the same steps. The derivatives of each step are computed
with dual numbers, so exactly but for rounding; one backward sweep over the steps combines them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.adjoint import Flown, flown, of_rotation, sweep, variables_of_state
from continuair.engine.tangents import tangents_of
from continuair.errors import InputError, nearest, shown
from continuair.flight.cohorts import Flight
from continuair.flight.prepare import prepare
from continuair.flight.resolution import warn_of_errors
from continuair.flight.rollout import error_between
from continuair.kernels.dynamics import MODELS
from continuair.kernels.step import OK, STATUS
from continuair.scenario.scenarios import Scenario
from continuair.terms import name_of, terms_of
from continuair.typing import Array, ArrayLike, Model
from continuair.vehicle.layout import OF_TIPS, Layout
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_single_vehicle

Cost: TypeAlias = Callable[
    [xr.Dataset], tuple[float, Mapping[str, ArrayLike] | Mapping[str, xr.DataArray]]
]

_INPUTS = ("force", "moment", "bend_moment", "tip_wrench")


@dataclass(frozen=True, eq=False)
class Gradient:
    """The value of a cost, and its derivatives.

    Parameters
    ----------
    value : float
        The cost.
    start : dict of str to ndarray
        With respect to the initial position [m, world axes], rotation [rad, a rotation vector in
        body axes], bend [1/m], velocity [m/s, world axes], angular_velocity [rad/s, body axes] and
        bend_rate [1/(m s)]; with a section whose strain varies, strain and strain_rate in place of
        bend and bend_rate.
    inputs : dict of str to ndarray
        With respect to force, moment, bend_moment and tip_wrench, as in a `Scenario`, held during
        each step alone and added to the scenario's inputs; shapes (steps, n).
    fields : dict of str to ndarray
        With respect to fields of the vehicle, in their shapes. For a symmetric matrix, sum
        derivative times change over all entries.
    times : ndarray, shape (steps + 1,)
        Starts of the steps, and the end [s].
    trajectory : xarray.Dataset
        The trajectory that the cost received.
    """

    value: float
    start: dict[str, Array]
    inputs: dict[str, Array]
    fields: dict[str, Array]
    times: Array
    trajectory: xr.Dataset

    def held(self, times: ArrayLike) -> dict[str, Array]:
        """Return the derivatives with respect to inputs held over intervals.

        Parameters
        ----------
        times : array_like, shape (n,)
            Ascending starts of the intervals [s]; the last one ends with the flight. A step must
            begin at each, as at 0 and at the scenario's jumps.

        Returns
        -------
        dict of str to ndarray
            Input to derivatives (n, ...).

        Raises
        ------
        InputError
            If `times` is not ascending, or no step begins at one of them.
        """
        found = checks.finite_array(times)
        if found is None or found.ndim != 1 or not found.size or (np.diff(found) <= 0.0).any():
            raise InputError("times", f"is {shown(times)}", "give ascending times [s]")
        starts = self.times[:-1]
        at = np.abs(starts[:, None] - found).argmin(axis=0)
        off = np.abs(starts[at] - found) > 1e-9 * self.times[-1]
        if off.any():
            raise InputError(
                "times",
                f"has {found[off][0]:g} s, at which no step begins",
                "add it to the scenario's jumps",
            )
        return {name: np.add.reduceat(each, at, axis=0) for name, each in self.inputs.items()}


def gradient(
    vehicle: Vehicle,
    scenario: Scenario,
    cost: Cost,
    *,
    fields: Iterable[str] = (),
    model: Model = "coupled",
    step: float | Literal["auto"] = "auto",
    duration: float | None = None,
    sample: float = 1e-3,
) -> Gradient:
    """Return the derivatives of a cost of one flight.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with arms.
    scenario : Scenario
        One run without controller and `tau`.
    cost : callable
        Function of the trajectory, a Dataset as of `simulate`, with position, attitude, velocity,
        angular_velocity, bend, bend_rate (strain, strain_rate), tip_position, tip_attitude,
        tip_velocity and tip_angular_velocity over time. It returns its value, and a mapping from
        some of these names to the derivatives of the value, in the shape of the variable.
    fields : iterable of str, optional
        Dotted names of the vehicle's fields, such as "uav.mass" or "arm.length", which change as in
        `Vehicle.replace`.
    model : {"coupled", "decoupled", "independent"}, default "coupled"
        As in `simulate`.
    step : float or "auto", optional
        Step of RK4 [s]. "auto": ``min(sample, 0.2 / fastest_rate)`` of the vehicle and the start.
    duration : float, optional
        Duration [s]. Default: the scenario's.
    sample : float, optional
        Time between samples [s].

    Returns
    -------
    Gradient
        The value and its derivatives with respect to start, inputs and fields.

    Raises
    ------
    InputError
        If an argument cannot be used, or the flight stops early.

    Notes
    -----
    Derivatives are those of the integration steps.
    """
    check_has_arms(check_single_vehicle(vehicle, strain=True))
    checks.choice("model", model, MODELS)
    _check_plain(vehicle)
    flight = prepare(
        vehicle, scenario, step=step, sample=sample, duration=duration, strain=True, stacklevel=3
    )
    _check_smooth(flight)
    names = _names(fields)
    tangents = tangents_of(vehicle, names, flight.engine(model).kernels.types.Plant)
    found = flown(flight, model)
    recorder, layout = found.recorder, found.layout
    if found.status != OK:
        raise InputError(
            "duration",
            f"is not reached: {STATUS[found.status]}",
            "give a shorter duration, a shorter step or other inputs",
        )
    recorder.error_estimate = _error_of(found)
    warn_of_errors(recorder.error_estimate, stacklevel=3)
    trajectory = recorder.dataset(recorder.step)
    value, told = _checked(cost(trajectory), trajectory, layout)
    swept = sweep(found, tangents, told)
    inputs = {name: swept.inputs[:, layout.of_input[name]] for name in _INPUTS}
    inputs["tip_wrench"] = scenario.tip_wrench_sign * inputs["tip_wrench"]
    start = _of_start(found, swept.state, layout)
    of_fields = tangents.named(swept.fields)
    return Gradient(value, start, inputs, of_fields, found.times, trajectory)


def _error_of(flight: Flown) -> Array:
    """Return the tip's largest distance from a flight at half the step, in arm lengths (1,)."""
    finer = flown(flight.cohort.flight.finer(), flight.model).recorder
    return error_between(flight.recorder, finer, "tip_position")


def _names(fields: Iterable[str]) -> tuple[str, ...]:
    """Return names of fields, once each."""
    try:
        return tuple(dict.fromkeys([fields] if isinstance(fields, str) else fields))
    except TypeError:
        raise InputError(
            "fields", f"is {shown(fields)}", "give a list of names, such as ['uav.mass']"
        ) from None


def _check_plain(vehicle: Vehicle) -> None:
    """Raise InputError for a vehicle with a term that has no derivatives."""
    for term in terms_of(vehicle):
        if not term.differentiable:
            raise InputError(
                "vehicle",
                f"{shown(vehicle.name)} has {name_of(term)}, which has no gradient",
                "remove it, and give forces directly",
            )


def _check_smooth(flight: Flight) -> None:
    """Raise InputError unless a flight is one open-loop run."""
    scenario = flight.scenario
    if flight.batched:
        raise InputError(
            "scenario",
            f"{shown(scenario.name)} is a batch of {flight.runs}, but a gradient needs one run",
            "give one row of each",
        )
    if scenario.controller is not None:
        raise InputError(
            "scenario.controller",
            f"is {scenario.controller.name}, but a gradient needs an open loop",
            "remove it, and give inputs",
        )
    if scenario.tau is not None:
        raise InputError(
            "scenario.tau",
            "acts on coordinates that jump, and has no gradient",
            "give force, moment and bend_moment",
        )


def _checked(
    found: object, trajectory: xr.Dataset, layout: Layout
) -> tuple[float, dict[str, Array]]:
    """Return the value and the derivatives (samples, columns) that a cost returns."""
    if not (isinstance(found, tuple) and len(found) == 2 and isinstance(found[1], Mapping)):
        raise InputError(
            "cost",
            f"returns {shown(found)}",
            "return a number and a mapping from variables to derivatives",
        )
    given = np.asarray(found[0])
    value = checks.number("the value of cost", given.item() if given.size == 1 else found[0])
    slopes, known = {}, (*variables_of_state(layout), *OF_TIPS)
    for name, slope in found[1].items():
        if name not in known:
            remedy = nearest(str(name), known)
            raise InputError("cost", f"returns a derivative of {shown(name)}", remedy)
        dims, shape = trajectory[name].dims, trajectory[name].shape
        if isinstance(slope, xr.DataArray) and set(slope.dims) == set(dims):
            slope = slope.transpose(*dims)
        numbers = checks.finite_array(slope)
        if numbers is None or numbers.shape != shape:
            raise InputError(
                "cost",
                f"returns {shown(slope)} as the derivative of {name}",
                f"return finite numbers of shape {shape}",
            )
        slopes[name] = numbers.reshape(shape[0], -1)
    return value, slopes


def _of_start(found: Flown, state: Array, layout: Layout) -> dict[str, Array]:
    """Return the derivatives with respect to the parts of the start, by name."""
    columns = variables_of_state(layout)
    slopes = {name: state[getattr(layout, column)] for name, column in columns.items()}
    slopes["rotation"] = of_rotation(found.log[0, layout.attitude], slopes.pop("attitude"))
    return slopes
