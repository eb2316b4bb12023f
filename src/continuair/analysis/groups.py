"""Dimensionless groups of a vehicle, independent of its scales of length, mass and time.

The scales are the arm's length l, its mass m_arm and 1 / ω_c, with ω_c its clamped frequency. In
these units the equations of motion contain only the groups below, the load and the initial state:
vehicles with equal groups behave alike (docs/explanation/decouple_groups.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

from continuair.analysis.excited import excited_arm
from continuair.controllers.inertias import straight_inertia
from continuair.engine.engine import Engine
from continuair.flight.frequencies import fastest_frequency
from continuair.typing import Array, ArrayLike
from continuair.vehicle.section import Section
from continuair.vehicle.uav import Uav
from continuair.vehicle.vehicle import Vehicle

GROUPS = {
    "mass_ratio": "mass of the arm over that of the UAV",
    "inertia_ratio": "arm's mass times its length squared, over the UAV's pitch inertia",
    "gravity_number": "gravity over the arm's length and clamped frequency squared",
    "slenderness": "radius over length of the arm",
    "damping_ratio": "damping ratio of the clamped arm",
    "coupling": "share of the arm's modal inertia that a free base takes away, 1 - (ω_c / ω_f)²",
}
"""Groups of a vehicle; the coupling follows from the others."""

PERIOD = 0.1
"""Clamped period of the vehicles that `vehicle_of` makes [s]."""

YAW_TO_PITCH = 1.9
"""Ratio of the UAV's moments of inertia of those vehicles, as of a flat multirotor."""

GRAVITY = 9.81


def place(vehicle: Vehicle, gravity: float = GRAVITY) -> dict[str, Any]:
    """Return the groups of a vehicle: numbers, or arrays over the runs of a batch.

    Disks count as mass of the arm. For a UAV of unequal moments, the inertia ratio uses the pitch
    inertia, the coupling the plane in which it is larger. For a vehicle with [[arm]], the mass is
    that of all arms and the coupling the largest of all their motions; length, frequency and
    damping are those of the camera's arm. Slenderness is omitted there, and for an arm without a
    radius.
    """
    if vehicle.has_arm_list:
        return _place_of_chains(vehicle, gravity)
    arm, uav = vehicle.arm, vehicle.uav
    clamped = np.asarray(arm.clamped_frequency)
    critical = 2.0 * np.asarray(arm.bending_stiffness) / clamped
    found = {
        "mass_ratio": np.asarray(arm.mass) / uav.mass,
        "inertia_ratio": arm.mass
        * np.asarray(arm.length) ** 2
        / np.asarray(uav.inertia)[..., 1, 1],
        "gravity_number": gravity / (arm.length * clamped**2),
        "damping_ratio": np.asarray(arm.structural_damping) / critical,
        "coupling": coupling(vehicle),
    }
    if arm.given_radius is not None:
        found["slenderness"] = np.asarray(arm.mean_radius) / arm.length
    return found if vehicle.runs else {name: float(np.squeeze(v)) for name, v in found.items()}


def _place_of_chains(vehicle: Vehicle, gravity: float) -> dict[str, Any]:
    """Return the groups of a vehicle with [[arm]]."""
    arm, uav = excited_arm(vehicle), vehicle.uav
    mass = np.asarray(sum(each.mass for each in vehicle.arms))
    found = {
        "mass_ratio": mass / uav.mass,
        "inertia_ratio": mass * np.asarray(arm.length) ** 2 / np.asarray(uav.inertia)[..., 1, 1],
        "gravity_number": gravity / (arm.length * np.asarray(arm.frequency) ** 2),
        "damping_ratio": arm.damping_ratio,
        "coupling": _coupling_of_chains(vehicle),
    }
    return found if vehicle.runs else {name: float(v) for name, v in found.items()}


def _coupling_of_chains(vehicle: Vehicle) -> Array:
    """Return the largest eigenvalue of M_aa⁻¹ M_au M_uu⁻¹ M_ua with all arms straight."""
    each = [vehicle] if vehicle.runs is None else map(vehicle.select, range(vehicle.runs))
    found = []
    for one in each:
        M = straight_inertia(one)
        felt = M[6:, :6] @ np.linalg.solve(M[:6, :6], M[:6, 6:])
        found.append(eigvalsh(felt, M[6:, 6:])[-1])
    return np.asarray(found if vehicle.runs else found[0])


def coupling(vehicle: Vehicle) -> Array:
    """Return 1 - (ω_c / ω_f)² (runs,): the share of the arm's modal inertia that a free base
    removes.

    It is the largest eigenvalue of M_aa⁻¹ M_au M_uu⁻¹ M_ua: 0 for a base that cannot move, below 1.
    ω_f is that of the plane in which it is higher.
    """
    straight = np.zeros((1, vehicle.layout.coordinates))
    free, clamped = (
        fastest_frequency(Engine(vehicle, model), straight) for model in ("coupled", "independent")
    )
    return 1.0 - (clamped / free) ** 2


def vehicle_of(
    groups: Mapping[str, ArrayLike], period: float | Array = PERIOD, uav_mass: float | Array = 2.0
) -> Vehicle:
    """Return a batch of vehicles with given groups, arrays (runs,), and a clamped period [s].

    groups: those of GROUPS except the coupling. The length follows from the gravity number, and
    uav_mass [kg] sets the scale of masses. Scaled by l, m_arm and ω_c, scales do not matter.
    """
    g = {name: np.asarray(groups[name], float) for name in GROUPS if name != "coupling"}
    frequency = 2.0 * np.pi / period
    length = GRAVITY / (g["gravity_number"] * frequency**2)
    radius = g["slenderness"] * length
    mass = g["mass_ratio"] * uav_mass
    density = mass / (np.pi * radius**2 * length)
    modulus = frequency**2 * density * (length**4 / (5.0 * radius**2) + length**2 / 3.0)
    pitch = mass * length**2 / g["inertia_ratio"]
    template = Vehicle(
        name="atlas",
        uav=Uav(mass=1.0, inertia=(1.0, 1.0, YAW_TO_PITCH)),
        arm=Section(length=1.0, radius=0.01, density=1e3, youngs_modulus=1e9, damping_ratio=0.0),
    )
    inertia = np.zeros((len(length), 3, 3))
    for axis, ratio in enumerate((1.0, 1.0, YAW_TO_PITCH)):
        inertia[:, axis, axis] = ratio * pitch
    return template.replace(
        {
            "uav.mass": mass / g["mass_ratio"],
            "arm.density": density,
            "uav.inertia": inertia,
            "arm.length": length,
            "arm.radius": radius,
            "arm.youngs_modulus": modulus,
            "arm.damping_ratio": g["damping_ratio"],
        }
    )
