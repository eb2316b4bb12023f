"""Simulation of a vehicle for viewing, coupled and decoupled."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from continuair.controllers.flight import flight_controller
from continuair.errors import InputError
from continuair.flight.simulate import simulate
from continuair.scenario.scenarios import Scenario
from continuair.scenario.setpoints import Setpoints
from continuair.vehicle.bending import constant_bends
from continuair.vehicle.vehicle import Vehicle

HEIGHT = 1.6
"""Of the start over the reach: the ground is in the picture."""

_SAMPLE, _DURATION = 1e-3, 10.0
"""[s]"""

_TURN = 0.8
"""Bend angle of each section that the hovering vehicle's arm swings to [rad]."""

_PUSH, _PUSHED = 0.3, (5.0, 5.5)
"""Lateral force over the weight, and its start and end [s]."""


def fly(vehicle: Vehicle) -> tuple[Scenario, xr.Dataset, xr.Dataset]:
    """Return a scenario that suits a vehicle, and its flights by both models.

    It is a hover in which the arms swing and a lateral force acts, under a flight controller, or
    open loop if none can be designed.
    """
    chosen = _hover(vehicle)
    flights = [
        simulate(vehicle, chosen, model=model, sample=_SAMPLE) for model in ("coupled", "decoupled")
    ]
    return chosen, flights[0], flights[1]


def _hover(vehicle: Vehicle) -> Scenario:
    q = np.zeros(vehicle.layout.coordinates)
    q[2] = HEIGHT * vehicle.reach
    push = np.array([0.0, -_PUSH * vehicle.mass * 9.81, 0.0])
    given: dict[str, Any] = {
        "force": lambda t: push * float(_PUSHED[0] <= t < _PUSHED[1]),
        "jumps": _PUSHED,
        "duration": _DURATION,
    }
    lengths = np.array([each.length for arm in vehicle.arms for each in arm.section])
    along_x = constant_bends(vehicle)[:, 0]

    def swing(t: float) -> Any:
        bend = np.zeros(vehicle.layout.bends)
        bend[along_x] = _TURN / lengths * np.sin(0.5 * np.pi * t)
        return bend

    try:
        law = flight_controller(vehicle)
    except InputError:
        return Scenario("hover, open loop", q, **given)
    wanted = Setpoints(bend=swing) if vehicle.arms else None
    return Scenario("hover", q, controller=law, setpoints=wanted, **given)
