"""Parameters of a vehicle by another program: a checked table of numbers."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, nearest, shown
from continuair.typing import Array
from continuair.vehicle.rotors import MOST_ROTORS
from continuair.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class ParameterTable:
    """Entries of a table by their names; table: its name in errors.

    Numbers, lists and arrays are read as they are. Nothing is imported or executed.
    """

    table: str
    entries: Mapping[str, Any]

    def field(self, name: str) -> str:
        """Return the path of an entry in errors."""
        return f"{self.table}.{name}"

    def has(self, name: str) -> bool:
        """Return whether the table has an entry."""
        return name in self.entries

    def require(self, names: Collection[str]) -> None:
        """Raise InputError if one of these entries is missing."""
        for name in names:
            if name not in self.entries:
                raise InputError(self.field(name), "is missing", "give all parameters of a vehicle")

    def only(self, names: Collection[str]) -> None:
        """Raise InputError for an entry of another name, which may be physics."""
        for name in self.entries:
            if name not in names:
                raise InputError(
                    self.field(f"{name}"[:40]),
                    f"= {shown(self.entries[name])} is not a known parameter",
                    f"leave it out, or {nearest(str(name), sorted(names))}",
                )

    def number(
        self, name: str, default: float = 0.0, *, above: float = -math.inf, least: float = -math.inf
    ) -> float:
        """Return a number, or the default of a missing one; arrays of no dimension are numbers."""
        value = self.entries.get(name, default)
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value.item()
        return checks.number(self.field(name), value, above=above, least=least)

    def span(self, lowest: str, highest: str) -> tuple[float, float]:
        """Return the ends of a range by their names, 0 or above, the first below the second."""
        least, most = self.number(lowest, least=0.0), self.number(highest, above=0.0)
        if not least < most:
            raise InputError(
                self.field(lowest), f"is {least:g}", f"give less than {highest}, {most:g}"
            )
        return least, most

    def array(self, name: str, shape: tuple[int | None, ...]) -> Array:
        """Return numbers of a shape; None stands for 1 to MOST_ROTORS."""
        found = checks.finite_array(self.entries[name])
        fits = found is not None and found.ndim == len(shape)
        if found is None or not fits or not all(map(_fits, found.shape, shape)):
            size = " x ".join("rotors" if each is None else str(each) for each in shape)
            raise InputError(
                self.field(name), f"is {shown(self.entries[name])}", f"give {size} finite numbers"
            )
        return found

    def spins(self, name: str, torques: Array) -> list[int]:
        """Return spins of rotors, opposite to the signs of their torques, which must be 1 or -1."""
        if not (np.abs(torques) == 1.0).all():
            raise InputError(
                self.field(name),
                f"is {shown(torques)}",
                "give 1 or -1 for the torque of each rotor",
            )
        return [-int(each) for each in torques]

    def vehicle(self, name: str, inertia: Array, rotors: dict[str, Any], drag: Any) -> Vehicle:
        """Return the vehicle without arms; drag: fields of ``uav.drag``, or None."""
        mass = self.number("mass", above=0.0)
        uav = {"mass": mass, "inertia": inertia, "rotors": rotors, "drag": drag}
        try:
            return Vehicle(name=name, uav=uav)
        except InputError as error:
            raise error.located(self.table) from None


def _fits(length: int, wanted: int | None) -> bool:
    return 0 < length <= MOST_ROTORS if wanted is None else length == wanted


def listed(positions: Array, spins: list[int]) -> list[dict[str, Any]]:
    """Return rotors at positions (rotors, 3) [m] whose axes are the body's z axis."""
    return [
        {"position": at, "spin": spin} for at, spin in zip(positions.tolist(), spins, strict=True)
    ]


def check_table(name: str, value: object) -> Mapping[str, Any]:
    """Return a mapping, or raise InputError with its name."""
    if not isinstance(value, Mapping):
        raise InputError(
            name, f"is {shown(value)}", "give parameters by their names, as a dictionary"
        )
    return value
