"""Fields of a vehicle that can be fitted to a recorded flight, with their scales."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.errors import InputError, nearest, shown
from continuair.typing import Array
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.deviations import is_place
from continuair.vehicle.section import Section
from continuair.vehicle.uncertain import UncertainVehicle
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold

_PLACE_SCALE = 0.01
_ROD = ("radius", "density", "youngs_modulus")
_SECTION = (
    "length", "bending_stiffness", "mass_per_length", "damping", "damping_ratio", "kappa_s"
)  # fmt: skip
_TENDON = ("friction", "stiffness", "pretension", "damping")
_MOST_DECADES = 3.0


@dataclass(frozen=True)
class Fitted:
    """Fields to fit, and their vehicle.

    start (fields,): initial values. linear (fields,): positions, which may be 0 or below, are
    scaled in centimetres; all other fields are positive, and scaled by their logarithm.
    """

    of: Vehicle
    names: tuple[str, ...]
    start: Array
    linear: NDArray[np.bool_]

    def values(self, rows: Array) -> Array:
        """Return values (runs, fields) of rows of unknowns, which are 0 at the start."""
        bounded = np.clip(rows, -_MOST_DECADES * np.log(10.0), _MOST_DECADES * np.log(10.0))
        grown = self.start * np.exp(np.where(self.linear, 0.0, bounded))
        moved: Array = np.where(self.linear, self.start + _PLACE_SCALE * rows, grown)
        return moved

    def vehicle(self, rows: Array) -> tuple[Vehicle, NDArray[np.bool_]]:
        """Return the batched vehicle of rows of unknowns (runs, fields), and which runs are valid.

        An invalid run, for instance by its inertia, has the values of the start instead.
        """
        values = self.values(rows)
        # Warnings are given for the final vehicle only.
        with untold():
            try:
                return self.of.replace(self._changes(values.T)), np.ones(len(rows), bool)
            except InputError:
                valid = np.array([self._is_valid(row) for row in values])
                values[~valid] = self.start
                return self.of.replace(self._changes(values.T)), valid

    def vehicle_of(self, values: Array) -> Vehicle:
        """Return the single vehicle of values (fields,)."""
        return self.of.replace(self._changes(values.tolist()))

    def _changes(self, columns: Any) -> dict[str, Any]:
        """Return the fields by name."""
        return dict(zip(self.names, columns, strict=True))

    def _is_valid(self, values: Array) -> bool:
        """Return whether values (fields,) make a vehicle."""
        try:
            self.vehicle_of(values)
        except InputError:
            return False
        return True

    def slopes(self, values: Array) -> Array:
        """Return the change of every value per change of its unknown."""
        found: Array = np.where(self.linear, _PLACE_SCALE, values)
        return found

    def relative(self, row: Array) -> Array:
        """Return the relative change per change of its unknown; 0 for positions."""
        return np.where(self.linear, 0.0, 1.0) * np.ones_like(row)

    def reach(self, factor: float) -> Array:
        """Return the range of the unknowns for values within a factor, or centimetres, of the
        start."""
        return np.where(self.linear, 1.0, np.log(factor))


def fitted_fields(vehicle: Vehicle, names: Sequence[str] | None) -> Fitted:
    """Check names of fields; None: stiffness of every section, and its damping if it has any.

    Raises InputError.
    """
    known = _known(vehicle)
    names = _default(vehicle, known) if names is None else _by_name(vehicle, names)
    if not names:
        raise InputError("fit", "is empty", f"name fields of the vehicle: {', '.join(known)}")
    for name in names:
        if name not in known:
            raise InputError(
                "fit", f"has {shown(name)}, which cannot be fitted", nearest(name, known)
            )
        if not known[name] and not is_place(name):
            raise InputError(
                name,
                f"is {known[name] or 0:g}, but is fitted as a factor",
                "give it a value above 0 in the vehicle's file",
            )
    repeated = {name for name in names if names.count(name) > 1}
    if repeated:
        raise InputError("fit", f"has {min(repeated)} twice", "name every field once")
    start = np.array([float(known[name] or 0.0) for name in names])
    return Fitted(vehicle, tuple(names), start, np.array([is_place(name) for name in names]))


def _sections(vehicle: Vehicle) -> dict[str, Section]:
    """Return sections by path."""
    if not vehicle.has_arm_list:
        return {"arm": vehicle.arm}
    return {
        f"arm.{arm.name}.section.{section.name}": section
        for arm in vehicle.arms
        for section in arm.section
    }


def _default(vehicle: Vehicle, known: Mapping[str, float | None]) -> list[str]:
    """Return the fields that are fitted by default."""
    found = []
    for path, section in _sections(vehicle).items():
        rod = section.given_youngs_modulus is not None
        found.append(f"{path}.{'youngs_modulus' if rod else 'bending_stiffness'}")
        damping = (f"{path}.{name}" for name in ("damping", "damping_ratio"))
        found += [name for name in damping if known[name]]
    return found


def _by_name(vehicle: Vehicle, names: Sequence[str]) -> list[str]:
    """Return fields with parts of lists by name instead of index."""
    return [".".join(_named(vehicle, name.strip().split("."))) for name in names]


def left_exact(uncertain: UncertainVehicle | None, fitted: Sequence[str]) -> list[str]:
    """Return the fields of a vehicle with errors that a fit of other fields takes as exact."""
    if uncertain is None:
        return []
    names = _by_name(uncertain.vehicle, uncertain.fields)
    return [name for name in names if name not in fitted]


def _named(vehicle: Vehicle, parts: list[str]) -> list[str]:
    """Return a split path with its arm and section by name."""
    if not vehicle.has_arm_list or len(parts) < 2 or parts[0] != "arm":
        return parts
    arms = {str(index): arm for index, arm in enumerate(vehicle.arms)}
    arm = arms.get(parts[1]) or next((a for a in vehicle.arms if a.name == parts[1]), None)
    if arm is None:
        return parts
    parts = ["arm", arm.name, *parts[2:]]
    if len(parts) > 3 and parts[2] == "tendon" and parts[3].isdecimal():
        index = int(parts[3])
        parts[3] = arm.tendon[index].name if index < len(arm.tendon) else parts[3]
    if len(parts) > 3 and parts[2] == "section" and parts[3].isdecimal():
        index = int(parts[3])
        parts[3] = arm.section[index].name if index < len(arm.section) else parts[3]
    return parts


def _known(vehicle: Vehicle) -> dict[str, float | None]:
    """Return the values of all fields that can be fitted."""
    uav = vehicle.uav
    found: dict[str, float | None] = {"uav.mass": uav.mass}
    found |= {f"uav.inertia.{i}.{i}": uav.inertia[i][i] for i in range(3)}
    if not vehicle.has_arm_list:
        found |= {f"uav.mount.{i}": uav.mount[i] for i in range(3)}
    else:
        for arm in vehicle.arms:
            found |= _of_arm(f"arm.{arm.name}", arm)
    for path, section in _sections(vehicle).items():
        found |= _of_section(path, section)
    for arm in vehicle.arms:
        path = f"arm.{arm.name}" if vehicle.has_arm_list else "arm"
        for tendon in arm.tendon:
            of = f"{path}.tendon.{tendon.name}"
            found |= {f"{of}.{name}": getattr(tendon, name) for name in _TENDON}
    return found


def _of_arm(path: str, arm: ArmChain) -> dict[str, float | None]:
    """Return the fields of an arm's mount, and of the body at its tip if there is one."""
    found: dict[str, float | None] = {f"{path}.mount.{i}": arm.mount[i] for i in range(3)}
    if arm.tip is not None:
        found[f"{path}.tip.mass"] = arm.tip.mass
        found |= {f"{path}.tip.centre.{i}": arm.tip.centre[i] for i in range(3)}
        found |= {f"{path}.tip.inertia.{i}.{i}": arm.tip.inertia[i][i] for i in range(3)}
    return found


def _of_section(path: str, section: Section) -> dict[str, float | None]:
    """Return the fields of a section and its disks."""
    rod = ("density", "youngs_modulus") if section.tapered else _ROD
    own = _SECTION + (rod if section.given_radius is not None else ())
    found: dict[str, float | None] = {f"{path}.{name}": getattr(section, name) for name in own}
    for index, disk in enumerate(section.disks):
        found[f"{path}.disks.{index}.position"] = disk.position
        found[f"{path}.disks.{index}.mass"] = disk.mass
    return found
