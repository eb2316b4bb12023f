"""Hover: inputs that hold a level vehicle at rest, at a given bend or at its equilibrium."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from continuair import checks
from continuair.analysis.balance import balance
from continuair.engine.engine import Engine
from continuair.errors import InputError
from continuair.flight.holding import holding
from continuair.flight.rotors import still
from continuair.sections import of_coordinates
from continuair.typing import Array, ArrayLike
from continuair.vehicle.bending import bent_shares, check_bend, largest_bends
from continuair.vehicle.coordinates import bends_of, polar_of_bends
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle


@dataclass(frozen=True)
class Trim:
    """A hovering equilibrium.

    Parameters
    ----------
    q : ndarray, shape (8,)
        Paper coordinates.
    force : ndarray, shape (3,)
        Force in world axes [N].
    moment : ndarray, shape (3,)
        Moment about B's origin, in body axes [N m].
    bend_moment : ndarray, shape (2,)
        Generalised forces on the bends, two per section [N m²].
    """

    q: Array
    force: Array
    moment: Array
    bend_moment: Array


def trim(
    vehicle: Vehicle,
    *,
    bend: ArrayLike | None = None,
    yaw: float = 0.0,
    position: ArrayLike = (0.0, 0.0, 0.0),
    tip_wrench: ArrayLike = 0.0,
    gravity: float = 9.81,
) -> Trim:
    """Return the hovering equilibrium with a level base and rotors at rest.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    bend : array_like, shape (2,), optional
        Bend vectors to hold, two numbers per section [1/m]. Default: the stable equilibrium under
        gravity and `tip_wrench`, without bend moments.
    yaw : float, optional
        Yaw of the base [rad].
    position : array_like, shape (3,), optional
        Position of B's origin in world axes [m].
    tip_wrench : array_like, shape (6,), optional
        Force and moment on the tip in world axes, six per arm [N, N m]; 0 for none.
    gravity : float, optional
        Acceleration of gravity [m/s²].

    Returns
    -------
    Trim
        Coordinates, and the inputs that make every acceleration zero.

    Raises
    ------
    InputError
        If an argument cannot be used, or no stable equilibrium is found.

    Notes
    -----
    From straight arms in unstable equilibrium, the smaller of the two bends to either side is
    taken.

    Examples
    --------
    >>> print(f"{ca.trim(ca.load_vehicle('paper')).force[2]:.2f} N")
    25.67 N
    """
    check_single_vehicle(vehicle, strain=True)
    gravity = checks.gravity(gravity)
    heading = checks.row("yaw", yaw, 1)
    place = checks.vector("position", position, 3, or_zero=True)
    layout, engine = vehicle.layout, Engine(vehicle, "decoupled")
    on_tips = checks.vector("tip_wrench", tip_wrench, 6 * layout.arms, or_zero=True)

    def held(k: Array) -> tuple[Array, Array]:
        """Return paper coordinates (n, …) at bends (n, bends), and the inputs that hold them."""
        base = np.concatenate([place, [0.0, 0.0], heading])
        q = np.hstack([np.broadcast_to(base, (len(k), 6)), polar_of_bends(k, layout)])
        return q, holding(engine, q, gravity, on_tips)

    if bend is None:
        free = free_bend(vehicle, lambda k: held(k)[1][:, layout.bend_moment])
        if free is None:
            raise InputError(
                "gravity",
                "and tip_wrench: no stable equilibrium below a full circle was found",
                "reduce them, or give the bend",
            )
        k = free
    else:
        k = checks.vector("bend", bend, layout.bends)
        check_bend("bend", bend, k, vehicle)
    (q,), (inputs,) = held(k[None])
    bend_moment = np.zeros(layout.bends) if bend is None else inputs[layout.bend_moment]
    return Trim(q, inputs[layout.force], inputs[layout.moment], bend_moment)


def unit_springs(vehicle: Vehicle) -> Array:
    """Return roots of the stiffnesses (bends,), by which bends are scaled to springs of 1."""
    return np.sqrt(of_coordinates(vehicle, "stiffness")[0])


def free_bend(vehicle: Vehicle, needed: Callable[[Array], Array]) -> Array | None:
    """Return the equilibrium bend (bends,) [1/m] reached from straight arms, or None.

    needed: returns the bend moments (n, bends) [N m²] that hold bends (n, bends).
    """
    if not vehicle.arms:
        return np.zeros(0)
    unit = unit_springs(vehicle)
    found = balance(
        lambda x: needed(x / unit) / unit,
        largest_bends(vehicle) * unit,
        lambda x: bent_shares(vehicle, x / unit),
    )
    return None if found is None else np.asarray(found / unit)


def held_hover(vehicle: Vehicle, q: Array, gravity: float = 9.81) -> dict[str, Array]:
    """Return the inputs of `Scenario` that hold vehicles level and at rest, at a bend.

    force, moment and bend_moment, and the rotor_command at which rotors, if any, are at rest.
    vehicle: plain or batched; q: (8,) or (runs, 8) paper coordinates. As `trim`, for a batch.
    """
    held = holding(Engine(vehicle, "decoupled"), np.atleast_2d(q), gravity)
    held = held[0] if np.ndim(q) == 1 and vehicle.runs is None else held
    layout = vehicle.layout
    return still(vehicle) | {
        "force": held[..., layout.force],
        "moment": held[..., layout.moment],
        "bend_moment": held[..., layout.bend_moment],
    }


def configuration(name: str, q: ArrayLike | None, vehicle: Vehicle) -> Array:
    """Return paper coordinates with admissible bends, 0 by default, or raise InputError."""
    width = vehicle.layout.coordinates
    at = np.zeros(width) if q is None else checks.vector(name, q, width, or_zero=True)
    check_bend(name, at, bends_of(at, vehicle.layout), vehicle)
    return at
