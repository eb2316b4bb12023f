"""The rigid and bending bodies of a vehicle over time, in world axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from continuair.analysis.backbone import (
    TIP,
    along,
    angle_of,
    parts,
    placed,
    quaternions,
    sections_of,
)
from continuair.equations.turns import of_quaternion
from continuair.interfaces.outline import radius_of, rotor_radius
from continuair.vehicle.vehicle import Vehicle

Array = NDArray[np.float64]

SEGMENTS = 32
"""Straight pieces that an arm is drawn as."""

_LEVER, _ROTOR = 0.28, 0.42
"""Of a UAV without rotors: their distance over the reach, and their radius over that distance."""

_HULL = np.array([0.36, 0.28, 0.13])
"""Half axes of the hull over the rotors' lever."""

_THINNEST = 0.009
"""Radius of a drawn arm over its length at least: thinner rods are not seen."""


@dataclass(frozen=True)
class Rotors:
    """Rotor disks in body axes: hubs (n, 3) [m], directions of thrust (n, 3), and radius [m]."""

    hubs: Array
    axes: Array
    radius: float

    @property
    def lever(self) -> float:
        """How far out the farthest hub is [m]."""
        return float(np.linalg.norm(self.hubs, axis=1).max())

    @property
    def hull(self) -> Array:
        """Half axes of the ellipsoid that is drawn amid them (3,) [m]."""
        return _HULL * self.lever

    @property
    def edge(self) -> float:
        """Radius of a sphere around the UAV [m]."""
        return self.lever + self.radius


@dataclass(frozen=True)
class Bodies:
    """A vehicle over frames; a flight that ends early stays where it ended.

    position (F, 3), attitude (F, 4), x y z w; lines: points along each arm (F, points, 3);
    segments: of all arms, middle (F, K, 3), attitude (F, K, 4), whose z is the tangent, length (K,)
    and radius (K,) [m]; angle: the bend angle of the section that each is in (F, K) [rad]; largest:
    bend angle of all sections (F,) [rad], also of one too short for a segment of its own; tips:
    position (F, arms, 3) and attitude (F, arms, 4).
    """

    position: Array
    attitude: Array
    lines: tuple[Array, ...]
    middle: Array
    turn: Array
    length: Array
    radius: Array
    angle: Array
    largest: Array
    tip_position: Array
    tip_attitude: Array

    def in_body(self, frame: int, points: Array) -> Array:
        """Return points (..., 3) of the world in the UAV's axes."""
        return (points - self.position[frame]) @ of_quaternion(self.attitude[frame])

    def turned_in_body(self, frame: int, attitudes: Array) -> Array:
        """Return attitudes (n, 4) x y z w in the world as those in the UAV's axes."""
        body = Rotation.from_quat(self.attitude[frame])
        return np.asarray((body.inv() * Rotation.from_quat(attitudes)).as_quat())


def bodies(vehicle: Vehicle, position: Array, attitude: Array, bend: Array) -> Bodies:
    """Place a vehicle; position (F, 3), attitude (F, 4), bend (F, bends)."""
    if not vehicle.arms:
        return _alone(vehicle, position, attitude)
    body = of_quaternion(attitude)[:, None]
    lines, frames, lengths, radii, angles, largest = [], [], [], [], [], []
    for arm, own in parts(vehicle, bend):
        points, turns = along(arm, own, 2 * SEGMENTS + 1)
        lines.append(placed(position, attitude, points))
        frames.append(body @ turns @ TIP)
        total = sum(section.length for section in arm.section)
        ends = np.cumsum([section.length for section in arm.section])
        inside = np.searchsorted(ends, (np.arange(SEGMENTS) + 0.5) * total / SEGMENTS)
        thick = [radius_of(section) for section in arm.section]
        lengths.append(np.full(SEGMENTS, total / SEGMENTS))
        radii.append(np.maximum(np.take(thick, inside), _THINNEST * total))
        turned = np.stack([angle_of(*each) for each in sections_of(arm, own)], axis=-1)
        angles.append(turned[:, inside])
        largest.append(turned.max(axis=1))
    return Bodies(
        position,
        attitude,
        tuple(line[:, ::2] for line in lines),
        np.concatenate([line[:, 1::2] for line in lines], axis=1),
        quaternions(np.concatenate([frame[:, 1::2] for frame in frames], axis=1)),
        np.concatenate(lengths),
        np.concatenate(radii),
        np.concatenate(angles, axis=1),
        np.max(largest, axis=0),
        np.stack([line[:, -1] for line in lines], axis=1),
        quaternions(np.stack([frame[:, -1] for frame in frames], axis=1)),
    )


def _alone(vehicle: Vehicle, position: Array, attitude: Array) -> Bodies:
    """Return a vehicle without arms, whose tip, with a camera, is where its arm would begin."""
    none, points = np.zeros(0), np.zeros((len(position), 0, 3))
    turns, angles = np.zeros((len(position), 0, 4)), np.zeros((len(position), 0))
    tip = placed(position, attitude, np.asarray(vehicle.uav.mount)[None])
    frames = quaternions(of_quaternion(attitude) @ TIP)[:, None]
    largest = np.zeros(len(position))
    return Bodies(position, attitude, (), points, turns, none, none, angles, largest, tip, frames)


def rotors_of(vehicle: Vehicle) -> Rotors:
    """Return the rotors of a vehicle; four of a likely size where it has none of its own."""
    rotors = vehicle.uav.rotors
    if rotors is None:
        lever = _LEVER * float(vehicle.reach)
        turn = np.radians([45.0, 135.0, 225.0, 315.0])
        hubs = lever * np.column_stack([np.cos(turn), np.sin(turn), np.full(4, 0.12)])
        return Rotors(hubs, np.tile([0.0, 0.0, 1.0], (4, 1)), _ROTOR * lever)
    return Rotors(rotors.hubs, rotors.axes, rotor_radius(rotors))
