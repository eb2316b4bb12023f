"""Hover: the inputs that hold a vehicle at rest, level, at a bend or at the one that it takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.analysis.balance import balance
from continuair.engine.engine import Engine
from continuair.errors import InputError
from continuair.flight.holding import holding
from continuair.flight.rotors import still
from continuair.vehicle.arc import bend_vectors, polar_of
from continuair.vehicle.bending import check_bend, largest_bends
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle


@dataclass(frozen=True)
class Trim:
    """A hovering equilibrium: paper coordinates q (8,) and the inputs that hold it.

    force [N, world], moment [N m, body, about B's origin], bend_moment [N m²], of each section.
    """

    q: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    bend_moment: np.ndarray


def trim(
    vehicle: Vehicle,
    *,
    bend: Any = None,
    yaw: float = 0.0,
    position: Any = (0.0, 0.0, 0.0),
    tip_wrench: Any = 0.0,
    gravity: float = 9.81,
) -> Trim:
    """Hover with level base: the inputs that make every acceleration zero, with rotors at rest.

    bend: bend vector (2,) [1/m] to hold, of each section in turn, or None for the bend that
    straight arms sink into under gravity and tip_wrench (6,) [N, N m, world axes], of each arm in
    turn, with no bend moment; where straight arms would only just stand, the smaller of the two
    bends to either side that they fall into. Raises InputError.
    """
    check_single_vehicle(vehicle)
    gravity = checks.gravity(gravity)
    yaw, position = (
        float(checks.row("yaw", yaw, 1)[0]),
        checks.vector("position", position, 3, or_zero=True),
    )
    layout, engine = vehicle.layout, Engine(vehicle, "decoupled")
    tip_wrench = checks.vector("tip_wrench", tip_wrench, 6 * layout.arms, or_zero=True)

    def held(k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Paper coordinates (n, …) at bends k (n, bends), and the pushes that hold them."""
        x, y = np.moveaxis(bend_vectors(k), -1, 0)
        polar = np.stack([np.hypot(x, y), np.arctan2(y, x)], axis=-1).reshape(len(k), -1)
        base = np.concatenate([position, [0.0, 0.0, yaw]])
        q = np.hstack([np.broadcast_to(base, (len(k), 6)), polar])
        return q, holding(engine, q, gravity, tip_wrench)

    if bend is None:
        k = _free_bend(vehicle, lambda k: held(k)[1][:, layout.bend_moment])
    else:
        k = checks.vector("bend", bend, layout.bends)
        check_bend("bend", bend, np.linalg.norm(bend_vectors(k), axis=-1).ravel(), vehicle)
    (q,), (push,) = held(k[None])
    bend_moment = np.zeros(layout.bends) if bend is None else push[layout.bend_moment]
    return Trim(q, push[layout.force], push[layout.moment], bend_moment)


def _free_bend(vehicle: Vehicle, needed: Any) -> np.ndarray:
    """The bend (bends,) [1/m] that straight arms sink into, or InputError.

    needed: bend moments (n, bends) [N m²] that hold bends (n, bends).
    """
    sections = [section for arm in vehicle.arms for section in arm.section]
    if not sections:
        return np.zeros(0)
    length = np.array([each.length for each in sections])
    # Over √(E I l) moments and bends are those of springs of 1.
    of_sections = np.sqrt([each.bending_stiffness for each in sections] * length)
    unit = vehicle.layout.per_coordinate(of_sections)
    largest = largest_bends(vehicle) * of_sections
    found = balance(lambda x: needed(x / unit) / unit, largest)
    if found is None:
        raise InputError(
            "gravity and tip_wrench leave the arm no stable equilibrium below a full circle that "
            "is found; give less of them, or the bend to hold."
        )
    return np.asarray(found / unit)


def held_hover(vehicle: Vehicle, q: np.ndarray, gravity: float = 9.81) -> dict[str, Any]:
    """Return force, moment and bend_moment that keep vehicles at rest, level, at a bend, and the
    rotor_command that leaves rotors, if there are any, at rest.

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


def configuration(name: str, q: Any, vehicle: Vehicle) -> np.ndarray:
    """Paper coordinates (coordinates,) whose bends leave room, 0 by default, or InputError."""
    width = vehicle.layout.coordinates
    at = np.zeros(width) if q is None else checks.vector(name, q, width, or_zero=True)
    check_bend(name, at, np.abs(polar_of(at)[0]), vehicle)
    return at
