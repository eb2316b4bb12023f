"""The paper's closed-loop task: points whose centroid writes letters, seen from the arm's tip.

The letters and the 50 s are the paper's. It prints neither the points, a square of 0.5 m here, nor
their distance, nor where the flight starts: those are our choices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.controllers.controller import Controller
from continuair.equations.camera import facing
from continuair.errors import InputError, shown
from continuair.scenario import paths
from continuair.scenario.letters import LETTERS
from continuair.scenario.scenarios import Scenario
from continuair.scenario.targets import Target
from continuair.vehicle.arc import bend_vectors
from continuair.vehicle.vehicle import Vehicle

LETTER_HEIGHT = 0.8
"""Height of a letter [m]."""

START_OFFSET = (0.1, 0.0, 0.1)
"""How far off the camera starts: 0.1 m in x and z, our choice; the paper prints no start [m]."""

START_BEND = 0.1
"""Curvature at the start, along the world's x, as the image is [1/m]."""

STRUCTURAL_DAMPING = 0.03
"""Damping ratio that the task gives to an arm whose file has none: undamped arms ring for ever."""


_ANY_DIRECTION = 6
"""Rank of the wrench of rotors that push and turn in any direction."""


@dataclass(frozen=True)
class Setting:
    """A variant of the task: how long a letter takes [s], from when errors count [s], the camera.

    camera: fields of the vehicle's camera that this setting replaces.
    """

    duration: float
    settled: float
    camera: dict[str, float]
    meaning: str


_OWN = "the vehicle's own camera: perfect, and at the control rate, unless its file says otherwise"

SETTINGS = {
    "nominal": Setting(50.0, 5.0, {}, f"50 s a letter, {_OWN}"),
    "camera": Setting(
        50.0,
        5.0,
        {"noise": 0.5, "frame_rate": 30.0, "latency": 1.0 / 30.0},
        "50 s a letter, 0.5 px noise, 30 frames a second that arrive one frame late",
    ),
    "fast": Setting(10.0, 5.0, {}, f"10 s a letter, {_OWN}"),
}
"""The paper's task, the same through a real camera, and with a fast target."""


def chosen_letters(letters: Any) -> list[str]:
    """The letters of a string, once each and in its order, or InputError."""
    if not isinstance(letters, str):
        raise InputError(f"letters is {shown(letters)}; use some of {''.join(LETTERS)}.")
    return checks.choices("letters", list(letters.upper()), LETTERS)


def equipped(vehicle: Vehicle, setting: Setting) -> Vehicle:
    """The vehicle with the setting's camera, and with some damping where a section has none."""
    changes: dict[str, Any] = {f"camera.{name}": value for name, value in setting.camera.items()}
    changes |= {f"{path}.damping_ratio": STRUCTURAL_DAMPING for path in _undamped(vehicle)}
    return vehicle.replace(changes) if changes else vehicle


def damping_notes(vehicle: Vehicle) -> list[str]:
    """What is to be told of sections that `equipped` damps."""
    if not (paths := _undamped(vehicle)):
        return []
    return [
        f"Tracking is flown with a damping ratio of {STRUCTURAL_DAMPING:g} of {', '.join(paths)}, "
        "which has none of its own; give one, however small, in its place."
    ]


def noise_notes(vehicle: Vehicle) -> list[str]:
    """What is to be told of flights behind a camera with noise, all of one seed."""
    if not (noise := vehicle.camera.noise):
        return []
    return [
        f"The camera's noise of {noise:g} px is one draw of it, the same in all flights: with "
        "another one flights that end well may be lost, and others not."
    ]


def _undamped(vehicle: Vehicle) -> list[str]:
    """Paths of sections without damping."""
    if not vehicle.has_arm_list:
        return [] if np.any(vehicle.arm.structural_damping) else ["arm"]
    return [
        f"arm.{arm.name}.section.{section.name}"
        for arm in vehicle.arms
        for section in arm.section
        if not np.any(section.structural_damping)
    ]


def without_rotors(vehicle: Vehicle) -> tuple[Vehicle, list[str]]:
    """The vehicle as the law can fly it, and what is to be told of that.

    The law asks for forces and moments in any direction, which few rotors give.
    """
    rotors = vehicle.uav.rotors
    if rotors is None or rotors.rank >= _ANY_DIRECTION:
        return vehicle, []
    note = (
        "Tracking is flown without rotors: its law asks for forces in any direction; with these "
        "rotors, ca.twist_servoing tracks."
    )
    return vehicle.replace({"uav.rotors": None}), [note]


def along_x(vehicle: Vehicle, euler: Any) -> float:
    """The angle ψa in which the camera's arm bends along the world's x, at Euler angles (3,).

    A camera in the Frenet frame turns with it, and faces its target at 0.
    """
    if vehicle.camera.tip_frame == "frenet":
        return 0.0
    turn = Rotation.from_euler("ZYX", euler[::-1])
    if vehicle.has_arm_list:
        turn *= Rotation.from_quat(vehicle.arms[vehicle.camera_arm].attitude)
    x, y, _ = turn.inv().apply([1.0, 0.0, 0.0])
    return float(np.arctan2(y, x))


def task(
    vehicle: Vehicle,
    letters: Sequence[str],
    controller: Controller,
    duration: float | Sequence[float],
    *,
    off: bool = True,
) -> Scenario:
    """A batch that flies each letter once with its own row of the controller's gains, or one.

    duration: of a letter [s], one for all or one each; the target rests at the end of its own. off:
    whether it starts START_OFFSET and START_BEND off, and not where the image is the desired one.
    Raises InputError.
    """
    durations = np.broadcast_to(duration, len(letters)).tolist()
    targets = [
        Target(paths.letter(name, LETTER_HEIGHT, each))
        for name, each in zip(letters, durations, strict=True)
    ]
    q = np.zeros((len(letters), vehicle.layout.coordinates))
    for row, target in zip(q, targets, strict=True):
        centroid = target.path([0.0])[0][0]
        row[:3], row[3:6] = facing(vehicle, centroid, target.distance)
        if not off:
            continue
        row[:3] += START_OFFSET
        if not vehicle.arms:
            continue
        first = sum(vehicle.shape[: vehicle.camera_arm])
        bends = bend_vectors(row[vehicle.layout.polar])[
            first : first + vehicle.shape[vehicle.camera_arm]
        ]
        bends[:] = START_BEND, along_x(vehicle, row[3:6])
    return Scenario(
        f"tracking {''.join(letters)}",
        q,
        controller=controller,
        target=targets,
        duration=max(durations),
    )
