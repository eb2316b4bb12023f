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

from continuair.analysis.metrics import at_camera, differences
from continuair.engine.adaptive import Tolerance
from continuair.errors import InputError
from continuair.flight.cohorts import Flight
from continuair.flight.prepare import check_scenario, prepare
from continuair.flight.rollout import fly
from continuair.kernels.dynamics import COUPLINGS
from continuair.kernels.integrators import TSIT5
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_POSE = ("tip_position", "tip_attitude")

_RTOL = 1e-6
"""Tolerance of the flights, whose differences are small for weak couplings."""


def attribution(
    vehicle: Vehicle, scenario: Scenario, sample: float, settle: float = 0.0
) -> dict[str, dict[str, Any]]:
    """How far the tip is from the coupled flight's without each of COUPLINGS alone, and of
    `decoupled`, without all of them: what `compare` returns, NaN for a flight that ended early. Of
    several tips it is the one that carries the camera.

    vehicle, scenario: plain or batched, in open loop or in one without a target; sample: time
    between samples [s]; settle: time at the start that does not count [s]. Raises InputError.
    """
    check_scenario(scenario)
    if scenario.controller is not None and scenario.controller.looks:
        raise InputError(
            f"scenario holds the controller {scenario.controller.name}, which looks at a target; "
            "couplings are told apart in open loop, or under a law that looks at none."
        )
    tolerance = Tolerance(_RTOL)
    flight = prepare(
        vehicle, scenario, sample=sample, method=TSIT5, tolerance=tolerance, stacklevel=3
    )
    models = {coupling: f"without {coupling}" for coupling in COUPLINGS}
    models["decoupled"] = "decoupled"
    coupled = _tip(flight, "coupled", settle)
    return {
        name: differences(coupled, _tip(flight, model, settle)) for name, model in models.items()
    }


def _tip(flight: Flight, model: str, settle: float) -> xr.Dataset:
    """Pose of the tip that carries the camera, from a time on [s]."""
    found = at_camera(fly(flight, model, _POSE), flight.vehicle)
    return found.sel(time=slice(settle, None))


def responsible(errors: dict[str, Array]) -> Array:
    """Return the name (runs,) of the coupling whose loss alone errs most; "" for a lost flight."""
    rows = np.stack([errors[name] for name in COUPLINGS])
    known = np.isfinite(rows).all(axis=0)
    names = np.array(COUPLINGS)[np.argmax(np.nan_to_num(rows), axis=0)]
    return np.where(known, names, "")
