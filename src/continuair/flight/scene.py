"""Obstacles and payload of a scenario, as terms of the vehicle."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from continuair.engine.engine import Drive, Engine, Start
from continuair.errors import InputError, shown
from continuair.scenario.payload import Payload
from continuair.scenario.scenarios import Scenario
from continuair.terms import CarriedBody, Contact, Term
from continuair.typing import Array
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle import Vehicle

# A pick-up at a time is at the step that begins there, whose start may be rounded.
_EARLIER, _NEVER = 1e-9, 1e30


def in_scene(vehicle: Vehicle, scenario: Scenario) -> Vehicle:
    """Return the vehicle with the terms that a scenario adds."""
    for name in ("obstacles", "payload"):
        if getattr(scenario, name) and not vehicle.arms:
            raise InputError(
                f"scenario.{name}",
                "is given, but the vehicle has no arm",
                "omit it, or use a vehicle with an arm",
            )
    found = [_contact(vehicle, scenario)] if scenario.obstacles else []
    found += [_carried(vehicle, scenario.payload)] if scenario.payload else []
    return vehicle.having(terms=(*vehicle.terms, *found)) if found else vehicle


def payload_at_start(scenario: Scenario, layout: Layout) -> Array:
    """Return the initial states of a payload (1, n): whether it is carried, and no impulse."""
    names = [name for name in ("payload", "payload_impulse") if name in layout.of_state]
    found = np.zeros((1, sum(dict(layout.own_states)[name] for name in names)))
    if scenario.payload is not None:
        found[0, 0] = scenario.payload.at_start
    return found


def _carried(vehicle: Vehicle, payload: Payload) -> Term:
    """Return the payload as a term of the vehicle."""
    names, arm = [arm.name for arm in vehicle.arms], payload.arm
    if isinstance(arm, str) and arm in names:
        arm = names.index(arm)
    if not isinstance(arm, int) or not 0 <= arm < len(names):
        raise InputError(
            "scenario.payload.arm",
            f"is {shown(payload.arm)}, but the vehicle has the arms {', '.join(names)}",
            "give the name or index of one of them",
        )
    if payload.runs is not None and vehicle.runs not in (None, payload.runs):
        raise InputError(
            "scenario.payload.mass",
            f"has {payload.runs} runs, but the vehicle has {vehicle.runs}",
            "give equally many, or one for all",
        )
    first = sum(vehicle.shape[:arm])
    attach = payload.attach or 0.0
    release = _NEVER if payload.release is None else payload.release - _EARLIER
    given: Any = payload
    return CarriedBody(
        mass=given.mass,
        centre=given.centre,
        inertia=given.inertia,
        velocity=given.velocity,
        place=(0.0, 0.0, 0.0) if payload.place is None else given.place,
        times=(attach - _EARLIER, release, payload.reach),
        touched=payload.place is not None,
        arm=arm,
        sections=tuple(range(first, first + vehicle.shape[arm])),
    )


def _contact(vehicle: Vehicle, scenario: Scenario) -> Term:
    """Return the contact with obstacles as a term of the vehicle."""
    sections = [section for arm in vehicle.arms for section in arm.section]
    radii = [0.0 if each.given_radius is None else each.radius for each in sections]
    varying = np.broadcast_shapes(*(np.shape(each) for each in radii))
    radius = np.column_stack([np.broadcast_to(each, varying) for each in radii])
    return Contact(
        numbers=tuple((*each.law, *each.placed()) for each in scenario.obstacles),
        radii=cast(Any, radius if varying else tuple(radius.ravel().tolist())),
        shapes=tuple(each.shape for each in scenario.obstacles),
        arms=len(vehicle.arms),
    )


def observed_at_start(engine: Engine, start: Start, acting: Drive, name: str) -> Array:
    """Return a variable of a term (runs, n) at the start of a flight."""
    layout, runs = engine.layout, len(start.states)
    log = np.zeros((runs, 1, layout.log))
    log[:, 0, : start.states.shape[1]] = start.states
    seen = engine.observe(log, acting, [name], np.arange(runs))[:, 0]
    return np.asarray(seen[:, layout.observed[name]])


def check_outside(engine: Engine, scenario: Scenario, start: Start) -> None:
    """Raise InputError for an arm that is inside an obstacle at the start."""
    if not scenario.obstacles:
        return
    nothing = Drive(np.zeros((1, 1, engine.layout.inputs)), False, 0, scenario.gravity)
    inside = observed_at_start(engine, start, nothing, "contact_inside")
    if (inside > 0.0).any():
        run, arm = np.argwhere(inside > 0.0)[0]
        where = f" in run {run}" if len(inside) > 1 else ""
        raise InputError(
            "scenario.obstacles",
            f"hold arm {engine.vehicle.arms[arm].name} at the start{where}",
            "start beside them",
        )
