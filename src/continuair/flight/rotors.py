"""Rotors of a flight: what they start at and what commands them where nothing else does."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.engine.engine import Engine
from continuair.errors import CannotHover, InputError, shown
from continuair.flight.holding import holding
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import Layout
from continuair.vehicle.rotors import Rotors
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

# Of the greatest thrust. The last bits of the solver are others where another BLAS is.
_DIGITS = 12

# The wash of real rotors takes back up to a tenth: a digit is gained in a round.
_ROUNDS = 40


def check_air_and_rotors(vehicle: Vehicle, scenario: Scenario, layout: Layout) -> None:
    """Raise InputError unless a vehicle has what a scenario gives wind and commands to."""
    if scenario.wind is not None and not layout.air:
        raise InputError(
            "wind is given, but the vehicle has no drag for it to act on; leave it out, or give "
            "the vehicle a table [uav.drag], its rotors hub_drag, or a section a drag_coefficient."
        )
    for name in ("rotor_command", "rotor_thrust"):
        _check_count(name, getattr(scenario, name), layout.rotors)
    if vehicle.uav.rotors is not None:
        _check_start(vehicle.uav.rotors.highest, scenario.rotor_thrust)
        _check_rank(vehicle.uav.rotors.rank, scenario.controller)


def _check_count(name: str, value: Any, rotors: int) -> None:
    given = value(0.0) if callable(value) else value
    if given is None or np.shape(given)[-1] == rotors:
        return
    many = f"{rotors} rotors; give one for each" if rotors else "no rotors; leave it out"
    held = np.shape(given)[-1]
    raise InputError(f"scenario.{name} holds {held} thrusts, but the vehicle has {many}.")


def _check_start(highest: Any, thrust: Any) -> None:
    if thrust is not None and (thrust > np.asarray(highest)[..., None]).any():
        raise InputError(
            f"scenario.rotor_thrust is {shown(thrust)}, but a rotor gives {shown(highest)} N at "
            "the most; give less."
        )


def _check_rank(rank: int, law: Any) -> None:
    if law is not None and rank < law.asks:
        raise InputError(
            f"controller {law.name} asks for forces in any direction, but the rotors give a wrench "
            f"of rank {rank}, not 6; give rotors that are tilted, such as hex_tilted, a controller "
            "that turns the vehicle, or a vehicle without [uav.rotors]."
        )


def with_rotors_running(engine: Engine, scenario: Scenario) -> Scenario:
    """The scenario with the thrusts that rotors start at, and those that hold the vehicle where
    nothing commands them.

    Raises InputError where thrusts that it does not give would be beyond the limits.
    """
    if engine.vehicle.uav.rotors is None:
        return scenario
    start, command = scenario.rotor_thrust, scenario.rotor_command
    guided = scenario.controller is not None
    alone = not guided and command is None
    hover = None
    if alone or (start is None and (command is None or guided)):
        hover = _hover(engine, scenario, alone)
    if start is None:
        start = hover
        if command is not None:
            given = np.asarray(command(0.0) if callable(command) else command, float)
            highest = np.asarray(engine.vehicle.uav.rotors.highest)[..., None]
            # Beside a controller it adds to what that asks for, which hovers at first.
            start = np.clip(given if hover is None else hover + given, 0.0, highest)
    return scenario.replace(rotor_thrust=start, rotor_command=hover if alone else command)


def rotor_speeds(vehicle: Vehicle, scenario: Scenario) -> Array:
    """Speeds (runs or 1, rotors), over the greatest, that rotors start at; without rotors none."""
    if vehicle.uav.rotors is None:
        return np.zeros((1, 0))
    return np.atleast_2d(vehicle.uav.rotors.speeds_of(np.asarray(scenario.rotor_thrust)))


def still(vehicle: Vehicle) -> dict[str, Array]:
    """The rotor_command, if there are rotors, that leaves them at rest beside direct forces."""
    rotors = vehicle.uav.rotors
    return {} if rotors is None else {"rotor_command": np.zeros(rotors.count)}


def lag_rate(vehicle: Vehicle) -> Any:
    """The faster rate (runs or 1) [1/s] at which rotors follow their commands; 0 where they do at
    once."""
    rotors = vehicle.uav.rotors
    lag = np.zeros(1) if rotors is None else np.minimum(*rotors.lags)
    return np.divide(1.0, lag, out=np.zeros_like(lag), where=lag > 0.0)


def _hover(engine: Engine, scenario: Scenario, alone: bool) -> Array:
    """Thrusts (rotors,) or (runs, rotors) [N] that hold the vehicle level, arms bent as they start.

    Raises InputError if a rotor cannot give its own, or if thrusts that nothing else commands push
    sideways.
    """
    rotors = engine.vehicle.uav.rotors
    assert rotors is not None
    level = np.atleast_2d(scenario.q).copy()
    level[:, :6] = 0.0
    carrying = _carrying(engine, level, scenario.gravity)
    if alone:
        _check_level(rotors, carrying)
    thrusts = _against_wash(engine, level, scenario.gravity, carrying)
    highest = per_run(rotors.thrust_limits, len(thrusts), 2)[:, 1:]
    rounded = highest * np.round(thrusts / highest, _DIGITS)
    _check_hover(rotors.thrust_limits, rounded)
    plain = engine.vehicle.runs is None and np.ndim(scenario.q) == 1
    return rounded[0] if plain else rounded


def hovering_thrusts(engine: Engine, rows: Array, gravity: float) -> tuple[Array, Array]:
    """Thrusts (runs, rotors) [N] that hold a level vehicle at q (runs, coordinates), whatever their
    limits, although their wash pushes its arms, too; and the force (runs,) [N] with which rotors
    that lean would push it sideways, so that it does not hover as a flight begins."""
    rotors, carrying = engine.vehicle.uav.rotors, _carrying(engine, rows, gravity)
    assert rotors is not None
    return _against_wash(engine, rows, gravity, carrying), rotors.sideways(carrying)


def _carrying(engine: Engine, rows: Array, gravity: float, thrusts: Array | None = None) -> Array:
    """Thrusts (runs, rotors) [N] that hold a level vehicle, beside others and their wash."""
    rotors = engine.vehicle.uav.rotors
    assert rotors is not None
    return rotors.thrusts_for(holding(engine, rows, gravity, thrusts=thrusts)[:, :6])


def _against_wash(engine: Engine, rows: Array, gravity: float, thrusts: Array) -> Array:
    """Thrusts that make up for what their own wash takes from others (runs, rotors) [N].

    Each round leaves of what is missing the share that the wash takes back. What the wash pushes
    sideways level rotors cannot hold.
    """
    rotors = engine.vehicle.uav.rotors
    assert rotors is not None
    highest = per_run(rotors.thrust_limits, len(thrusts), 2)[:, 1:]
    for _ in range(_ROUNDS if engine.tree.stirred else 0):
        given = np.clip(thrusts, 0.0, highest)
        missing = _carrying(engine, rows, gravity, given)
        thrusts = given + missing
        if (np.abs(missing) < 10.0**-_DIGITS * highest).all():
            break
    return thrusts


def _check_level(rotors: Rotors, thrusts: Array) -> None:
    """Raise InputError if rotors that lean push a level vehicle sideways."""
    aside = rotors.sideways(thrusts)
    worst = int(np.argmax(aside))
    if aside[worst] > 0.0:
        where = f" in run {worst}" if len(thrusts) > 1 else ""
        raise InputError(
            f"uav.rotors lean, so that to hover level{where} they would push sideways by "
            f"{aside[worst]:.3g} N; give the scenario a rotor_command or a controller."
        )


def _check_hover(limits: Any, thrusts: Array) -> None:
    """Raise CannotHover if hovering asks a rotor for what it cannot give."""
    highest = per_run(limits, len(thrusts), 2)[:, 1:]
    wrong = (thrusts < 0.0) | (thrusts > highest)
    if wrong.any():
        run, rotor = np.argwhere(wrong)[0]
        where = f" in run {run}" if len(thrusts) > 1 else ""
        raise CannotHover(
            f"uav.rotors.thrust_limits ends at {highest[run, 0]:g} N and no rotor pulls, but to "
            "hover with its arm as it starts the vehicle needs "
            f"{thrusts[run, rotor]:.4g} N of rotor {rotor}{where}; give the scenario a "
            "rotor_command, or the vehicle rotors that lift more."
        )
