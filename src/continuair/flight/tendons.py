"""Tendons of a flight: their commands, and their motors and tensions at the start."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.engine.engine import Drive, Engine, Start
from continuair.errors import InputError
from continuair.flight.inputs import groups_in_use, groups_of_loop, sample_inputs
from continuair.flight.labels import tendon_labels
from continuair.flight.scene import observed_at_start
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.layout import Layout
from continuair.vehicle.runs import per_run
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.vehicle import Vehicle


def check_commands(scenario: Scenario, layout: Layout) -> None:
    """Raise InputError unless a scenario has a command for each tendon, or none."""
    value: Any = scenario.tendon_command
    given = value(0.0) if callable(value) else value
    if given is None or np.shape(given)[-1] == layout.tendons:
        return
    raise InputError(
        "scenario.tendon_command",
        f"has {np.shape(given)[-1]} numbers, but the vehicle has {layout.tendons or 'no'} tendons",
        "give one for each" if layout.tendons else "omit it, or give the arm [[arm.tendon]]",
    )


def tendons_at_start(vehicle: Vehicle, scenario: Scenario, layout: Layout) -> Array:
    """Return the initial states of tendons (runs or 1, n): motors at their commands, no slip."""
    groups = [group for arm in vehicle.arms for group in arm.tendon]
    given: Any = scenario.tendon_command
    command = np.atleast_2d(given(0.0) if callable(given) else 0.0 if given is None else given)
    commands = np.broadcast_to(command, (len(command), vehicle.tendons))
    runs, first, found = max(len(command), vehicle.runs or 1), 0, []
    for group in groups:
        own = np.broadcast_to(commands[:, first : first + group.count], (runs, group.count))
        found += [_within_stroke(group, own)] if group.lags else []
        first += group.count
    slips = layout.of_state.get("tendon_slip", slice(0, 0))
    return np.hstack([*found, np.zeros((runs, slips.stop - slips.start))])


def _within_stroke(group: Tendon, commands: Array) -> Array:
    """Return the commands (runs, tendons) that motors of a group can follow."""
    if group.command == "tension":
        return commands
    strokes = per_run(group.strokes, len(commands), 2)
    return np.clip(commands, strokes[:, :1], strokes[:, 1:])


def check_taut(engine: Engine, scenario: Scenario, start: Start) -> None:
    """Raise InputError for a tendon that is slack at the start."""
    vehicle, layout = engine.vehicle, engine.layout
    groups = [group for arm in vehicle.arms for group in arm.tendon]
    if not any(group.command == "length" for group in groups):
        return
    table = sample_inputs(scenario, np.zeros(1), layout)[0]
    bits = groups_in_use(scenario) | groups_of_loop(scenario, vehicle)
    acting = Drive(table, False, bits, scenario.gravity)
    slack = observed_at_start(engine, start, acting, "tendon_slack")
    if (slack > 0.0).any():
        run, tendon = np.argwhere(slack > 0.0)[0]
        where = f" in run {run}" if len(slack) > 1 else ""
        raise InputError(
            "scenario.tendon_command",
            f"leaves tendon {tendon_labels(vehicle)[tendon]} slack at the start{where}, "
            f"by {slack[run, tendon]:.3g} m",
            "take in more, or give it a greater pretension",
        )
