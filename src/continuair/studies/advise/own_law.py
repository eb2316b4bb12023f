"""The user's own controller in advice: what of it is flown, and whether it can be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from continuair.analysis.excited import excited_arm
from continuair.analysis.trim import held_hover
from continuair.controllers.cascade_design import GRAVITY
from continuair.controllers.controller import Controller
from continuair.errors import InputError, shown
from continuair.flight.simulate import simulate
from continuair.kernels.step import STATUS
from continuair.scenario.scenarios import Scenario
from continuair.studies.advise.verdicts import TASKS
from continuair.studies.excited_flights import Loop
from continuair.studies.standard_excitations import PERIODS, standard_scenario
from continuair.studies.standard_loops import LOOPS, OWN
from continuair.vehicle.vehicle import Vehicle

_SHORTEST = 2.0
"""Time for which a controller must hold the hover at the least [s]."""


def check_own(
    controller: Any, tasks: Sequence[str], loop: str, bandwidth: float | None, gains: Any
) -> None:
    """Raise InputError for a controller that is none, of several runs, or that no task flies, and
    for what it takes the place of."""
    if controller is None:
        return
    if not isinstance(controller, Controller):
        raise InputError(
            "controller", f"is {shown(controller)}", "give a continuair.Controller, or leave it out"
        )
    if controller.runs is not None:
        raise InputError(
            "controller",
            f"{controller.name} holds {controller.runs} runs",
            "give one with the gains of one run",
        )
    tracks = [task for task in tasks if task not in TASKS]
    if controller.looks:
        if not tracks:
            raise InputError(
                "controller",
                f"{controller.name} looks at a target, but no task tracks",
                "add track:M",
            )
        if gains is not None:
            raise InputError(
                "gains",
                f"is {gains.name}, but the controller {controller.name} tracks",
                "leave gains out",
            )
        return
    if len(tracks) == len(tasks):
        raise InputError(
            "controller",
            f"{controller.name} looks at no target, but every task tracks",
            f"add one of {', '.join(TASKS)}",
        )
    if loop != LOOPS[-1] or bandwidth is not None:
        field, value = ("loop", loop) if bandwidth is None else ("bandwidth", bandwidth)
        raise InputError(
            field,
            f"is {shown(value)}, but the controller {controller.name} holds the hover",
            "leave it out",
        )


def own_loop(vehicle: Vehicle, controller: Controller) -> Loop:
    """Return the loop that a controller closes about the hover of loads.

    They start at the origin of the world, and the arm, bent by 0.2 rad, is held by constant bend
    moments. Of these what the controller itself asks of the arm at the start is left out. Raises
    InputError for one that does not hold the vehicle there.
    """
    start = np.asarray(standard_scenario("release", vehicle).q)
    held = np.asarray(held_hover(vehicle, start, GRAVITY)["bend_moment"])
    asked = _asked(vehicle, controller, start, held)
    clamped = float(excited_arm(vehicle).frequency) / (2.0 * np.pi)
    lasts = max(_SHORTEST, PERIODS / clamped)
    hover = Scenario(
        "hover", start, duration=lasts, controller=controller, bend_moment=held - asked
    )
    flight = simulate(vehicle, hover, sample=0.1 * lasts, variables=["position"])
    status, name = int(flight["status"]), controller.name
    if status:
        raise InputError(
            "controller",
            (
                f"{name} loses the hover at the origin after "
                f"{float(flight['end_time']):.3g} s: {STATUS[status]}"
            ),
            "give one that holds it",
        )
    far = float(np.linalg.norm(flight["position"].transpose("time", "axis"), axis=1).max())
    if far > float(vehicle.reach):
        raise InputError(
            "controller",
            f"{name} takes the vehicle {far:.3g} m from the origin, where loads find it",
            "give one that holds [0, 0, 0], or its set-points",
        )
    return Loop(OWN, held=controller, asked=tuple(asked.tolist()))


def _asked(
    vehicle: Vehicle, controller: Controller, start: np.ndarray, held: np.ndarray
) -> np.ndarray:
    """The bend moments (bends,) that a controller asks for at the start [N m²]."""
    period = controller.period or 1e-3
    # A late push acts a latency after the first instant.
    lasts = controller.latency + period
    scenario = Scenario("start", start, duration=lasts, controller=controller, bend_moment=held)
    flight = simulate(vehicle, scenario, sample=lasts, variables=["command"])
    at = -1 if controller.latency else 0
    return flight["command"].transpose("time", "actuator").to_numpy()[at, 6:]
