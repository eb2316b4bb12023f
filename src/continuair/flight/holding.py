"""Inputs that hold a vehicle at rest."""

from __future__ import annotations

import numpy as np

from continuair.engine.engine import Drive, Engine, Start
from continuair.typing import Array, ArrayLike
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL, ROTORS, TIP
from continuair.vehicle.vehicle import Vehicle


def holding(
    engine: Engine,
    rows: Array,
    gravity: float,
    tip_wrench: ArrayLike = 0.0,
    thrusts: Array | None = None,
) -> Array:
    """Return actuator wrenches (runs, coordinates) under which nothing accelerates at rest.

    rows: (runs, 8). engine: of any model, on a base at rest. thrusts: of rotors (runs, rotors) [N],
    that act besides; without them rotors are at rest.
    """
    layout, vehicle = engine.layout, engine.vehicle
    rows = np.broadcast_to(rows, (max(len(rows), vehicle.runs or 1), layout.coordinates))
    state, groups = state_from_paper(rows, np.zeros(rows.shape), layout), GENERAL + TIP
    if thrusts is not None and vehicle.uav.rotors is not None:
        speeds = vehicle.uav.rotors.speeds_of(thrusts)
        state, groups = np.hstack([state, speeds]), groups + ROTORS
    moving = slice(layout.velocity.start, layout.bend_rate.stop)
    # Unit wrenches would be lost in the rounding of a large vehicle's accelerations.
    scale, runs = _scale_of_inputs(vehicle, len(rows)), len(rows)
    units = np.vstack([np.zeros(layout.coordinates), np.eye(layout.coordinates)])
    inputs = np.zeros((len(units), runs, layout.inputs))
    inputs[..., layout.tip_wrench] = tip_wrench
    inputs[..., layout.push] = scale * units[:, None]
    if thrusts is not None:
        inputs[..., layout.of_input["rotor_command"]] = thrusts
    angles = branches_of(rows, layout)
    start = Start(*(np.tile(each, (len(units), 1)) for each in (state, angles)))
    acting = Drive(inputs.reshape(1, -1, layout.inputs), False, groups, gravity)
    rates = engine.derivative(start, acting, np.tile(np.arange(runs), len(units)))
    still, *responses = rates[:, moving].reshape(len(units), runs, -1)
    answers = [response - still for response in responses]
    return scale * np.linalg.solve(np.stack(answers, axis=-1), -still[..., None])[..., 0]


def _scale_of_inputs(vehicle: Vehicle, runs: int) -> Array:
    """Return scales (runs, coordinates) of forces, moments and bend moments, as in vibration."""
    sections = [section for arm in vehicle.arms for section in arm.section]
    if not sections:
        return np.ones((runs, vehicle.layout.coordinates))
    columns = []
    shared = [(1, sections[0], 3), (2, sections[0], 3)]
    for power, section, count in [*shared, *((3, each, each.coordinates) for each in sections)]:
        inertial = vehicle.mass * np.square(section.clamped_frequency) * section.length**power
        columns += [np.broadcast_to(inertial, runs)] * count
    return np.stack(columns, axis=-1)
