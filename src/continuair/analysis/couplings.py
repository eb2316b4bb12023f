"""Flights of the coupled model with one of its couplings switched off, to tell which one matters.

With ν = (velocity, world; angular velocity, body; bend rate), M ν̇ + c = f couples UAV and arm by
the blocks M_ua, M_au of M, and by what of c is left out with them. Decoupling drops all of it,
M_d ν̇ + c_d = f. Three parts are told apart, and each is dropped alone:

* "carriage": the acceleration a_G = g + F/m of the common centre of mass does not reach the arm's
  bend, M_ba a_G. In free fall a_G = g: the decoupled arm sags under a weight that it does not feel.
* "inertia": the rest of M_ua ν̇_a and M_au ν̇_u, the arm's recoil and its answer to the UAV.
* "coriolis": what is quadratic in the rates.

They are models of kernels/dynamics.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from continuair.analysis.metrics import rmse
from continuair.errors import InputError
from continuair.flight.prepare import Flight, check_scenario, prepare
from continuair.flight.simulate import fly
from continuair.kernels.dynamics import COUPLINGS
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_TIP = ("tip_position", "tip_attitude")


def fly_without(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    sample: float = 1e-2,
    duration: float | None = None,
    **options: Any,
) -> xr.Dataset:
    """Tip of the coupled model without one coupling, for each of COUPLINGS.

    vehicle, scenario: plain or batched, in open loop; options: step, device and threads, as for
    `simulate`. Returns tip_position and tip_attitude over (coupling, time) and, for a batch, run;
    a run that leaves the model's range is NaN from there on. Raises InputError.
    """
    flight = _prepared(vehicle, scenario, sample=sample, duration=duration, **options)
    found = [fly(flight, f"without {coupling}", _TIP) for coupling in COUPLINGS]
    over = xr.Variable("coupling", list(COUPLINGS))
    return xr.concat(found, over, combine_attrs="drop_conflicts")


def attribution(vehicle: Vehicle, scenario: Scenario, sample: float) -> dict[str, Array]:
    """RMSE of the tip [m] (runs,) from the coupled flight without each of COUPLINGS alone, and of
    `decoupled`, without all of them. NaN where a flight left the model's range.

    vehicle, scenario: batched, in open loop; sample: time between samples [s]. Raises InputError.
    """
    flight = _prepared(vehicle, scenario, sample=sample)
    models = {coupling: f"without {coupling}" for coupling in COUPLINGS}
    models["decoupled"] = "decoupled"
    coupled = _tips(flight, "coupled")
    return {
        name: np.atleast_1d(rmse(coupled, _tips(flight, model))) for name, model in models.items()
    }


def responsible(errors: dict[str, Array]) -> Array:
    """Return the name (runs,) of the coupling whose loss alone errs most; "" for a lost flight."""
    rows = np.stack([errors[name] for name in COUPLINGS])
    known = np.isfinite(rows).all(axis=0)
    names = np.array(COUPLINGS)[np.argmax(np.nan_to_num(rows), axis=0)]
    return np.where(known, names, "")


def _prepared(vehicle: Any, scenario: Any, **options: Any) -> Flight:
    check_scenario(scenario)
    if scenario.controller is not None:
        raise InputError("scenario holds a controller; couplings are told apart in open loop.")
    return prepare(vehicle, scenario, stacklevel=4, **options)


def _tips(flight: Flight, model: str) -> Array:
    return fly(flight, model, ("tip_position",))["tip_position"].to_numpy()
