"""Rotors of a flight: their initial speeds, and default commands."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.engine.engine import Engine
from continuair.errors import CannotHover, InputError, shown
from continuair.flight.holding import holding
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.layout import Layout
from continuair.vehicle.rotors import Rotors
from continuair.vehicle.vehicle import Vehicle

# Digits relative to the largest thrust, as the solver's last bits depend on the BLAS library.
_DIGITS = 12

# The wash of real rotors cancels up to a tenth of the thrust: each iteration gains a digit.
_ROUNDS = 40


def check_air_and_rotors(vehicle: Vehicle, scenario: Scenario, layout: Layout) -> None:
    """Raise InputError unless a vehicle has the drag and rotors that a scenario uses."""
    if scenario.wind is not None and not layout.air:
        raise InputError(
            "wind",
            "is given, but the vehicle has no drag",
            (
                "omit it, or give the vehicle a table [uav.drag], its rotors hub_drag, or "
                "a section a drag_coefficient"
            ),
        )
    for name in ("rotor_command", "rotor_thrust"):
        _check_count(name, getattr(scenario, name), layout.rotors)
    if vehicle.uav.rotors is not None:
        _check_start(vehicle.uav.rotors.highest, scenario.rotor_thrust)
        _check_rank(vehicle.uav.rotors.rank, scenario.controller)


def _check_count(name: str, value: Any, rotors: int) -> None:
    """Raise InputError unless there is a thrust for each rotor."""
    given = value(0.0) if callable(value) else value
    if given is None or np.shape(given)[-1] == rotors:
        return
    raise InputError(
        f"scenario.{name}",
        f"has {np.shape(given)[-1]} thrusts, but the vehicle has {rotors or 'no'} rotors",
        "give one for each" if rotors else "omit it",
    )


def _check_start(highest: Array, thrust: Any) -> None:
    """Raise InputError if an initial thrust is beyond the limit."""
    if thrust is None:
        return
    beyond = np.argwhere(thrust > highest)
    if len(beyond):
        limit = np.broadcast_arrays(highest, thrust)[0][tuple(beyond[0])]
        raise InputError(
            "scenario.rotor_thrust",
            f"is {shown(thrust)}",
            f"give at most the limit of rotor {beyond[0][-1]}, {shown(limit)} N",
        )


def _check_rank(rank: int, law: Any) -> None:
    """Raise InputError if a controller needs forces that the rotors cannot produce."""
    if law is not None and law.asks is not None and rank < law.asks:
        raise InputError(
            "controller",
            f"{law.name} needs a wrench of rank 6, but the rotors give rank {rank}",
            "use tilted rotors (hex_tilted), another controller, or no [uav.rotors]",
        )


def with_rotors_running(engine: Engine, scenario: Scenario) -> Scenario:
    """Return the scenario with initial rotor thrusts, and a hovering command if nothing else acts.

    Raises InputError if hovering thrusts would exceed the limits.
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
            highest = engine.vehicle.uav.rotors.highest
            # With a controller it adds to the controller's command, which hovers at first.
            start = np.clip(given if hover is None else hover + given, 0.0, highest)
    return scenario.replace(rotor_thrust=start, rotor_command=hover if alone else command)


def rotor_speeds(vehicle: Vehicle, scenario: Scenario) -> Array:
    """Return the initial speeds (runs or 1, rotors), over the largest; none without rotors."""
    if vehicle.uav.rotors is None:
        return np.zeros((1, 0))
    return np.atleast_2d(vehicle.uav.rotors.speeds_of(np.asarray(scenario.rotor_thrust)))


def still(vehicle: Vehicle) -> dict[str, Array]:
    """Return the rotor_command at which rotors are at rest, beside direct forces.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.

    Returns
    -------
    dict of str to ndarray
        ``rotor_command`` of zeros, or nothing without rotors.
    """
    rotors = vehicle.uav.rotors
    return {} if rotors is None else {"rotor_command": np.zeros(rotors.count)}


def lag_rate(vehicle: Vehicle) -> Any:
    """Return the faster rate (runs or 1) [1/s] at which rotors follow commands; 0 without lag."""
    rotors = vehicle.uav.rotors
    lag = np.zeros(1) if rotors is None else np.minimum(*rotors.lags)
    return np.divide(1.0, lag, out=np.zeros_like(lag), where=lag > 0.0)


def _hover(engine: Engine, scenario: Scenario, alone: bool) -> Array:
    """Return thrusts (rotors,) or (runs, rotors) [N] of a level hover, arms bent as at the start.

    Raises InputError if a thrust exceeds its limit, or if thrusts without other inputs leave a
    sideways force.
    """
    rotors = engine.vehicle.uav.rotors
    assert rotors is not None
    level = np.atleast_2d(scenario.q).copy()
    # Forces of terms may depend on where the vehicle is, and which way it looks.
    level[:, 3:5] = 0.0
    carrying = _carrying(engine, level, scenario.gravity)
    if not np.isfinite(carrying).all():
        raise InputError(
            "scenario.q", "bends a section beyond a full circle", "start with a smaller bend"
        )
    if alone:
        _check_level(rotors, carrying)
    thrusts = _against_wash(engine, level, scenario.gravity, carrying)
    rounded = rotors.highest * np.round(thrusts / rotors.highest, _DIGITS)
    _check_hover(rotors, rounded)
    plain = engine.vehicle.runs is None and np.ndim(scenario.q) == 1
    return rounded[0] if plain else rounded


def hovering_thrusts(engine: Engine, rows: Array, gravity: float) -> tuple[Array, Array]:
    """Return thrusts (runs, rotors) [N] of a level hover at q (runs, coordinates), without limits.

    The wash on the arms is included. The second result is the sideways force (runs,) [N] that
    tilted rotors leave, so that the vehicle does not hover at the start of a flight.
    """
    rotors, carrying = engine.vehicle.uav.rotors, _carrying(engine, rows, gravity)
    assert rotors is not None
    return _against_wash(engine, rows, gravity, carrying), rotors.sideways(carrying)


def _carrying(engine: Engine, rows: Array, gravity: float, thrusts: Array | None = None) -> Array:
    """Return thrusts (runs, rotors) [N] that hold a level vehicle, beside others and their wash."""
    rotors = engine.vehicle.uav.rotors
    assert rotors is not None
    wrench = holding(engine, rows, gravity, thrusts=thrusts)[:, :6]
    yaw = np.broadcast_to(rows[:, 5], len(wrench))
    x, y = wrench[:, 0].copy(), wrench[:, 1].copy()
    # The force is in world axes, and rotors push in those of the body.
    wrench[:, 0] = np.cos(yaw) * x + np.sin(yaw) * y
    wrench[:, 1] = np.cos(yaw) * y - np.sin(yaw) * x
    return rotors.thrusts_for(wrench)


def _against_wash(engine: Engine, rows: Array, gravity: float, thrusts: Array) -> Array:
    """Return thrusts (runs, rotors) [N] that compensate their own wash.

    Each iteration leaves the share of the missing force that the wash cancels. Level rotors cannot
    compensate its sideways part.
    """
    rotors = engine.vehicle.uav.rotors
    assert rotors is not None
    highest = rotors.highest
    for _ in range(_ROUNDS if engine.tree.stirred else 0):
        given = np.clip(thrusts, 0.0, highest)
        missing = _carrying(engine, rows, gravity, given)
        thrusts = given + missing
        if (np.abs(missing) < 10.0**-_DIGITS * highest).all():
            break
    return thrusts


def _check_level(rotors: Rotors, thrusts: Array) -> None:
    """Raise InputError if tilted rotors leave a sideways force on a level vehicle."""
    aside = rotors.sideways(thrusts)
    worst = int(np.argmax(aside))
    if aside[worst] > 0.0:
        where = f" in run {worst}" if len(thrusts) > 1 else ""
        raise InputError(
            "uav.rotors",
            f"are tilted: a level hover{where} leaves a sideways force of {aside[worst]:.3g} N",
            "give the scenario a rotor_command or a controller",
        )


def _check_hover(rotors: Rotors, thrusts: Array) -> None:
    """Raise CannotHover if hovering needs a thrust beyond a rotor's limits."""
    highest = np.broadcast_to(rotors.highest, thrusts.shape)
    wrong = (thrusts < 0.0) | (thrusts > highest)
    if wrong.any():
        run, rotor = np.argwhere(wrong)[0]
        where = f" in run {run}" if len(thrusts) > 1 else ""
        raise CannotHover(
            rotors.limits_field(int(rotor)),
            (
                f"allow up to {highest[run, rotor]:g} N, but hover needs "
                f"{thrusts[run, rotor]:.4g} N of rotor {rotor}{where}"
            ),
            "give a rotor_command, or stronger rotors",
        )
