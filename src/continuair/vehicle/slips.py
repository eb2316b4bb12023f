"""Values outside the range of such vehicles, and the unit in which they may have been given."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from continuair.errors import InputError

if TYPE_CHECKING:
    from continuair.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class _Range:
    """Plausible range of a value; other: units that are mistaken for its own, with their size."""

    least: float
    most: float
    unit: str
    name: str
    whose: str
    other: dict[str, float]

    def problem(self, field: str, value: Any) -> InputError | None:
        """Return an error about the first value outside the range, or None."""
        given = np.atleast_1d(np.asarray(value, float))
        wrong = given[~((given >= self.least) & (given <= self.most))]
        if not wrong.size:
            return None
        side = "more" if wrong[0] > self.most else "less"
        return self.error(field, float(wrong[0]), f"{side} than any {self.whose}'s")

    def error(self, field: str, value: float, problem: str) -> InputError:
        """Return an error about a wrong value, with the likely one."""
        meant = [
            f"{value * size:.4g}, if these are {other}"
            for other, size in self.other.items()
            if self.least <= value * size <= self.most
        ]
        remedy = f"give {self.name}" + (f" ({' or '.join(meant[:2])})" if meant else "")
        return InputError(field, f"is {value:.4g} {self.unit}, {problem}", remedy)


_MILLIMETRES = {"millimetres": 1e-3, "centimetres": 1e-2}

_MASS = _Range(3e-3, 300.0, "kg", "kilograms", "multirotor", {"grams": 1e-3})
_LENGTH = _Range(5e-3, 10.0, "m", "metres", "arm", _MILLIMETRES)
_RADIUS = _Range(2e-5, 0.1, "m", "metres", "backbone", {"millimetres": 1e-3})
_DENSITY = _Range(10.0, 23_000.0, "kg/m³", "kg/m³", "material", {"g/cm³": 1e3})
_MODULUS = _Range(1e4, 1.3e12, "Pa", "pascals", "material", {"gigapascals": 1e9})

_GYRATION, _HEAVY = 0.03, 20.0
"""A UAV heavier than this [kg] with a smaller radius of gyration [m] has its mass in grams."""


def slips(vehicle: Vehicle) -> list[InputError]:
    """Return errors about values of a vehicle that seem to be in another unit."""
    return [found for found in _checked(vehicle) if found]


def radius_remedy(radius: float, length: float) -> str:
    """Return the likely value of a radius that is too large, in brackets, or nothing."""
    fits = 1e-3 * radius <= 0.5 * length and _RADIUS.least <= 1e-3 * radius <= _RADIUS.most
    return f" ({1e-3 * radius:.4g}, if these are millimetres)" if fits else ""


def _checked(vehicle: Vehicle) -> Iterator[InputError | None]:
    uav = vehicle.uav
    yield _MASS.problem("uav.mass", uav.mass) or _of_mass(uav.mass, uav.inertia)
    for arm in vehicle.arms:
        for section in arm.section:
            at = f"arm.{arm.name}.section.{section.name}." if vehicle.has_arm_list else "arm."
            yield _LENGTH.problem(f"{at}length", section.length)
            if section.given_radius is None:
                continue
            yield _RADIUS.problem(f"{at}radius", np.stack(section.radii()))
            yield _DENSITY.problem(f"{at}density", section.density)
            yield _MODULUS.problem(f"{at}youngs_modulus", section.youngs_modulus)


def _of_mass(mass: Any, inertia: Any) -> InputError | None:
    """Return an error about a mass that fits its inertia only in grams, or None."""
    largest = np.linalg.eigvalsh(np.asarray(inertia, float))[..., -1]
    heavy, square = np.broadcast_arrays(np.asarray(mass, float), largest / np.asarray(mass, float))
    wrong = np.atleast_1d(
        (heavy > _HEAVY) & (square < _GYRATION**2) & (1e3 * square > _GYRATION**2)
    )
    if not wrong.any():
        return None
    radius = float(np.sqrt(np.atleast_1d(square)[wrong][0]))
    problem = f"some {radius:.2g} m from the axes of uav.inertia"
    return _MASS.error("uav.mass", float(np.atleast_1d(heavy)[wrong][0]), problem)
