"""Mismatches of a law: another vehicle, unknown loads, a real camera."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import Vehicle, dryden

Array = np.ndarray
Changes = dict[str, Any]

LINEAR_DRAG = 0.25
"""Drag of a vehicle that has none, where wind blows [N s/m]."""

_ALTITUDE, _DURATION = 10.0, 60.0
"""Height above ground of the wind [m], and how long it lasts [s]."""

_PERCENT, _DEGREE = 0.01, np.pi / 180.0

Way = tuple[float, float]

_ONE: dict[str, Way] = {"": (1.0, 0.0)}
_EITHER: dict[str, Way] = {"+": (1.0, 0.0), "-": (-1.0, 0.0)}
_AROUND: dict[str, Way] = {"+x": (1.0, 0.0), "-x": (-1.0, 0.0), "+y": (0.0, 1.0), "-y": (0.0, -1.0)}


@dataclass(frozen=True)
class Mistake:
    """A plant-model mismatch, by values in a unit, from small to large.

    vehicle(nominal, value, way): changed values of the simulated vehicle; scenario(value, way):
    loads on it. ways: directions in which it is tried, by name. alone: whether each value needs its
    own simulation, as runs of a batch cannot differ in it.
    """

    meaning: str
    unit: str
    values: tuple[float, ...]
    vehicle: Callable[[Vehicle, float, Way], Changes] = field(
        default=lambda nominal, value, way: {}
    )
    scenario: Callable[[float, Way], Changes] = field(default=lambda value, way: {})
    ways: Mapping[str, Way] = field(default_factory=lambda: _ONE)
    alone: bool = False


def _times(path: str, sign: float) -> Callable[[Vehicle, float, Way], Changes]:
    """Return a field of the vehicle, more or less by a percentage."""

    def changed(nominal: Vehicle, percent: float, way: Way) -> Changes:
        value = np.asarray(attrgetter(path)(nominal), float)
        return {path: value * (1.0 + sign * _PERCENT * percent)}

    return changed


def _tilted(nominal: Vehicle, degrees: float, way: Way) -> Changes:
    """Return the camera, turned about an axis across its line of sight."""
    return _turned(nominal, _DEGREE * degrees * np.array([*way, 0.0]))


def _rolled(nominal: Vehicle, degrees: float, way: Way) -> Changes:
    """Return the camera, turned about its line of sight."""
    return _turned(nominal, _DEGREE * degrees * np.array([0.0, 0.0, way[0]]))


def _turned(nominal: Vehicle, by: Array) -> Changes:
    turn = Rotation.from_rotvec(by)
    return {"camera.attitude": (Rotation.from_quat(nominal.camera.attitude) * turn).as_quat()}


def _moved(nominal: Vehicle, centimetres: float, way: Way) -> Changes:
    """Return the camera, moved across the tip's tangent."""
    return {"camera.position": nominal.camera.position + 0.01 * centimetres * np.array([*way, 0.0])}


def _off_centre(nominal: Vehicle, pixels: float, way: Way) -> Changes:
    return {"camera.principal_point": nominal.camera.principal_point + pixels * np.array(way)}


def _pushed(newtons: float, way: Way) -> Changes:
    return {"force": newtons * np.array([*way, 0.0])}


def _draggy(nominal: Vehicle, speed: float, way: Way) -> Changes:
    return {} if nominal.uav.drag is not None else {"uav.drag": {"linear": [LINEAR_DRAG] * 3}}


def _wind(speed: float, way: Way) -> Changes:
    """Return a random realisation of turbulence for each way."""
    wind = dryden(
        speed,
        _ALTITUDE,
        speed,
        seed=list(_AROUND.values()).index(way),
        mean=speed * np.array([*way, 0.0]),
        heading=float(np.arctan2(way[1], way[0])),
        duration=_DURATION,
    )
    return {"wind": wind}


def _late(nominal: Vehicle, milliseconds: float, way: Way) -> Changes:
    return {"camera.latency": nominal.camera.latency + _MILLI * milliseconds}


def _rarely(nominal: Vehicle, milliseconds: float, way: Way) -> Changes:
    """Return a camera that is slower by itself stays so."""
    own = nominal.camera.frame_rate or np.inf
    return {"camera.frame_rate": min(own, 1.0 / (_MILLI * milliseconds))}


def _noisy(nominal: Vehicle, pixels: float, way: Way) -> Changes:
    """Return noise of its own and this noise are independent."""
    return {"camera.noise": float(np.hypot(nominal.camera.noise, pixels))}


_SHARES = (5.0, 10.0, 20.0, 40.0)
_MILLI = 1e-3

MISTAKES = {
    "heavier": Mistake("the UAV is heavier", "%", (*_SHARES, 80.0), _times("uav.mass", 1.0)),
    "lighter": Mistake("the UAV is lighter", "%", _SHARES, _times("uav.mass", -1.0)),
    "stiffer": Mistake(
        "the arm is stiffer", "%", (20.0, 50.0, 100.0, 300.0), _times("arm.bending_stiffness", 1.0)
    ),
    "softer": Mistake(
        "the arm is softer", "%", (10.0, 20.0, 50.0, 80.0), _times("arm.bending_stiffness", -1.0)
    ),
    "longer": Mistake("the arm is longer", "%", _SHARES, _times("arm.length", 1.0)),
    "shorter": Mistake("the arm is shorter", "%", _SHARES, _times("arm.length", -1.0)),
    "camera tilted": Mistake(
        "the camera is tilted", "°", (1.0, 2.0, 5.0, 8.0, 12.0), _tilted, ways=_AROUND
    ),
    "camera rolled": Mistake(
        "the camera is turned about its axis",
        "°",
        (2.0, 5.0, 10.0, 20.0, 45.0),
        _rolled,
        ways=_EITHER,
    ),
    "camera moved": Mistake(
        "the camera sits elsewhere", " cm", (1.0, 2.0, 5.0, 10.0), _moved, ways=_AROUND
    ),
    "focal length": Mistake(
        "the focal length is longer", "%", _SHARES, _times("camera.focal_length", 1.0)
    ),
    "principal point": Mistake(
        "the image's centre is elsewhere",
        " px",
        (10.0, 20.0, 50.0, 100.0),
        _off_centre,
        ways=_AROUND,
    ),
    "side force": Mistake(
        "a steady force pushes the UAV sideways",
        " N",
        (0.1, 0.2, 0.5, 1.0, 2.0),
        scenario=_pushed,
        ways=_AROUND,
    ),
    "wind": Mistake(
        "wind blows, of that mean and with Dryden's turbulence",
        " m/s",
        (1.0, 2.0, 5.0, 10.0),
        _draggy,
        _wind,
        ways=_AROUND,
        alone=True,
    ),
    "latency": Mistake(
        "images arrive late",
        " ms",
        (5.0, 10.0, 20.0, 50.0, 100.0),
        _late,
        alone=True,
    ),
    "frames": Mistake(
        "there is an image only so often, or as rarely as its camera has one",
        " ms",
        (10.0, 20.0, 40.0, 80.0),
        _rarely,
        alone=True,
    ),
    "noise": Mistake(
        "the image is noisy",
        " px",
        (0.2, 0.5, 1.0, 2.0, 5.0),
        _noisy,
    ),
}
"""Mismatches by name. All else is known to the law. The worst way counts."""
