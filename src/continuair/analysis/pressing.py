"""Where a vehicle hovers while the tip of its arm presses on an obstacle with a given force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from continuair import checks
from continuair.analysis.backbone import along_at
from continuair.analysis.balance import curvature
from continuair.analysis.nearest import nearest
from continuair.analysis.trim import free_bend, unit_springs
from continuair.engine.engine import Engine
from continuair.equations.turns import euler_angles
from continuair.errors import InputError, shown
from continuair.flight.holding import holding
from continuair.scenario.obstacles import SPOTS, Obstacle
from continuair.scenario.setpoints import Setpoints
from continuair.typing import Array, ArrayLike
from continuair.vehicle.bending import largest_bends
from continuair.vehicle.coordinates import polar_of_bends
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_single_vehicle

_OFF = 1e-6
"""Largest difference of the normal at the tip from that at the point."""


@dataclass(frozen=True)
class Pressing:
    """An equilibrium in which the tip of an arm presses on an obstacle.

    Parameters
    ----------
    setpoints : Setpoints
        Position of B's origin in world axes [m], and yaw [rad].
    q : ndarray, shape (coordinates,)
        Paper coordinates, with the tilt at which the thrust balances weight and contact.
    thrust : float
        Thrust along the body's z axis [N].
    depth : float
        Depth of the tip in the obstacle [m].
    """

    setpoints: Setpoints
    q: Array
    thrust: float
    depth: float


def pressing(
    vehicle: Vehicle,
    obstacle: Obstacle,
    force: float,
    *,
    point: ArrayLike,
    yaw: float = 0.0,
    gravity: float = 9.81,
) -> Pressing:
    """Return the set-point at which the tip of the arm presses on an obstacle with a force.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch) with one arm.
    obstacle : Obstacle
        The obstacle.
    force : float
        Normal force [N].
    point : array_like, shape (3,)
        Where the tip touches, in world axes [m]: the nearest point of the obstacle's surface.
    yaw : float, default 0.0
        Yaw of the set-point [rad].
    gravity : float, default 9.81
        Acceleration of gravity [m/s²].

    Returns
    -------
    Pressing
        Set-points, and the equilibrium there.

    Raises
    ------
    InputError
        If an argument cannot be used, the rotors are too weak, the arm has no stable equilibrium
        with this force at the point, or touches the obstacle with more than its tip.

    Notes
    -----
    The arm is free: without bend moments, its tendons at rest. `flight_controller` leaves it so
    with ``bend_bandwidth=0``. Its thrust acts along the body's z axis, so the vehicle tilts until
    the thrust balances weight and contact; its integral removes the error of the position. An error
    of the yaw stays if the force passes beside the body's z axis. Whether the loop is stable while
    the arm touches is not checked. There is no friction: while the arm slides on a rough obstacle,
    the force differs.

    Examples
    --------
    >>> roof = ca.Plane(normal=[-1.0, 0.0, 1.0])
    >>> held = ca.pressing(ca.load_vehicle("slender"), roof, 0.5, point=[0.0, 0.0, 0.0])
    >>> held.q[:3].round(3)
    array([0.03, 0.  , 1.  ])
    """
    check_has_arms(check_single_vehicle(vehicle, strain=True))
    if len(vehicle.arms) != 1:
        raise InputError("vehicle", f"has {len(vehicle.arms)} arms", "give one with a single arm")
    if not isinstance(obstacle, Obstacle):
        raise InputError("obstacle", f"is {shown(obstacle)}", "give a Plane, Sphere, Box, Cylinder")
    size, gravity = checks.positive("force", force, " [N]"), checks.gravity(gravity)
    heading = float(checks.row("yaw", yaw, 1)[0])
    centre, normal, depth = _tip_at(vehicle, obstacle, size, checks.vector("point", point, 3))
    thrust = np.array([0.0, 0.0, vehicle.mass * gravity]) - size * normal
    if not thrust[2] > 0.0:
        raise InputError(
            "force", f"is {size:g} N, which carries the whole vehicle", "give less than its weight"
        )
    _check_lift(vehicle, float(np.linalg.norm(thrust)))
    attitude = _attitude(thrust, heading)
    held = _Held(vehicle, attitude, gravity)
    k = free_bend(vehicle, lambda k: held.needed(k, size * normal))
    if k is None:
        raise _too_much(size, "under which the arm has no stable equilibrium")
    position = centre - held.tips(k[None])[0]
    _check_stable(held, obstacle, position, k, size)
    _check_free(held, obstacle, position, k)
    q = held.rows(k[None])[0]
    q[:3] = position
    return Pressing(
        Setpoints(position=position, yaw=heading), q, float(np.linalg.norm(thrust)), depth
    )


class _Held:
    """A vehicle at an attitude (3, 3), its arm at bends k (n, bends)."""

    def __init__(self, vehicle: Vehicle, attitude: Array, gravity: float) -> None:
        self.vehicle, self.attitude, self.gravity = vehicle, attitude, gravity
        self.engine = Engine(vehicle, "decoupled")

    def rows(self, k: Array) -> Array:
        """Return paper coordinates (n, …), with B's origin in that of the world."""
        base = np.concatenate([np.zeros(3), euler_angles(self.attitude)])
        q = polar_of_bends(k, self.vehicle.layout)
        return np.hstack([np.broadcast_to(base, (len(k), 6)), q])

    def needed(self, k: Array, force: Array) -> Array:
        """Return bend moments (n, bends) that hold the arm under forces on its tip (3,) or (n, 3),
        in world axes."""
        wrench = np.zeros((len(k), 6))
        wrench[:, :3] = force
        found = holding(self.engine, self.rows(k), self.gravity, wrench)
        return found[:, self.vehicle.layout.bend_moment]

    def arc_lengths(self) -> Array:
        """Return the arc lengths (places,) from the base at which the arm touches [m]."""
        (arm,) = self.vehicle.arms
        lengths = np.array([section.length for section in arm.section])
        begins = np.cumsum(lengths) - lengths
        return (begins[:, None] + lengths[:, None] * np.array(SPOTS)).ravel()

    def spots(self, k: Array) -> Array:
        """Return the places (n, places, 3) at which the arm touches, from B's origin."""
        (arm,) = self.vehicle.arms
        points, _ = along_at(arm, k, self.arc_lengths())
        return points @ self.attitude.T

    def tips(self, k: Array) -> Array:
        """Return the tips (n, 3), from B's origin."""
        return self.spots(k)[:, -1]


def _radii(vehicle: Vehicle) -> Array:
    """Return the radius of every place (places,) [m]."""
    sections = vehicle.arms[0].section
    each = [0.0 if part.given_radius is None else float(part.radius) for part in sections]
    return np.repeat(each, len(SPOTS))


def _tip_at(
    vehicle: Vehicle, obstacle: Obstacle, force: float, point: Array
) -> tuple[Array, Array, float]:
    """Return where the tip is (3,), the direction out of the obstacle (3,) and the tip's depth."""
    distance, normal = nearest(obstacle, point)
    depth = float((force / obstacle.stiffness) ** (2.0 / 3.0))
    out = float(_radii(vehicle)[-1]) - depth
    centre = point + (out - distance) * normal
    there, same = nearest(obstacle, centre)
    # A tip deeper than its radius is inside, where another face may be nearer.
    if not (abs(there - out) < _OFF and np.abs(same - normal).max() < _OFF):
        raise InputError(
            "point",
            f"is {shown(point.tolist())}, at an edge, which the tip leaves at {depth:.3g} m depth",
            "move it onto a face, or increase the stiffness",
        )
    return centre, normal, depth


def _check_lift(vehicle: Vehicle, thrust: float) -> None:
    """Raise InputError if a thrust [N] exceeds what all rotors give together along the body's z."""
    rotors = vehicle.uav.rotors
    if rotors is None:
        return
    most = float(rotors.greatest_lift)
    if thrust > most:
        raise InputError(
            "force",
            f"needs a thrust of {thrust:.4g} N, but the rotors give {most:.4g} N",
            "give less, or stronger rotors",
        )


def _attitude(thrust: Array, yaw: float) -> Array:
    """Return the flight controller's attitude (3, 3): z along the thrust, x towards the yaw."""
    z = thrust / np.linalg.norm(thrust)
    y = np.cross(z, [np.cos(yaw), np.sin(yaw), 0.0])
    y = y / np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])


def _check_stable(held: _Held, obstacle: Obstacle, position: Array, k: Array, force: float) -> None:
    """Raise InputError unless the arm stays on the obstacle, below a vehicle at rest."""
    unit, radius = unit_springs(held.vehicle), _radii(held.vehicle)[-1]

    def slope(x: Array) -> Array:
        distance, normal = nearest(obstacle, position + held.tips(x / unit))
        contact = obstacle.stiffness * np.maximum(radius - distance, 0.0) ** 1.5
        return held.needed(x / unit, contact[:, None] * normal) / unit

    curvatures = np.linalg.eigvalsh(curvature(slope, k * unit, largest_bends(held.vehicle) * unit))
    if not curvatures[0] > 0.0:
        raise _too_much(force, "with which the tip slips off the obstacle")


def _check_free(held: _Held, obstacle: Obstacle, position: Array, k: Array) -> None:
    """Raise InputError if the vehicle or its arm touches the obstacle with more than the tip."""
    if (nearest(obstacle, position)[0] < 0.0).any():
        raise InputError(
            "point",
            "and force: the vehicle is inside the obstacle",
            "move the point, or give a mount that faces the obstacle",
        )
    places = position + held.spots(k[None])[0, :-1]
    depths = _radii(held.vehicle)[:-1] - nearest(obstacle, places)[0]
    if (depths > 0.0).any():
        s, deepest = held.arc_lengths()[depths.argmax()], depths.max()
        raise InputError(
            "point",
            f"and force: the arm touches at {s:.3g} m of its length, too, {deepest:.2g} m deep",
            "move the point, turn the mount to the obstacle, or reduce the radius",
        )


def _too_much(force: float, why: str) -> InputError:
    return InputError(
        "force", f"is {force:g} N, {why}", "give less, a stiffer arm or another point"
    )
