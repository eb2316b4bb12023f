"""Labels of the dimensions of trajectories, and trajectories in their order."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from continuair.errors import InputError
from continuair.vehicle.layout import ACTUATORS, COORDINATES, numbered
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
    if not vehicle.has_arm_list:
        return _labels(None, (), rotors)
    sections = (f"{arm.name}.{each.name}" for arm in vehicle.arms for each in arm.section)
    return _labels(tuple(arm.name for arm in vehicle.arms), tuple(sections), rotors)


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
def _labels(arms: tuple[str, ...] | None, sections: tuple[str, ...], rotors: int) -> xr.Coordinates:
    # Rotors count from 1, as in exported files.
    """Return the coordinates for some names of arms and sections, and a number of rotors."""
    alike = FIXED | {"rotor": list(range(1, rotors + 1))}
    if arms is None:
        own = {"actuator": list(ACTUATORS), "coordinate": list(COORDINATES)}
        return xr.Coordinates(alike | own)
    polar, moments = (numbered(names[6:], len(sections)) for names in (COORDINATES, ACTUATORS))
    own = {"actuator": [*ACTUATORS[:6], *moments], "coordinate": [*COORDINATES[:6], *polar]}
    return xr.Coordinates(alike | own | {"arm": list(arms), "section": list(sections)})
