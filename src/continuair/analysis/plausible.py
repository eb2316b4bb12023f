"""Warnings of implausible values of a vehicle, often due to a wrong unit."""

from __future__ import annotations

import math

import numpy as np

from continuair.analysis.excited import excited_arm, name_of_excited_arm
from continuair.analysis.groups import GRAVITY, place
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.fields import ROUNDING
from continuair.vehicle.section import Section
from continuair.vehicle.slips import slips
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.vehicle import Vehicle

_GYRATION = (0.01, 3.0)
"""Radii of gyration of UAVs [m]."""

_FAR = 5.0
"""Largest distance of a vehicle's parts, over the sum of arm length and radius of gyration."""

_STRONG = 30.0
"""Thrust-to-weight ratio above that of any multirotor."""

_SLOW = 2.0
"""Largest plausible time constant of a rotor [s]."""


def doubts(vehicle: Vehicle) -> list[str]:
    """Return sentences on implausible values of a vehicle; none if all are plausible.

    If a value seems to be in another unit, sentences that combine it with others are left out.
    """
    likely, alone = (
        [str(slip) for slip in slips(vehicle)],
        [*_of_rotors(vehicle), *_of_sections(vehicle)],
    )
    if likely:
        return likely + alone
    together = [*_of_uav(vehicle), *_of_places(vehicle), *_of_lift(vehicle), *_of_sag(vehicle)]
    return together + alone


def _of_uav(vehicle: Vehicle) -> list[str]:
    """Return a sentence on an implausible inertia."""
    radii = np.sqrt(np.linalg.eigvalsh(np.asarray(vehicle.uav.inertia)) / vehicle.uav.mass)
    least, most = _GYRATION
    if radii[0] >= least and radii[-1] <= most:
        return []
    return [
        f"uav.inertia is that of {vehicle.uav.mass:g} kg at {radii[-1]:.2g} m from the axis; "
        "check that it is in kg m²."
    ]


def _of_places(vehicle: Vehicle) -> list[str]:
    """Return sentences on parts that are implausibly far away."""
    rotors = vehicle.uav.rotors
    places = {"uav.mount": vehicle.uav.mount, "camera.position": vehicle.camera.position}
    if vehicle.has_arm_list:
        places |= {f"arm.{arm.name}.mount": arm.mount for arm in vehicle.arms}
    if rotors is not None:
        places["uav.rotors: a rotor"] = max(rotors.hubs.tolist(), key=np.linalg.norm)
    inertia = float(np.linalg.eigvalsh(np.asarray(vehicle.uav.inertia))[-1])
    length = excited_arm(vehicle).length if vehicle.arms else vehicle.reach
    most = _FAR * (length + np.sqrt(inertia / vehicle.uav.mass))
    return [
        f"{name} is {distance:.3g} m away, unusually far for this vehicle; check that it is in "
        "metres."
        for name, at in places.items()
        if (distance := float(np.linalg.norm(at))) > most
    ]


def _of_lift(vehicle: Vehicle) -> list[str]:
    rotors = vehicle.uav.rotors
    lift = 0.0 if rotors is None else rotors.highest.sum() / (GRAVITY * vehicle.mass)
    if lift <= _STRONG:
        return []
    return [
        f"uav.rotors.thrust_limits let the rotors lift {lift:.3g} times the weight; are they in "
        "newtons?"
    ]


def _of_rotors(vehicle: Vehicle) -> list[str]:
    """Return sentences on implausible rotors."""
    rotors, found = vehicle.uav.rotors, []
    if rotors is None:
        return []
    for name, lag in (("lag", rotors.lag), ("lag_down", rotors.lag_down)):
        if lag is not None and lag > _SLOW:
            found.append(f"uav.rotors.{name} is {lag:g} s, very slow; check that it is in seconds.")
    if rotors.torque_per_thrust > 1.0:
        found.append(
            f"uav.rotors.torque_per_thrust is {rotors.torque_per_thrust:g} m, more than any "
            "rotor's; check that it is in metres."
        )
    return found


def _of_sections(vehicle: Vehicle) -> list[str]:
    """Return sentences on implausible sections and tips."""
    found = []
    for arm in vehicle.arms:
        for section in arm.section:
            at = f"arm.{arm.name}.section.{section.name}." if vehicle.has_arm_list else "arm."
            texts = *_of_damping(section), *_of_disks(section, vehicle)
            found += [at + text for text in texts]
        found += [text for group in arm.tendon for text in _of_tendons(group, arm)]
        tip = arm.tip.mass if arm.tip is not None else 0.0
        if tip > vehicle.uav.mass:
            found.append(f"arm.{arm.name}.tip.mass is {tip:g} kg, {_MORE}")
    return found


_MOST_TURNS = 5
"""Full turns about the backbone, above which an angle of a helical tendon may be in degrees."""


def _of_tendons(group: Tendon, arm: ArmChain) -> list[str]:
    """Return sentences on implausible angles, offsets and friction of tendons."""
    at, length = f"arm.{arm.name}.tendon.{group.name}", sum(each.length for each in arm.section)
    found = []
    if max(map(abs, group.angles)) > 2.0 * math.pi * (1.0 + ROUNDING):
        found.append(f"{at}.angles hold more than a full turn; check that they are in radians.")
    if abs(group.turn) > 2.0 * math.pi * _MOST_TURNS:
        found.append(
            f"{at}.turn is {group.turn:g} rad, {_MOST_TURNS} full turns or more; check that it is "
            "in radians."
        )
    if max(group.offset) > length / 5.0:
        found.append(
            f"{at}.offset is {max(group.offset):g} m beside an arm of {length:g} m; check that it "
            "is in metres."
        )
    if group.friction > 1.0:
        found.append(f"{at}.friction is {group.friction:g}, above any cable's on its guides.")
    return found


_MORE = "more than the UAV's; check that it is in kilograms."


def _of_disks(section: Section, vehicle: Vehicle) -> list[str]:
    """Return a sentence on the first disk heavier than the UAV."""
    heavy = [i for i, disk in enumerate(section.disks) if disk.mass > vehicle.uav.mass]
    return [f"disks.{i}.mass is {section.disks[i].mass:g} kg, {_MORE}" for i in heavy[:1]]


def _of_damping(section: Section) -> list[str]:
    """Return a sentence on an overdamped section."""
    ratio = section.damping_ratio
    if ratio is None or ratio <= 1.0:
        return []
    return [f"damping_ratio is {ratio:g}, overdamped; check that it is not in per cent."]


def _of_sag(vehicle: Vehicle) -> list[str]:
    """Return a sentence on an arm that collapses under its weight."""
    if not vehicle.arms:
        return []
    number = float(place(vehicle)["gravity_number"])
    if number <= 1.0:
        return []
    length, name = float(excited_arm(vehicle).length), name_of_excited_arm(vehicle)
    return [
        f"gravity number g / l ω² is {number:.2g}: held level, the {name} of {length:g} m "
        "collapses under its weight; check stiffness and units."
    ]
