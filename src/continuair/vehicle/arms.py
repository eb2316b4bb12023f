"""Arms of one or more sections, and rigid bodies on their tips."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, TypeVar

from pydantic import field_validator

from continuair.errors import InputError, named_fields, shown
from continuair.vehicle.fields import ROUNDING, Name, NotNegative, Part, Vector, label, named
from continuair.vehicle.inertia import (
    Matrix,
    UnitQuaternion,
    check_moments,
    principal_moments,
    symmetric_matrix,
)
from continuair.vehicle.section import Section

MOST_ARMS = 8
"""Most arms of a vehicle, and most sections of an arm. Kernels are compiled for each number."""

Member = TypeVar("Member", "Section", "ArmChain")

_OF_SECTION = "belongs to a section; write it below [[arm.section]], or write [arm] for one section"


class TipBody(Part):
    """Rigid body on the tip of an arm.

    Its axes are those of the result `tip_attitude`: z along the tangent, out of the tip.
    """

    mass: NotNegative
    """the mass of the body [kg]"""

    centre: Vector = (0.0, 0.0, 0.0)
    """the position of the body's centre of mass from the tip, in its axes, as 3 numbers [m]"""

    inertia: Matrix = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    """the inertia about the body's centre of mass in its axes, diagonal or 3x3 [kg m²]"""

    @field_validator("inertia", mode="before")
    @classmethod
    def _physical_inertia(cls, value: object) -> Matrix:
        matrix = symmetric_matrix(value)
        moments = principal_moments(matrix)
        if moments[0] < -ROUNDING * abs(moments[2]):
            raise ValueError(f"must have no negative eigenvalue (it has {moments[0]:.6g} kg m²)")
        check_moments("inertia of a tip", *moments)
        return matrix


class ArmChain(Part):
    """Arm of one or more sections of constant curvature, with an optional body on its tip.

    The arm's axes have their origin at the mount. At bend 0 the arm points along their -z.
    """

    refused: ClassVar[Mapping[str, str]] = {
        "tendons": "are not simulated yet; leave the tables out, and give bend moments directly",
        **dict.fromkeys(named_fields(Section).keys() - {"name"}, _OF_SECTION),
    }

    name: Name = ""
    """the arm's name, its index by default"""

    mount: Vector = (0.0, 0.0, 0.0)
    """the position of the arm's base in body axes, as 3 numbers [m]"""

    attitude: UnitQuaternion = (0.0, 0.0, 0.0, 1.0)
    """the rotation from the arm's axes to body axes, as a unit quaternion (x, y, z, w) [-]"""

    section: tuple[Section, ...]
    """the arm's sections from its base to its tip, a list of tables ([[arm.section]])"""

    tip: TipBody | None = None
    """a rigid body on the arm's tip, a table ([arm.tip])"""

    @field_validator("section", mode="before")
    @classmethod
    def _named_sections(cls, value: object) -> tuple[Section, ...]:
        return members(Section, value, "section")

    @property
    def mass(self) -> float:
        """Return the mass of the sections and of the body on the tip [kg]."""
        return sum(each.mass for each in self.section) + (self.tip.mass if self.tip else 0.0)


def members(kind: type[Member], value: object, noun: str) -> tuple[Member, ...]:
    """Return the arms of a vehicle, or the sections of an arm, validated and with unique names."""
    if not isinstance(value, (list, tuple)):
        raise ValueError("must be a list")
    if not 0 < len(value) <= MOST_ARMS:
        raise ValueError(f"must hold 1 to {MOST_ARMS} {noun}s (it has {len(value)})")
    found: list[Member] = []
    problems: list[InputError] = []
    for index, entry in enumerate(value):
        try:
            found.append(_member(kind, entry, index, noun))
        except InputError as error:
            problems.append(error)
    if problems:
        raise InputError.joined(problems)
    names = [each.name for each in found]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise InputError(
                f"{index}.name",
                f"is {name!r}, as is that of {noun} {names.index(name)}",
                f"give each {noun} a unique name",
            )
    return tuple(found)


def _member(kind: type[Member], entry: object, index: int, noun: str) -> Member:
    """Return one arm or section, named by its index if it has no name."""
    if isinstance(entry, Mapping):
        try:
            built = kind(**named(entry, index))
        except InputError as error:
            raise error.within(f"{label(entry, index)}.") from None
    elif isinstance(entry, kind):
        built = entry if entry.name else entry.having(name=str(index))
    else:
        raise InputError(
            str(index),
            f"is {shown(entry)}, but must be a table of fields",
            f"give the fields of one {noun}",
        )
    if built.name.isdecimal() and built.name != str(index):
        raise InputError(
            f"{index}.name",
            f"is {built.name!r}, which reads as the index of another {noun}",
            "give it a letter",
        )
    return built
