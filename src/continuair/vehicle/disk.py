"""Spacer disks and tip masses of a section."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydantic import field_validator

from continuair.vehicle.fields import Count, NotNegative, NotNegativePair, Part
from continuair.vehicle.inertia import check_moments

MOST_DISKS = 1000
"""Most disks of a section. Each costs time and memory in every vehicle of a batch."""


class Disk(Part):
    """Spacer disk normal to the backbone; at the section's end it is a tip mass."""

    position: NotNegative
    """the arc length from the section's base to the disk [m]"""

    mass: NotNegative
    """the mass of the disk [kg]"""

    inertia: NotNegativePair = (0.0, 0.0)
    """the moments of inertia of the disk, transverse and axial [kg m²]"""

    @field_validator("inertia")
    @classmethod
    def _physical_inertia(cls, value: tuple[float, float]) -> tuple[float, float]:
        transverse, axial = value
        check_moments("arm.disks inertia", *sorted((transverse, transverse, axial)))
        return value

    @property
    def axial_inertia(self) -> float:
        """Return the moment of inertia about the tangent [kg m²], an array in a batched vehicle."""
        axial: float = np.transpose(self.inertia)[1]
        return axial

    @property
    def transverse_inertia(self) -> float:
        """Return the moment of inertia about a diameter [kg m²], an array in a batched vehicle."""
        transverse: float = np.transpose(self.inertia)[0]
        return transverse

    @property
    def straight_modal_mass(self) -> float:
        """Return the disk's part of `Section.straight_modal_mass`, m s⁴/4 + j s² [kg m⁴]."""
        square = self.position * self.position
        return self.mass * square * square / 4 + self.transverse_inertia * square


class _EqualDisks(Part):
    count: Count
    """the number of equal disks"""

    mass: NotNegative
    """the mass of each disk [kg]"""

    inertia: NotNegativePair = (0.0, 0.0)
    """the moments of inertia of each disk, transverse and axial [kg m²]"""

    @field_validator("count")
    @classmethod
    def _not_too_many(cls, value: int) -> int:
        if value > MOST_DISKS:
            raise ValueError(f"must be at most {MOST_DISKS:,}")
        return value


def disks_of(value: object, length: float | None) -> object:
    """Return disks as a list; a table {count, mass, inertia} spaces them evenly.

    length: of the section [m]; None if it is invalid, which is reported separately.
    """
    if isinstance(value, Mapping) and "count" in value:
        row = _EqualDisks(**value)
        # The last disk is exactly at the section's end.
        ends = [length * (k / row.count) for k in range(1, row.count + 1)] if length else []
        return tuple(Disk(position=end, mass=row.mass, inertia=row.inertia) for end in ends)
    if isinstance(value, (list, tuple)) and len(value) > MOST_DISKS:
        raise ValueError(f"must hold at most {MOST_DISKS:,} disks (it has {len(value):,})")
    return value
