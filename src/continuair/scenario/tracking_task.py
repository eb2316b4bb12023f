"""The paper's closed-loop task: a camera at the tip tracks points whose centroid writes letters.

The letters and the 50 s are the paper's. It gives neither the points (here a square of 0.5 m), nor
their distance, nor the initial state: those are our choices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
from continuair.typing import ArrayLike
from continuair.vehicle.bending import evenly_bent
from continuair.vehicle.vehicle import Vehicle

LETTER_HEIGHT = 0.8
"""Height of a letter [m]."""

START_OFFSET = (0.1, 0.0, 0.1)
"""Initial offset of the camera [m], in x and z: our choice, as the paper gives no start."""

START_BEND = 0.1
"""Initial curvature, along the world's x [1/m]."""

STRUCTURAL_DAMPING = 0.03
"""Damping ratio that the task gives to undamped arms, whose oscillations never decay."""


_ANY_DIRECTION = 6
"""Rank of the wrench of rotors that produce forces and moments in any direction."""


@dataclass(frozen=True)
class Setting:
    """A variant of the task.

    duration of a letter [s]; settled: time from which errors count [s]; camera: fields of the
    vehicle's camera that this variant replaces.
    """

    duration: float
    settled: float
    camera: dict[str, float]
    meaning: str


_OWN = "the vehicle's own camera: ideal, at the control rate, unless its file sets otherwise"

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
"""The paper's task, the same with a real camera, and with a fast target."""


def chosen_letters(letters: object) -> list[str]:
    """Return the letters of a string, once each, in order.

    Parameters
    ----------
    letters : str
        Letters of `LETTERS`, in either case.

    Returns
    -------
    list of str
        The letters, as capitals.

    Raises
    ------
    InputError
        If `letters` is not a string of these letters.
    """
    if not isinstance(letters, str):
        raise InputError("letters", f"is {shown(letters)}", f"use some of {''.join(LETTERS)}")
    return checks.choices("letters", list(letters.upper()), LETTERS)


def equipped(vehicle: Vehicle, setting: Setting) -> Vehicle:
    """Return the vehicle with a setting's camera, and damping where a section has none.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    setting : Setting
        Variant of the task.

    Returns
    -------
    Vehicle
        The vehicle, or a changed copy.
    """
    changes: dict[str, object] = {f"camera.{name}": value for name, value in setting.camera.items()}
    changes |= {f"{path}.damping_ratio": STRUCTURAL_DAMPING for path in _undamped(vehicle)}
    return vehicle.replace(changes) if changes else vehicle


def damping_notes(vehicle: Vehicle) -> list[str]:
    """Return a note on the sections that `equipped` damps.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle, before `equipped`.

    Returns
    -------
    list of str
        One note, or none if every section has damping.
    """
    if not (paths := _undamped(vehicle)):
        return []
    return [
        f"Tracking uses a damping ratio of {STRUCTURAL_DAMPING:g} for {', '.join(paths)}, whose "
        "file has none; give one to replace it."
    ]


def noise_notes(vehicle: Vehicle) -> list[str]:
    """Return a note that all flights share one realisation of the camera's noise.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.

    Returns
    -------
    list of str
        One note, or none if the camera has no noise.
    """
    if not (noise := vehicle.camera.noise):
        return []
    return [
        f"The camera's noise of {noise:g} px is one realisation, the same in all flights; with "
        "another seed, other flights may fail."
    ]


def _undamped(vehicle: Vehicle) -> list[str]:
    """Return the paths of sections without damping."""
    if not vehicle.has_arm_list:
        return [] if np.any(vehicle.arm.structural_damping) else ["arm"]
    return [
        f"arm.{arm.name}.section.{section.name}"
        for arm in vehicle.arms
        for section in arm.section
        if not np.any(section.structural_damping)
    ]


def without_rotors(vehicle: Vehicle) -> tuple[Vehicle, list[str]]:
    """Return the vehicle as the controller can fly it, and notes on the change.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.

    Returns
    -------
    vehicle : Vehicle
        Without its rotors, unless these produce forces and moments in any direction.
    notes : list of str
        One note if the rotors were removed.
    """
    rotors = vehicle.uav.rotors
    if rotors is None or rotors.rank >= _ANY_DIRECTION:
        return vehicle, []
    note = (
        "Tracking is flown without rotors: its controller needs forces in any direction; with "
        "these rotors, use ca.twist_servoing."
    )
    return vehicle.replace({"uav.rotors": None}), [note]


def along_x(vehicle: Vehicle, euler: ArrayLike) -> float:
    """Return the bend direction ψa that is the world's x axis for the camera's arm.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    euler : array_like, shape (3,)
        Roll, pitch and yaw of the base [rad].

    Returns
    -------
    float
        The direction [rad]; 0 for a camera in the Frenet frame, which turns with the arm.
    """
    if vehicle.camera.tip_frame == "frenet":
        return 0.0
    turn = Rotation.from_euler("ZYX", np.asarray(euler)[::-1])
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
    """Return a batch in which each run tracks one letter.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    letters : sequence of str
        Letter of each run.
    controller : Controller
        Controller with one set of gains, or one per run.
    duration : float or sequence of float
        Duration of a letter [s], one for all or one each. A target rests at the end of its letter.
    off : bool, default True
        Start with `START_OFFSET` and `START_BEND`, instead of at the desired image.

    Returns
    -------
    Scenario
        The batch, as long as the longest letter.

    Raises
    ------
    InputError
        If a letter or a duration cannot be used.
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
        sections = range(first, first + vehicle.shape[vehicle.camera_arm])
        bent = evenly_bent(vehicle, sections, START_BEND, along_x(vehicle, row[3:6]))
        row[vehicle.layout.polar] = bent[vehicle.layout.polar]
    return Scenario(
        f"tracking {''.join(letters)}",
        q,
        controller=controller,
        target=targets,
        duration=max(durations),
    )
