"""What of a vehicle is unlike anything that flies: often a unit that was mistaken."""

from __future__ import annotations

import numpy as np

from continuair.analysis.excited import excited_arm
from continuair.analysis.groups import place
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

_DENSITY = (10.0, 23_000.0)
"""From foams to osmium [kg/m³]."""

_MODULUS = (1e4, 1.3e12)
"""From the softest gels to diamond [Pa]."""

_GYRATION = (0.01, 3.0)
"""Radii of gyration of UAVs [m]."""


def doubts(vehicle: Vehicle) -> list[str]:
    """Sentences on values of a vehicle that are hardly meant; none where all look well."""
    return [*_of_uav(vehicle), *_of_sections(vehicle), *_of_sag(vehicle)]


def _of_uav(vehicle: Vehicle) -> list[str]:
    radii = np.sqrt(np.linalg.eigvalsh(np.asarray(vehicle.uav.inertia)) / vehicle.uav.mass)
    least, most = _GYRATION
    if radii[0] >= least and radii[-1] <= most:
        return []
    return [
        f"uav.inertia is that of {vehicle.uav.mass:g} kg some {radii[-1]:.2g} m from the axis; is "
        "it in kg m²?"
    ]


def _of_sections(vehicle: Vehicle) -> list[str]:
    found = []
    for arm in vehicle.arms:
        for section in arm.section:
            at = f"arm.{arm.name}.section.{section.name}." if vehicle.has_arm_list else "arm."
            found += [at + text for text in [*_of_material(section), *_of_disks(section, vehicle)]]
        tip = arm.tip.mass if arm.tip is not None else 0.0
        if tip > vehicle.uav.mass:
            found.append(f"arm.{arm.name}.tip.mass is {tip:g} kg, {_MORE}")
    return found


_MORE = "more than the UAV's; is it in kilograms, not grams?"


def _of_disks(section: Section, vehicle: Vehicle) -> list[str]:
    heavy = [i for i, disk in enumerate(section.disks) if disk.mass > vehicle.uav.mass]
    return [f"disks.{i}.mass is {section.disks[i].mass:g} kg, {_MORE}" for i in heavy[:1]]


def _of_material(section: Section) -> list[str]:
    if section.given_radius is None:
        return []
    found = []
    for name, (least, most), unit in (
        ("density", _DENSITY, "kg/m³"),
        ("youngs_modulus", _MODULUS, "Pa"),
    ):
        value = float(getattr(section, name))
        if not least <= value <= most:
            side = "more" if value > most else "less"
            found.append(f"{name} is {value:.3g} {unit}, {side} than any material's; is it meant?")
    return found


def _of_sag(vehicle: Vehicle) -> list[str]:
    # The sag of a massless arm with a point at its tip; a bare rod's is 5/3 of it.
    sag = float(place(vehicle)["gravity_number"])
    if sag <= 1.0:
        return []
    length = float(excited_arm(vehicle).length)
    return [
        f"the arm, held level, would sag by at least {sag:.2g} times its length of {length:g} m; "
        "is it so limp, or its radius in metres?"
    ]
