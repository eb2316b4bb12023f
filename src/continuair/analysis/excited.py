"""The arm that carries the camera, with the scales for excitations and reports.

For an [arm] table these are the section's own values. An arm of several sections is described by
the bending in which all sections have one curvature: each rotates by its share of the length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from continuair.controllers.inertias import bend_inertia
from continuair.sections import of_pairs
from continuair.typing import Array
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class ExcitedArm:
    """An arm and its scales, numbers or arrays over the runs of a batch.

    Parameters
    ----------
    index : int
        Index of the arm.
    places : range
        Indices of its sections among all.
    length : float or ndarray
        Length [m].
    frequency, damping_ratio : float or ndarray
        Of its lowest clamped mode without gravity [rad/s, 1].
    moments : ndarray, shape (..., sections)
        Generalised force on each bend [N m²], per angle by which they bend the arm at rest without
        gravity.
    stiffness : float or ndarray
        E I of a single section of the same length with the same tip angle under a lateral tip force
        [N m²].
    axes : ndarray, shape (..., 3, 3)
        Axes of its mount in body axes, as columns.
    """

    index: int
    places: range
    length: float | Array
    frequency: float | Array
    damping_ratio: float | Array
    moments: Array
    stiffness: float | Array
    axes: Array


def name_of_excited_arm(vehicle: Vehicle) -> str:
    """Return the excited arm in words: "arm", or "arm" and its name if there are several."""
    arms = vehicle.arms
    return "arm" if len(arms) == 1 else f"arm {arms[vehicle.camera_arm].name}"


def excited_arm(vehicle: Vehicle) -> ExcitedArm:
    """Return the arm that carries the camera, with its scales.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.

    Returns
    -------
    ExcitedArm
        The arm.
    """
    if not vehicle.has_arm_list:
        return _of_section(vehicle.arm)
    if vehicle.runs is None:
        return _of_chain(vehicle)
    each = [_of_chain(vehicle.select(run)) for run in range(vehicle.runs)]
    names = ("length", "frequency", "damping_ratio", "moments", "stiffness", "axes")
    stacked = {name: np.stack([getattr(one, name) for one in each]) for name in names}
    return ExcitedArm(each[0].index, each[0].places, **stacked)


def _of_section(arm: Section) -> ExcitedArm:
    """Return the arm of an [arm] table."""
    stiffness = np.asarray(arm.bending_stiffness)
    frequency = np.asarray(arm.clamped_frequency)
    return ExcitedArm(
        index=0,
        places=range(1),
        length=arm.length,
        frequency=arm.clamped_frequency,
        damping_ratio=np.asarray(arm.structural_damping) / (2.0 * stiffness / frequency),
        # Q acts on the bend, whose potential energy is E I l |k|² / 2.
        moments=stiffness[..., None],
        stiffness=stiffness,
        axes=np.eye(3),
    )


def _of_chain(vehicle: Vehicle) -> ExcitedArm:
    """Return the camera's arm of a vehicle with [[arm]]."""
    index, first = vehicle.camera_arm, sum(vehicle.shape[: vehicle.camera_arm])
    sections = vehicle.arms[index].section
    lengths = np.array([each.length for each in sections])
    stiffness = np.array([each.bending_stiffness for each in sections])
    length = lengths.sum()
    # Lateral motion of the tip per curvature of a section [m²].
    lever = lengths * (length - np.cumsum(lengths) + 0.5 * lengths)
    places = range(first, first + len(sections))
    frequency, damping_ratio = _lowest_mode(vehicle, places)
    return ExcitedArm(
        index=index,
        places=places,
        length=length,
        frequency=frequency,
        damping_ratio=damping_ratio,
        moments=stiffness * lengths / length,
        stiffness=0.5 * length**2 / np.sum(lever / stiffness),
        axes=Rotation.from_quat(vehicle.arms[index].attitude).as_matrix(),
    )


def _lowest_mode(vehicle: Vehicle, places: range) -> tuple[float, float]:
    """Return frequency [rad/s] and damping ratio of the lowest clamped mode of some sections."""
    layout = vehicle.layout
    of_arm = np.concatenate([np.arange(layout.bends)[layout.of_section[k]] for k in places])
    stiffness = of_pairs(vehicle, "stiffness")[0][np.ix_(of_arm, of_arm)]
    damping = of_pairs(vehicle, "damping")[0][np.ix_(of_arm, of_arm)]
    squares, shapes = eigh(stiffness, bend_inertia(vehicle)[np.ix_(of_arm, of_arm)])
    frequency, shape = float(np.sqrt(squares[0])), shapes[:, 0]
    return frequency, float(shape @ damping @ shape) / (2.0 * frequency)
