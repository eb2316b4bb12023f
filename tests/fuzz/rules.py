"""What every vehicle, scenario and result that is accepted must satisfy."""

from typing import Any

import numpy as np
import xarray as xr

import continuair as ca
from continuair.vehicle.section import Section
from tests.fuzz.trial import Wrong


def require(holds: bool, rule: str) -> None:
    """Raise Wrong unless a rule holds."""
    if not holds:
        raise Wrong(rule)


def check_vehicle(vehicle: ca.Vehicle) -> None:
    """A body that there can be: finite, of positive mass, inertia and stiffness, and slender."""
    uav = vehicle.uav
    for arm in vehicle.arms:
        for section in arm.section:
            check_section(section)
    require(_positive(uav.mass), f"uav.mass is {uav.mass!r}")
    inertia = np.asarray(uav.inertia, float)
    require(bool(np.isfinite(inertia).all()), "inertia is not finite")
    moments = np.linalg.eigvalsh(inertia)
    require(bool((moments > 0).all()), f"inertia has the principal moments {moments}")
    heaviest = moments[..., 2] <= (moments[..., 0] + moments[..., 1]) * (1 + 1e-9)
    require(bool(np.all(heaviest)), f"principal moments {moments} are of no body")
    require(not _holds_bool(vehicle.describe()), "a truth value stands for a number")


def check_section(section: Section) -> None:
    """Of positive length, mass and stiffness, slender if it has a radius, its disks on it."""
    for name in ("length", "mass_per_length", "bending_stiffness"):
        value = getattr(section, name)
        require(_positive(value), f"{name} of a section is {value!r}")
    length = np.asarray(section.length)
    if section.given_radius is not None:
        require(_positive(section.radius), f"radius is {section.radius!r}")
        require(bool(np.all(np.asarray(section.radius) < length)), "radius over length")
    for disk in section.disks:
        require(bool(np.all(np.asarray(disk.position) <= length * (1 + 1e-9))), "disk off arm")


def check_flight(flight: xr.Dataset) -> None:
    """Ended in a known way, finite up to there, attitudes of unit length."""
    require(set(np.ravel(flight["status"])) <= {0, 1, 2, 3, 4, 5}, "unknown status")
    valid = flight["time"].to_numpy() <= np.ravel(flight["end_time"])[0]
    for name in ("tip_position", "attitude", "bend"):
        values = flight[name].to_numpy()[valid]
        require(bool(np.isfinite(values).all()) or int(flight["status"]) != 0, f"{name} not finite")
    unit = np.linalg.norm(flight["attitude"].to_numpy()[valid], axis=-1)
    good = np.isfinite(unit)
    require(bool(np.abs(unit[good] - 1).max(initial=0) < 1e-9), "attitude of another length than 1")
    if "error_estimate" in flight:
        require(not np.isnan(float(flight["error_estimate"])), "no error_estimate")


def _positive(value: Any) -> bool:
    array = np.asarray(value, float)
    return bool((np.isfinite(array) & (array > 0)).all())


def _holds_bool(value: Any) -> bool:
    if isinstance(value, dict):
        return any(_holds_bool(entry) for entry in value.values())
    if isinstance(value, (list, tuple)):
        return any(_holds_bool(entry) for entry in value)
    return isinstance(value, bool)
