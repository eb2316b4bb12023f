"""The task of the sensitivity study: six parameters, and the two-phase force of Amiri et al.

The parameters have the paper's values, or values about those of a vehicle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from continuair import Scenario, Section, Vehicle
from continuair.errors import InputError
from continuair.vehicle import check_one_section

Array = NDArray[np.float64]

AMPLITUDE = 100.0
"""a_m of the paper's force [N]."""

FREQUENCY = 10.0
"""f of the paper's force; the paper calls it Hz and writes sin(f t)."""

SWITCH = 2.5
"""The force changes its phase after this time [s]."""

DURATION = 5.0
"""Duration of a flight [s]."""

BETWEEN = 41
"""Values flown from the least to the largest of a parameter, beside the paper's own few."""

_Q = (0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.1, 0.0)


@dataclass(frozen=True)
class Parameter:
    """A parameter that is varied, with the values compared.

    field: of a vehicle, or the index of a paper coordinate of the start. values: in SI units,
    ascending. scale, units: what tables multiply the values with, and the unit that results.
    """

    name: str
    field: str | int
    values: tuple[float, ...]
    scale: float
    units: str
    chosen: bool = False
    """some values were chosen here: the paper does not print them"""

    def label(self, value: float) -> str:
        """Return a value as tables and legends print it."""
        return f"{self.scale * value:.4g} {self.units}"

    def between(self, count: int = BETWEEN) -> Array:
        """Return values over the whole range, the paper's among them."""
        return np.union1d(np.linspace(self.values[0], self.values[-1], count), self.values)


_ROLLS = tuple(math.radians(degrees) for degrees in (0, 15, 30, 45))

PARAMETERS = {
    parameter.name: parameter
    for parameter in (
        Parameter("arm radius", "arm.radius", (1e-3, 5e-3, 10e-3), 1e3, "mm"),
        Parameter("UAV mass", "uav.mass", (1.0, 2.0, 3.0), 1.0, "kg"),
        Parameter("arm length", "arm.length", (0.5, 1.0, 1.5), 1.0, "m", chosen=True),
        Parameter("Young's modulus", "arm.youngs_modulus", (40e9, 120e9, 207e9), 1e-9, "GPa"),
        Parameter("initial bend", 6, (0.1, 0.5, 1.0), 1.0, "1/m", chosen=True),
        Parameter("initial roll", 3, _ROLLS, 180 / math.pi, "deg", chosen=True),
    )
}
"""Name -> parameter, in the order of the paper's figure."""

AROUND = (0.5, 1.0, 1.5)
"""Parts of a vehicle's own value that are compared."""

AROUND_RADIUS = (0.8, 1.0, 1.2)
"""The same of the radius, whose fourth power the stiffness goes with: 0.41 to 2.1 times."""

_OWN = {
    "arm.radius": Parameter("arm radius", "arm.radius", AROUND_RADIUS, 1e3, "mm", chosen=True),
    "uav.mass": Parameter("UAV mass", "uav.mass", AROUND, 1.0, "kg", chosen=True),
    "arm.length": Parameter("arm length", "arm.length", AROUND, 1.0, "m", chosen=True),
    "arm.youngs_modulus": Parameter(
        "Young's modulus", "arm.youngs_modulus", AROUND, 1e-9, "GPa", chosen=True
    ),
    "arm.bending_stiffness": Parameter(
        "bending stiffness", "arm.bending_stiffness", AROUND, 1.0, "N m²", chosen=True
    ),
    "arm.mass_per_length": Parameter(
        "mass per length", "arm.mass_per_length", AROUND, 1e3, "g/m", chosen=True
    ),
}
"""Field -> its parameter, with parts of a vehicle's own value in place of values."""


def of_the_paper(vehicle: Vehicle) -> bool:
    """Whether radius, mass, length and modulus are among the values that the paper compares."""
    check_one_section(vehicle)
    fields = [each for each in PARAMETERS.values() if isinstance(each.field, str)]
    own = {each.field: _own_value(vehicle, str(each.field)) for each in fields}
    return all(own[each.field] in each.values for each in fields)


def about(vehicle: Vehicle) -> dict[str, Parameter]:
    """Return parameters by name about a vehicle's own values, of the fields that its file gives.

    The initial state varies as in the paper, as it is no value of a vehicle.
    """
    own = {
        field: (part, value)
        for field, part in _OWN.items()
        if (value := _own_value(vehicle, field)) is not None
    }
    found = {
        part.name: replace(part, values=tuple(share * value for share in part.values))
        for part, value in own.values()
    }
    return found | {name: each for name, each in PARAMETERS.items() if isinstance(each.field, int)}


def _own_value(vehicle: Vehicle, field: str) -> float | None:
    """Return a vehicle's own value of a field, None where its file gives another in its place."""
    table, _, name = field.partition(".")
    value = getattr(getattr(vehicle, table), name if table == "uav" else f"given_{name}", None)
    if field == "arm.length":
        value = vehicle.arm.length
    if field == "arm.radius" and not _acts(vehicle.arm):
        return None
    return None if value is None else float(value)


def _acts(arm: Section) -> bool:
    """Return whether a section's radius has any effect."""
    material = (arm.given_density, arm.given_youngs_modulus, arm.drag_coefficient)
    return any(value is not None for value in material)


@dataclass(frozen=True)
class TwoPhaseForce:
    """Force of the section on parameter sensitivity, Amiri et al.: a function of time.

    hertz: whether f counts in Hz: f t is 10 t as the paper prints it, with `hertz` 2 pi 10 t.
    """

    hertz: bool = False

    vectorised: ClassVar[bool] = True

    def __call__(self, t: float | Array) -> Array:
        """Return the force (..., 3) at a time [s], or at a column of times (times, 1) [N].

        World axes: a (sin ft, -cos ft), and after 2.5 s a (cos ft, sin ft).
        """
        time = np.asarray(t, float).reshape(np.shape(t)[:1])
        angle = FREQUENCY * time * (2 * math.pi if self.hertz else 1.0)
        sine, cosine = AMPLITUDE * np.sin(angle), AMPLITUDE * np.cos(angle)
        early = time <= SWITCH
        x, y = np.where(early, sine, cosine), np.where(early, -cosine, sine)
        return np.stack([x, y, np.zeros_like(x)], axis=-1)


def flight(hertz: bool = False) -> Scenario:
    """Return the scenario at the nominal start: 5 m high, at rest, with a bend of 0.1 1/m."""
    force = TwoPhaseForce(hertz)
    return Scenario("two-phase force", _Q, force=force, duration=DURATION, jumps=(SWITCH,))


def batch(
    vehicle: Vehicle, scenario: Scenario, parameter: Parameter, values: Sequence[float] | Array
) -> tuple[Vehicle, Scenario]:
    """Return vehicle and scenario with one run per value. Raises InputError if one cannot be."""
    if isinstance(parameter.field, str):
        try:
            return vehicle.replace({parameter.field: np.asarray(values)}), scenario
        except InputError as error:
            raise error.located(f"{parameter.name} sweep") from None
    q = np.tile(np.asarray(scenario.q), (len(values), 1))
    q[:, parameter.field] = values
    return vehicle, scenario.replace(q=q)
