"""Flights of the coupled model with one coupling term removed, which show the term that matters.

With ν = (velocity, world; angular velocity, body; bend rate), M ν̇ + c = f couples UAV and arm by
the blocks M_ua, M_au of M, and by the terms of c that belong to them. Decoupling drops all of
these, M_d ν̇ + c_d = f. Three parts are distinguished, and each is dropped alone:

* "carriage": the acceleration a_G = g + F/m of the common centre of mass does not act on the
  arm's bend, M_ba a_G. In free fall a_G = g: the decoupled arm sags under a weight that the
  coupled arm does not have.
* "inertia": the rest of M_ua ν̇_a and M_au ν̇_u: the arm's reaction on the UAV, and its response
  to it.
* "coriolis": terms quadratic in the rates.

The models are those of kernels/dynamics.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.analysis.metrics import at_camera, differences
from continuair.engine.adaptive import Tolerance
from continuair.errors import InputError
from continuair.flight.adaptive import compile_models
from continuair.flight.prepare import check_scenario, prepare
from continuair.flight.rollout import fly_models
from continuair.kernels.dynamics import COUPLINGS
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

_POSE = ("tip_position", "tip_attitude")

_RTOL = 1e-6
"""Tolerance of the flights, as differences are small for weak couplings."""


def attribution(
    vehicle: Vehicle, scenario: Scenario, sample: float, settle: float = 0.0, whole: bool = True
) -> dict[str, dict[str, Any]]:
    """Return the tip's differences from the coupled flight without each of COUPLINGS alone.

    "decoupled" is without all of them, left out unless `whole`. Differences are those of `compare`,
    NaN for a flight that stopped early. Of several tips, the one with the camera is used.

    vehicle, scenario: plain or batched, without a target; sample: time between samples [s]; settle:
    time at the start that is excluded [s]. Raises InputError.
    """
    check_scenario(scenario)
    if scenario.controller is not None and scenario.controller.looks:
        raise InputError(
            "scenario",
            f"has the controller {scenario.controller.name}, which uses a target",
            "give an open-loop scenario, or a controller without a target",
        )
    tolerance = Tolerance(_RTOL)
    flight = prepare(
        vehicle,
        scenario,
        sample=sample,
        method="Tsit5",
        tolerance=tolerance,
        strain=True,
        stacklevel=3,
    )
    models = {coupling: f"without {coupling}" for coupling in COUPLINGS}
    if whole:
        models["decoupled"] = "decoupled"
    compile_models(flight, ["coupled", *models.values()])
    flown = fly_models(flight, ["coupled", *models.values()], _POSE)
    coupled, *others = (at_camera(each, vehicle).sel(time=slice(settle, None)) for each in flown)
    return {name: differences(coupled, tip) for name, tip in zip(models, others, strict=True)}


def responsible(errors: dict[str, Array]) -> NDArray[np.str_]:
    """Return the coupling (runs,) whose removal alone causes the largest error.

    "" for a flight that stopped early.
    """
    rows = np.stack([errors[name] for name in COUPLINGS])
    known = np.isfinite(rows).all(axis=0)
    names = np.array(COUPLINGS)[np.argmax(np.nan_to_num(rows), axis=0)]
    return np.where(known, names, "")
