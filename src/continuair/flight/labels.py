"""Labels of the dimensions of trajectories, and trajectories in their order."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from continuair.errors import InputError
from continuair.vehicle.layout import ACTUATORS, COORDINATES, numbered
from continuair.vehicle.strain import COMPONENTS
from continuair.vehicle.vehicle import Vehicle

FIXED: dict[str, list[Any]] = {
    "twist": ["vx", "vy", "vz", "wx", "wy", "wz"],
    "axis": list("xyz"),
    "quaternion": list("xyzw"),
    "bend_axis": ["x", "y"],
}
"""Labels of dimensions that do not depend on the vehicle."""


def labels_of(vehicle: Vehicle) -> xr.Coordinates:
    """Return the coordinates that all trajectories of a vehicle share."""
    rotors = vehicle.uav.rotors.count if vehicle.uav.rotors is not None else 0
    own = rotors, strain_labels(vehicle), tendon_labels(vehicle)
    if not vehicle.has_arm_list:
        return _labels(None, (), *own)
    sections = (f"{arm.name}.{each.name}" for arm in vehicle.arms for each in arm.section)
    arms = tuple(arm.name for arm in vehicle.arms)
    return _labels(arms, tuple(sections), *own)


def tendon_labels(vehicle: Vehicle) -> tuple[str, ...]:
    """Return the labels of the tendons: "arm.group.0" and so on."""
    return tuple(
        f"{arm.name}.{group.name}.{index}"
        for arm in vehicle.arms
        for group in arm.tendon
        for index in range(group.count)
    )


def strain_labels(vehicle: Vehicle) -> tuple[tuple[str, ...], ...]:
    """Return the labels of the coordinates of each section, none where all sections are arcs.

    These are "arm.section.bend_x_0" and so on, the component and the order of its polynomial.
    """
    if not vehicle.layout.strains:
        return ()
    return tuple(
        tuple(
            f"{arm.name}.{section.name}.{COMPONENTS[component]}_{order}"
            for component, order in section.orders.coordinates
        )
        for arm in vehicle.arms
        for section in arm.section
    )


def flat_labels(vehicle: Vehicle) -> tuple[str, ...]:
    """Return the labels of `strain_labels` of all sections."""
    return tuple(label for section in strain_labels(vehicle) for label in section)


def columns_of_bends(vehicle: Vehicle | None) -> tuple[str, ...]:
    """Return the names of the columns of the sections' coordinates in files.

    "bend_x", "bend_y" of an [arm] table, "bend_x_1" and so on of arcs, and "strain_" with a label
    of `strain_labels` for all sections where one has a strain that varies.
    """
    if vehicle is not None and vehicle.layout.strains:
        return tuple(f"strain_{label}" for label in flat_labels(vehicle))
    return numbered(("bend_x", "bend_y"), _numbered_sections(vehicle))


def columns_of_moments(vehicle: Vehicle | None) -> tuple[str, ...]:
    """Return the names of the columns of the bend moments in files, as `columns_of_bends`."""
    if vehicle is not None and vehicle.layout.strains:
        return tuple(f"bend_moment_{label}" for label in flat_labels(vehicle))
    return numbered(ACTUATORS[6:], _numbered_sections(vehicle))


def _numbered_sections(vehicle: Vehicle | None) -> int | None:
    """Return the number of sections, None for one whose names have no number."""
    return vehicle.sections if vehicle is not None and vehicle.has_arm_list else None


def in_order(flight: xr.Dataset, vehicle: Vehicle) -> xr.Dataset:
    """Return a flight of the vehicle with its labels in order.

    Raises InputError for a flight that has only some of them.
    """
    return ordered(flight, labels_of(vehicle))


def ordered(flight: xr.Dataset, labels: Mapping[Any, Any]) -> xr.Dataset:
    """Return a flight with the dimensions of these labels in order, as `in_order`."""
    wanted = {}
    for name, each in labels.items():
        order, given = np.asarray(each).tolist(), list(flight.indexes.get(name, ()))
        if given and set(given) < set(order):
            lacking = ", ".join(str(label) for label in order if label not in given)
            raise InputError("flight", f"lacks the {name} {lacking}", "give the whole flight")
        # A dimension in order is not copied.
        if given != order and sorted(given) == sorted(order):
            wanted[name] = order
    return flight.sel(wanted)


@cache
def _labels(
    arms: tuple[str, ...] | None,
    sections: tuple[str, ...],
    rotors: int,
    strains: tuple[tuple[str, ...], ...],
    tendons: tuple[str, ...],
) -> xr.Coordinates:
    """Return the coordinates for some names of arms, sections, strains and tendons, and a number of
    rotors.

    Rotors count from 1, as in exported files.
    """
    alike = FIXED | {"rotor": list(range(1, rotors + 1)), "tendon": list(tendons)}
    listed = {} if arms is None else {"arm": list(arms), "section": list(sections)}
    of_arcs = len(sections) if listed else None
    polar, moments = (numbered(names[6:], of_arcs) for names in (COORDINATES, ACTUATORS))
    if strains:
        each = [label for section in strains for label in section]
        polar = moments = tuple(each)
        listed["strain_coordinate"] = each
    own = {"actuator": [*ACTUATORS[:6], *moments], "coordinate": [*COORDINATES[:6], *polar]}
    return xr.Coordinates(alike | own | listed)
