"""Arms of one or more sections, and rigid bodies on their tips."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

from pydantic import field_validator, model_validator

from continuair.errors import InputError, named_fields
from continuair.vehicle.fields import ROUNDING, Name, NotNegative, Part, Vector
from continuair.vehicle.inertia import (
    Matrix,
    UnitQuaternion,
    check_moments,
    principal_moments,
    symmetric_matrix,
)
from continuair.vehicle.members import NamedPart, members
from continuair.vehicle.section import Section
from continuair.vehicle.tendon import Tendon, check_tendons

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


class ArmChain(NamedPart):
    """Arm of one or more sections of constant curvature, with an optional body on its tip.

    The arm's axes have their origin at the mount. At bend 0 the arm points along their -z.
    """

    refused: ClassVar[Mapping[str, str]] = {
        "tendons": "is not a known field; write [[arm.tendon]]",
        **dict.fromkeys(named_fields(Section).keys() - {"name", "tendon"}, _OF_SECTION),
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

    tendon: tuple[Tendon, ...] = ()
    """the tendons that bend the arm, a list of tables ([[arm.tendon]])"""

    @field_validator("section", mode="before")
    @classmethod
    def _named_sections(cls, value: object) -> tuple[Section, ...]:
        found = members(Section, value, "section")
        for index, section in enumerate(found):
            if section.tendon:
                raise InputError(
                    f"{index}.tendon",
                    "is of a section, but tendons belong to the arm",
                    "write [[arm.tendon]], with the section in which they end",
                )
        return found

    @field_validator("tendon", mode="before")
    @classmethod
    def _named_tendons(cls, value: object) -> tuple[Tendon, ...]:
        return members(Tendon, value, "tendon") if value else ()

    @model_validator(mode="after")
    def _fitting(self) -> Self:
        check_tendons(self.tendon, self.section)
        return self

    @property
    def mass(self) -> float:
        """Return the mass of the sections and of the body on the tip [kg]."""
        return sum(each.mass for each in self.section) + (self.tip.mass if self.tip else 0.0)
