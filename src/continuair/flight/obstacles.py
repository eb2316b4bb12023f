"""Obstacles of a scenario as a force on the vehicle that flies in it."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from continuair.engine.engine import Drive, Engine, Start
from continuair.errors import InputError
from continuair.scenario.scenarios import Scenario
from continuair.terms import Contact
from continuair.vehicle.vehicle import Vehicle


def beside_obstacles(vehicle: Vehicle, scenario: Scenario) -> Vehicle:
    """Return the vehicle whose arms touch the obstacles of a scenario."""
    if not scenario.obstacles:
        return vehicle
    if not vehicle.arms:
        raise InputError(
            "scenario.obstacles",
            "are given, but the vehicle has no arm that could touch them",
            "omit them, or use a vehicle with an arm",
        )
    sections = [section for arm in vehicle.arms for section in arm.section]
    radii = [0.0 if each.given_radius is None else each.radius for each in sections]
    varying = np.broadcast_shapes(*(np.shape(each) for each in radii))
    radius = np.column_stack([np.broadcast_to(each, varying) for each in radii])
    contact = Contact(
        numbers=tuple((*each.law, *each.placed()) for each in scenario.obstacles),
        radii=cast(Any, radius if varying else tuple(radius.ravel().tolist())),
        shapes=tuple(each.shape for each in scenario.obstacles),
        arms=len(vehicle.arms),
    )
    return vehicle.having(terms=(*vehicle.terms, contact))


def check_outside(engine: Engine, scenario: Scenario, start: Start) -> None:
    """Raise InputError for an arm that is inside an obstacle at the start."""
    if not scenario.obstacles:
        return
    layout, runs = engine.layout, len(start.states)
    log = np.zeros((runs, 1, layout.log))
    log[:, 0, : start.states.shape[1]] = start.states
    nothing = Drive(np.zeros((1, 1, layout.inputs)), False, 0, scenario.gravity)
    seen = engine.observe(log, nothing, ["contact_inside"], np.arange(runs))[:, 0]
    inside = seen[:, layout.observed["contact_inside"]]
    if (inside > 0.0).any():
        run, arm = np.argwhere(inside > 0.0)[0]
        where = f" in run {run}" if runs > 1 else ""
        raise InputError(
            "scenario.obstacles",
            f"hold the backbone of arm {engine.vehicle.arms[arm].name} at the start{where}",
            "start beside them",
        )
