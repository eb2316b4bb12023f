"""The fields of a vehicle that a recorded flight may determine, and the scale each is fitted on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.errors import InputError, nearest
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold

Array = np.ndarray

_PLACE_SCALE = 0.01
_ROD = ("radius", "density", "youngs_modulus")
_SECTION = (
    "length", "bending_stiffness", "mass_per_length", "damping", "damping_ratio", "kappa_s"
)  # fmt: skip
_MOST_DECADES = 3.0


@dataclass(frozen=True)
class Fitted:
    """Fields to fit, and the vehicle they are of.

    start (fields,): their values. linear (fields,): places, which may be 0 or below, move by
    centimetres; all others are above 0 and move by their logarithm.
    """

    of: Vehicle
    names: tuple[str, ...]
    start: Array
    linear: Array

    def values(self, rows: Array) -> Array:
        """Values (runs, fields) of rows of unknowns, 0 at the start."""
        bounded = np.clip(rows, -_MOST_DECADES * np.log(10.0), _MOST_DECADES * np.log(10.0))
        grown = self.start * np.exp(np.where(self.linear, 0.0, bounded))
        moved: Array = np.where(self.linear, self.start + _PLACE_SCALE * rows, grown)
        return moved

    def vehicle(self, rows: Array) -> tuple[Vehicle, Array]:
        """The batched vehicle of rows of unknowns (runs, fields), and which runs are vehicles.

        A run that can be no vehicle, for instance by its inertia, is that of the start instead.
        """
        values = self.values(rows)
        # Only what is found in the end is told of.
        with untold():
            try:
                return self.of.replace(self._changes(values.T)), np.ones(len(rows), bool)
            except InputError:
                valid = np.array([self._is_valid(row) for row in values])
                values[~valid] = self.start
                return self.of.replace(self._changes(values.T)), valid

    def vehicle_of(self, values: Array) -> Vehicle:
        """The plain vehicle of values (fields,)."""
        return self.of.replace(self._changes(values.tolist()))

    def _changes(self, columns: Any) -> dict[str, Any]:
        return dict(zip(self.names, columns, strict=True))

    def _is_valid(self, values: Array) -> bool:
        try:
            self.vehicle_of(values)
        except InputError:
            return False
        return True

    def slopes(self, values: Array) -> Array:
        """Change of every value per change of its unknown."""
        found: Array = np.where(self.linear, _PLACE_SCALE, values)
        return found

    def relative(self, row: Array) -> Array:
        """Change per change of its unknown, as a share of the value; 0 for places."""
        return np.where(self.linear, 0.0, 1.0) * np.ones_like(row)

    def reach(self, factor: float) -> Array:
        """How far the unknowns go for values within a factor, or centimetres, of the start."""
        return np.where(self.linear, 1.0, np.log(factor))


def fitted_fields(vehicle: Vehicle, names: Sequence[str] | None) -> Fitted:
    """Check names of fields; None: stiffness of every section, and its damping if there is any.

    Raises InputError.
    """
    known = _known(vehicle)
    names = _default(vehicle, known) if names is None else _by_name(vehicle, names)
    if not names:
        raise InputError(f"fit is empty; name fields of the vehicle: {', '.join(known)}.")
    for name in names:
        if name not in known:
            raise InputError(f"fit holds {name}, which cannot be fitted; {nearest(name, known)}.")
        if not known[name] and not _is_place(name):
            raise InputError(
                f"{name} is {known[name] or 0:g} in the vehicle, and is fitted as a factor; give "
                "it a start above 0 in the vehicle's file."
            )
    repeated = {name for name in names if names.count(name) > 1}
    if repeated:
        raise InputError(f"fit holds {min(repeated)} twice; name every field once.")
    start = np.array([float(known[name] or 0.0) for name in names])
    return Fitted(vehicle, tuple(names), start, np.array([_is_place(name) for name in names]))


def _is_place(name: str) -> bool:
    """Whether a field is a coordinate of a place; arms and sections may have any names."""
    *_, of, last = name.split(".")
    return last.isdecimal() and of in ("mount", "centre")


def _sections(vehicle: Vehicle) -> dict[str, Section]:
    """Path -> section."""
    if not vehicle.has_arm_list:
        return {"arm": vehicle.arm}
    return {
        f"arm.{arm.name}.section.{section.name}": section
        for arm in vehicle.arms
        for section in arm.section
    }


def _default(vehicle: Vehicle, known: Mapping[str, float | None]) -> list[str]:
    found = []
    for path, section in _sections(vehicle).items():
        rod = section.given_youngs_modulus is not None
        found.append(f"{path}.{'youngs_modulus' if rod else 'bending_stiffness'}")
        damping = (f"{path}.{name}" for name in ("damping", "damping_ratio"))
        found += [name for name in damping if known[name]]
    return found


def _by_name(vehicle: Vehicle, names: Sequence[str]) -> list[str]:
    """Fields as they were asked for, but parts of lists by their names, not by an index."""
    return [".".join(_named(vehicle, name.strip().split("."))) for name in names]


def _named(vehicle: Vehicle, parts: list[str]) -> list[str]:
    if not vehicle.has_arm_list or len(parts) < 2 or parts[0] != "arm":
        return parts
    arms = {str(index): arm for index, arm in enumerate(vehicle.arms)}
    arm = arms.get(parts[1]) or next((a for a in vehicle.arms if a.name == parts[1]), None)
    if arm is None:
        return parts
    parts = ["arm", arm.name, *parts[2:]]
    if len(parts) > 3 and parts[2] == "section" and parts[3].isdecimal():
        index = int(parts[3])
        parts[3] = arm.section[index].name if index < len(arm.section) else parts[3]
    return parts


def _known(vehicle: Vehicle) -> dict[str, float | None]:
    """Field -> value of all that may be fitted."""
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
    return found


def _of_arm(path: str, arm: ArmChain) -> dict[str, float | None]:
    """Its mount, and the body on its tip if it has one."""
    found: dict[str, float | None] = {f"{path}.mount.{i}": arm.mount[i] for i in range(3)}
    if arm.tip is not None:
        found[f"{path}.tip.mass"] = arm.tip.mass
        found |= {f"{path}.tip.centre.{i}": arm.tip.centre[i] for i in range(3)}
        found |= {f"{path}.tip.inertia.{i}.{i}": arm.tip.inertia[i][i] for i in range(3)}
    return found


def _of_section(path: str, section: Section) -> dict[str, float | None]:
    own = _SECTION + (_ROD if section.given_radius is not None else ())
    found: dict[str, float | None] = {f"{path}.{name}": getattr(section, name) for name in own}
    for index, disk in enumerate(section.disks):
        found[f"{path}.disks.{index}.position"] = disk.position
        found[f"{path}.disks.{index}.mass"] = disk.mass
    return found
