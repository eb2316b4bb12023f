"""Loops for standard excitations: none, or a flight controller that holds the hover.

"position" holds position, height and attitude. "attitude" holds height and attitude alone, as under
manual control of the tilt; the vehicle drifts sideways under the load. Neither holds the arm, which
keeps its initial moment: a servo would stiffen it and hide the loop's effect.
OWN is a controller of the user, which holds what it holds (`advise/own_law.py`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from continuair import checks
from continuair.controllers.cascade_design import GRAVITY
from continuair.controllers.controller import Controller, stack
from continuair.controllers.flight import flight_controller
from continuair.controllers.hover import hover
from continuair.controllers.margins import LinearLoop
from continuair.errors import InputError, shown
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

LOOPS = ("none", "attitude", "position")

OWN = "own"
"""The name of a loop that a given controller closes."""

_UNFELT = 1e-9
"""Share of the velocity's gains that is left sideways: the law divides by them."""


def hover_loop(vehicle: Vehicle, loop: str, bandwidth: float | None = None) -> Controller | None:
    """Return the flight controller of a loop with that bandwidth of the attitude [rad/s], or None.

    bandwidth: by default the fastest that `flight_controller` allows the vehicle; position and yaw
    follow from it. Raises InputError, also for a bandwidth at which the vehicle is unstable.
    """
    if checks.choice("loop", loop, LOOPS) == "none":
        if bandwidth is not None:
            raise InputError(
                "bandwidth",
                f"is {shown(bandwidth)}, but loop 'none' has none",
                "leave it out, or give loop='position'",
            )
        return None
    if vehicle.runs is not None:
        raise InputError(
            "loop",
            f"is {loop!r}, but the vehicle is a batch of {vehicle.runs}",
            "give one vehicle, as gains are made for each, or loop='none'",
        )
    held = _held(vehicle, bandwidth)
    return held if loop == "position" else _free_sideways(held)


@lru_cache(maxsize=16)
def _held(vehicle: Vehicle, bandwidth: float | None) -> Controller:
    """Return the flight controller of a vehicle, which studies need for every excitation."""
    return flight_controller(vehicle, attitude_bandwidth=bandwidth, bend_bandwidth=0.0)


def bent_growth(vehicle: Vehicle, held: Controller, q: Array) -> float:
    """Return the growth rate [1/s] of a small tilt in a loop, if above 0, with bends held.

    Constant moments hold the bends of q (coordinates,).
    """
    state = state_from_paper(q[None], np.zeros_like(q[None]), vehicle.layout)[0]
    bent = hover(vehicle, GRAVITY, tuple(state[vehicle.layout.bend].tolist()))
    chosen = held.settings
    loop = LinearLoop(bent, held.gains, chosen["feedforward"], chosen["rotor_lag"])
    return loop.growth(chosen["latency"])


def hover_loops(vehicle: Vehicle, bandwidths: Array) -> tuple[Controller | None, Array]:
    """Return the position loops of a batch, of bandwidths (runs,) of the attitude [rad/s].

    Returns the stable ones in one controller, None if there is none, and which they are (runs,).
    """
    made = [_if_stable(vehicle.select(run), each) for run, each in enumerate(bandwidths)]
    stable = [each for each in made if each is not None]
    return stack(stable) if stable else None, np.array([each is not None for each in made])


def _if_stable(vehicle: Vehicle, bandwidth: float) -> Controller | None:
    try:
        return hover_loop(vehicle, "position", float(bandwidth))
    except InputError:
        return None


def _free_sideways(held: Controller) -> Controller:
    """Return a controller that holds height, but neither holds nor slows horizontal motion."""
    velocity = held.gains["velocity"] * np.array([_UNFELT, _UNFELT, 1.0])
    gains = {
        "position": held.gains["position"] * np.array([0.0, 0.0, 1.0]),
        "velocity": velocity,
        "integral": held.gains["integral"] * np.array([0.0, 0.0, 1.0]),
    }
    settings = {**held.settings, **gains}
    settings["height_bandwidth"] = settings.pop("position_bandwidth")
    return replace(
        held, name="attitude and height", gains={**held.gains, **gains}, settings=settings
    )
