"""Starts of servoing: off along one direction at a time, and at random, with all points in view."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from continuair import Target, Vehicle
from continuair.equations import camera_pose, euler_angles, facing, in_view
from continuair.errors import InputError
from continuair.scenario import along_x
from continuair.vehicle import COORDINATES

Array = np.ndarray

_DEGREE = np.pi / 180.0
_TRIES = 100
"""Largest number of random draws per start."""

_STEEPEST = np.pi / 3.0
"""Tilt with which a vehicle may have to face the target, at most [rad]."""

_EDGE = 1e-5
"""Share by which points must be nearer to the optical axis than the image's edge: more than an arm
that is as good as straight turns the camera."""

_STRAIGHT = 1e-6
"""Bend of an arm that is as good as straight [1/m]."""


@dataclass(frozen=True)
class Direction:
    """A coordinate of q that is off, by values in a unit of so many metres, radians or 1/m."""

    coordinate: str
    unit: str
    size: float
    values: tuple[float, ...]


_METRES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_TILTS = (2.0, 5.0, 8.0, 10.0, 12.0, 15.0, 18.0, 20.0)
DIRECTIONS = {
    "+x": Direction("x", " m", 1.0, _METRES),
    "-x": Direction("x", " m", -1.0, _METRES),
    "y": Direction("y", " m", 1.0, _METRES),
    "up": Direction("z", " m", 1.0, (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)),
    "down": Direction("z", " m", -1.0, (0.25, 0.5, 0.75, 1.0, 1.25)),
    "roll": Direction("roll", "°", _DEGREE, _TILTS),
    "+pitch": Direction("pitch", "°", _DEGREE, _TILTS),
    "-pitch": Direction("pitch", "°", -_DEGREE, _TILTS),
    "yaw": Direction("yaw", "°", _DEGREE, (5, 10, 15, 20, 30, 45, 60, 90, 120, 150, 180)),
    "bend": Direction("kappa", " 1/m", 1.0, (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)),
}
"""Directions in which starts are off, from near to far; of y, roll and yaw one side alone, which
the other mirrors where the vehicle is symmetric about the world's plane of x and z as it faces the
target. It does so with the image's x along the world's."""

BENDS = (0.0, 0.1)
"""Curvatures with which the starts of a direction are bent besides [1/m]."""

SIDEWAYS, HEIGHT, TILT, YAW, BEND = 0.8, (-0.3, 1.5), 15.0 * _DEGREE, 120.0 * _DEGREE, 0.5
"""Random starts: how far off at most to the side [m], in height [m], by tilt and by yaw to either
side [rad], and how bent [1/m], towards anywhere."""


RANDOM = "random"
"""The direction of starts at random."""


def starts(vehicle: Vehicle, target: Target, runs: int, seed: int) -> xr.Dataset:
    """Return all starts q (start, coordinate), at rest, with visibility and centre.

    Visibility is whether all points are in view there; starts are offset from the centre
    (coordinate). Coordinates of `start`: direction, off_by in its unit, and start_bend [1/m]; NaN
    of the random ones. Raises InputError if the camera's view is too small for them.
    """
    centre = centred(vehicle, target)
    bent = along_x(vehicle, centre[3:6])
    ladders = list(product(DIRECTIONS, BENDS))
    q = [_off_along(DIRECTIONS[name], bend, centre, bent) for name, bend in ladders]
    names = [name for name, _ in ladders for _ in DIRECTIONS[name].values]
    bends = [bend for name, bend in ladders for _ in DIRECTIONS[name].values]
    values = [value for name, _ in ladders for value in DIRECTIONS[name].values]
    seen = visible(vehicle, target, np.concatenate(q))
    drawn, nothing = _at_random(vehicle, target, centre, runs, seed), [np.nan] * runs
    return xr.Dataset(
        {
            "q": (("start", "coordinate"), np.concatenate([*q, drawn])),
            "centre": ("coordinate", centre),
            "visible": ("start", np.append(seen, np.ones(runs, bool))),
        },
        {
            "coordinate": list(COORDINATES),
            "direction": ("start", names + [RANDOM] * runs),
            "off_by": ("start", np.array(values + nothing, float)),
            "start_bend": ("start", np.array(bends + nothing), {"units": "1/m"}),
        },
    )


def centred(vehicle: Vehicle, target: Target) -> Array:
    """Return the start (8,) whose image is the desired one, the arm straight.

    Raises InputError for a vehicle that lies on its side there, or on its back.
    """
    q = np.zeros(len(COORDINATES))
    q[:3], q[3:6] = facing(vehicle, target.path([0.0])[0][0], target.distance)
    tilt = np.arccos(np.cos(q[3]) * np.cos(q[4]))
    if tilt > _STEEPEST:
        raise InputError(
            "vehicle",
            (
                f"{vehicle.name} tilts by {np.degrees(tilt):.3g}° to face the target, more "
                f"than {np.degrees(_STEEPEST):.3g}°"
            ),
            "give it a camera that points along the straight arm",
        )
    return q


def _off_along(direction: Direction, bend: float, centre: Array, bent: float) -> Array:
    """Return a start for every value of a direction off a centre, also bent [1/m] towards an angle.

    All are along the world's axes, as the image is.
    """
    off = np.zeros((len(direction.values), len(COORDINATES)))
    off[:, COORDINATES.index("kappa")] = bend
    off[:, COORDINATES.index(direction.coordinate)] += direction.size * np.array(direction.values)
    q = centre + off
    q[:, 3:6] = _turned(centre, Rotation.from_euler("ZYX", off[:, 5:2:-1]))
    q[:, 7] = bent
    return np.asarray(q)


def _turned(centre: Array, off: Rotation) -> Array:
    """Return Euler angles (runs, 3) of a centre that is turned about the world's axes."""
    turned = off * Rotation.from_euler("ZYX", centre[5:2:-1])
    return euler_angles(turned.as_matrix())


def _at_random(vehicle: Vehicle, target: Target, centre: Array, runs: int, seed: int) -> Array:
    """Return so many random starts with all points in view, or raise InputError."""
    rng = np.random.default_rng(seed)
    found: list[Array] = []
    for _ in range(_TRIES):
        q = _drawn(centre, runs, rng)
        found.append(q[visible(vehicle, target, q)])
        if sum(map(len, found)) >= runs:
            return np.concatenate(found)[:runs]
    raise InputError(
        "vehicle",
        f"{vehicle.name} sees all target points from fewer than one in {_TRIES} random starts",
        "give its camera a wider view",
    )


def _drawn(centre: Array, runs: int, rng: np.random.Generator) -> Array:
    """Return random starts over the disc, the heights, the tilts, the yaws and the bends.

    They are uniform, and offset from a centre.
    """
    share, way, height, tilt, lean, yaw, bend, towards = rng.random((8, runs))
    q = np.tile(centre, (runs, 1))
    away, around = SIDEWAYS * np.sqrt(share), 2.0 * np.pi * way
    q[:, 0] += away * np.cos(around)
    q[:, 1] += away * np.sin(around)
    q[:, 2] += HEIGHT[0] + (HEIGHT[1] - HEIGHT[0]) * height
    angle, axis = TILT * np.sqrt(tilt), 2.0 * np.pi * lean
    leaning = np.stack([angle * np.cos(axis), angle * np.sin(axis), np.zeros(runs)], axis=-1)
    turning = Rotation.from_rotvec(np.outer(YAW * (2.0 * yaw - 1.0), [0.0, 0.0, 1.0]))
    q[:, 3:6] = _turned(centre, Rotation.from_rotvec(leaning) * turning)
    q[:, 6], q[:, 7] = BEND * bend, np.pi * (2.0 * towards - 1.0)
    return q


def visible(vehicle: Vehicle, target: Target, q: Array) -> Array:
    """Return whether the camera has all points of the target in view at starts (runs, 8)."""
    points = target.path([0.0])[0][0] + target.points
    # The equations bend a straight arm by kappa_s (Remark 1), which the flight does not.
    regular = vehicle.replace({"arm.kappa_s": _STRAIGHT})
    found = []
    for row in q:
        at, axes = camera_pose(regular, row)
        seen = (points - at) @ axes
        depth = np.where(seen[:, 2] > 0.0, seen[:, 2], np.inf)
        image = (seen[:, :2] / depth[:, None]).ravel()
        # On the very edge the flight may decide otherwise than what is all but straight.
        found.append(bool(in_view(vehicle.camera, (1.0 + _EDGE) * image, seen[:, 2]).all()))
    return np.array(found)
