"""Derivatives of a cost of a flight: with respect to its start, its inputs and its vehicle.

The flight is that of `simulate`, with the same steps. Derivatives of each step are computed in dual
numbers, and so to rounding; one sweep back over the steps makes those of the cost of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.adjoint import OF_STATE, OF_TIPS, Flown, flown, of_rotation, sweep
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
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_single_vehicle

Array = np.ndarray
Cost = Callable[[xr.Dataset], tuple[float, Mapping[str, Any]]]

_INPUTS = ("force", "moment", "bend_moment", "tip_wrench")


@dataclass(frozen=True, eq=False)
class Gradient:
    """The value of a cost, and its derivatives.

    start: with respect to position [m, world axes], rotation [rad, a rotation vector in body axes],
    bend [1/m], velocity [m/s, world axes], angular_velocity [rad/s, body axes] and bend_rate
    [1/(m s)] at the start. inputs: with respect to what acts during each step alone (steps, n),
    beside the scenario's inputs: force, moment, bend_moment and tip_wrench, as a `Scenario` has
    them. fields: with respect to fields of the vehicle, in their shapes; of a symmetric matrix
    derivatives times changes add up over all entries. times: where steps begin, and the end
    (steps + 1,) [s]. trajectory: what the cost was told.
    """

    value: float
    start: dict[str, Array]
    inputs: dict[str, Array]
    fields: dict[str, Array]
    times: Array
    trajectory: xr.Dataset

    def held(self, times: Any) -> dict[str, Array]:
        """Derivatives (n, ...) with respect to inputs held from each of n times to the next.

        times: ascending [s], the last one's inputs are held to the end; at each a step has to
        begin, as at 0 and at the scenario's jumps. Raises InputError.
        """
        found = checks.finite_array(times)
        if found is None or found.ndim != 1 or not found.size or (np.diff(found) <= 0.0).any():
            raise InputError(f"times is {shown(times)}; give ascending times [s].")
        starts = self.times[:-1]
        at = np.abs(starts[:, None] - found).argmin(axis=0)
        off = np.abs(starts[at] - found) > 1e-9 * self.times[-1]
        if off.any():
            raise InputError(
                f"times holds {found[off][0]:g} s, at which no step begins; name it in the "
                "scenario's jumps."
            )
        return {name: np.add.reduceat(each, at, axis=0) for name, each in self.inputs.items()}


def gradient(
    vehicle: Vehicle,
    scenario: Scenario,
    cost: Cost,
    *,
    fields: Iterable[str] = (),
    model: str = "coupled",
    step: float | str = "auto",
    duration: float | None = None,
    sample: float = 1e-3,
) -> Gradient:
    """Derivatives of a cost of one flight with respect to its start, its inputs and its vehicle.

    cost: a function of the trajectory, a Dataset as `simulate` returns it, of position, attitude,
    velocity, angular_velocity, bend, bend_rate, tip_position, tip_attitude, tip_velocity and
    tip_angular_velocity over time. It returns its value, and a mapping from some of these names to
    the derivatives of the value, in the shape of the variable. fields: dotted names of the vehicle,
    such as "uav.mass" or "arm.length", which change as by `Vehicle.replace`. It flies by
    RK4; step: [s], or "auto", 0.2 over the fastest rate of the vehicle and the start, at most
    `sample`. model, duration, sample: as in `simulate`. Derivatives are those of the steps.

    The scenario has no controller and no tau. Raises InputError, also where the flight ends early.
    """
    check_has_arms(check_single_vehicle(vehicle))
    checks.choice("model", model, MODELS)
    _check_plain(check_single_vehicle(vehicle))
    flight = prepare(vehicle, scenario, step=step, sample=sample, duration=duration, stacklevel=3)
    _check_smooth(flight)
    names = _names(fields)
    tangents = tangents_of(vehicle, names, flight.engine(model).kernels.types.Plant)
    found = flown(flight, model)
    recorder, layout = found.recorder, found.layout
    if found.status != OK:
        raise InputError(
            f"the flight ends before its duration, {STATUS[found.status]}; give a shorter "
            "duration, a shorter step or other inputs."
        )
    recorder.error_estimate = _error_of(found)
    warn_of_errors(recorder.error_estimate, stacklevel=3)
    trajectory = recorder.dataset(recorder.step)
    value, told = _checked(cost(trajectory), trajectory)
    swept = sweep(found, tangents, told)
    inputs = {name: swept.inputs[:, layout.of_input[name]] for name in _INPUTS}
    inputs["tip_wrench"] = scenario.tip_wrench_sign * inputs["tip_wrench"]
    start = _of_start(found, swept.state, layout)
    of_fields = tangents.named(swept.fields)
    return Gradient(value, start, inputs, of_fields, found.times, trajectory)


def _error_of(flight: Flown) -> np.ndarray:
    """Largest distance of a tip from that of a flight at half the step, in arm lengths (1,)."""
    finer = flown(flight.cohort.flight.finer(), flight.model).recorder
    return error_between(flight.recorder, finer, "tip_position")


def _names(fields: Any) -> tuple[str, ...]:
    """Names of fields, once each."""
    try:
        return tuple(dict.fromkeys([fields] if isinstance(fields, str) else fields))
    except TypeError:
        raise InputError(
            f"fields is {shown(fields)}; give a list of names, such as ['uav.mass']."
        ) from None


def _check_plain(vehicle: Vehicle) -> None:
    """Raise InputError for a vehicle of which no derivatives are known."""
    for term in terms_of(vehicle):
        if not term.differentiable:
            raise InputError(
                f"vehicle {shown(vehicle.name)} has {name_of(term)}, of which no gradient is "
                "known; leave it out, and give forces directly."
            )


def _check_smooth(flight: Flight) -> None:
    """Raise InputError unless a flight is one run that derivatives are known of."""
    scenario = flight.scenario
    if flight.batched:
        raise InputError(
            f"scenario {shown(scenario.name)} is a batch of {flight.runs}, but a gradient is of "
            "one run; give one row of each."
        )
    if scenario.controller is not None:
        raise InputError(
            f"scenario.controller is {scenario.controller.name}, but a gradient is of a flight in "
            "open loop; leave it out, and give inputs."
        )
    if scenario.tau is not None:
        raise InputError(
            "scenario.tau acts along coordinates that jump, and has no gradient; give force, "
            "moment and bend_moment."
        )


def _checked(found: Any, trajectory: xr.Dataset) -> tuple[float, dict[str, Array]]:
    """Value and derivatives (samples, columns) that a cost returns."""
    if not (isinstance(found, tuple) and len(found) == 2 and isinstance(found[1], Mapping)):
        raise InputError(
            f"cost returns {shown(found)}; return a number, and a mapping from names of variables "
            "to derivatives."
        )
    given = np.asarray(found[0])
    value = checks.number("the value of cost", given.item() if given.size == 1 else found[0])
    slopes = {}
    for name, slope in found[1].items():
        if name not in OF_STATE + OF_TIPS:
            remedy = nearest(str(name), OF_STATE + OF_TIPS)
            raise InputError(f"cost returns a derivative of {shown(name)}; {remedy}.")
        dims, shape = trajectory[name].dims, trajectory[name].shape
        if isinstance(slope, xr.DataArray) and set(slope.dims) == set(dims):
            slope = slope.transpose(*dims)
        numbers = checks.finite_array(slope)
        if numbers is None or numbers.shape != shape:
            raise InputError(
                f"cost returns {shown(slope)} as the derivative of {name}; return finite numbers "
                f"of shape {shape}."
            )
        slopes[name] = numbers.reshape(shape[0], -1)
    return value, slopes


def _of_start(found: Flown, state: Array, layout: Layout) -> dict[str, Array]:
    """Derivatives with respect to the parts of the start, by name."""
    slopes = {name: state[getattr(layout, name)] for name in OF_STATE}
    slopes["rotation"] = of_rotation(found.log[0, layout.attitude], slopes.pop("attitude"))
    return slopes
