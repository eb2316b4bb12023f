"""The continuum arm: a backbone of constant curvature, with its disks."""

from __future__ import annotations

import math
from typing import Self

import numpy as np
from pydantic import field_validator, model_validator

from continuair.errors import InputError
from continuair.vehicle.fields import (
    ROUNDING,
    NotNegative,
    NotNegativePair,
    Part,
    Positive,
    check_moments,
)

MOST_DISKS = 1000
"""Disks of an arm: each costs time and memory in every vehicle of a batch."""


class Disk(Part):
    """A spacer disk on the arm, normal to the backbone; at the arm's end it is a tip mass."""

    position: NotNegative
    """the arc length from the arm's base to the disk [m]"""

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
        """The moment of inertia about the tangent [kg m²]; an array in a batched vehicle."""
        axial: float = np.transpose(self.inertia)[1]
        return axial

    @property
    def transverse_inertia(self) -> float:
        """The moment of inertia about a diameter [kg m²]; an array in a batched vehicle."""
        transverse: float = np.transpose(self.inertia)[0]
        return transverse


class Arm(Part):
    """The continuum arm: one section of constant curvature that hangs along -z at bend 0.

    The derived properties broadcast: in a batched vehicle they are arrays over the runs.
    """

    length: Positive
    """the length of the backbone [m]"""

    radius: Positive
    """the radius of the round, solid backbone, at most half its length [m]"""

    density: Positive
    """the density of the backbone [kg/m³]"""

    youngs_modulus: Positive
    """Young's modulus of the backbone [Pa]"""

    damping: NotNegative = 0.0
    """the structural damping per unit length: the bend moment per bend rate [N m² s]"""

    damping_ratio: NotNegative | None = None
    """the damping ratio of the clamped first mode at bend 0, instead of damping [-]"""

    disks: tuple[Disk, ...] = ()
    """the spacer disks and tip masses, a list of tables ([[arm.disks]])"""

    kappa_s: NotNegative = 1e-3
    """the curvature below which generalised inputs in polar coordinates use kappa_s in place of
    the curvature they are divided by; Remark 1, Amiri et al. [1/m]"""

    @field_validator("disks", mode="before")
    @classmethod
    def _not_too_many(cls, value: object) -> object:
        if isinstance(value, (list, tuple)) and len(value) > MOST_DISKS:
            raise ValueError(f"must hold at most {MOST_DISKS:,} disks (it has {len(value):,})")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.damping and self.damping_ratio is not None:
            raise InputError(
                f"damping is {self.damping} while damping_ratio is {self.damping_ratio}; "
                "keep one of them (damping 0, or no damping_ratio)."
            )
        for index, disk in enumerate(self.disks):
            if disk.position > self.length * (1 + ROUNDING):
                raise InputError(
                    f"disks.{index}.position is {disk.position}, beyond the arm's end; give a "
                    f"position from 0 to the arm's length {self.length} [m]."
                )
        try:
            usable = 0 < self.clamped_frequency < math.inf
        except (OverflowError, ZeroDivisionError):
            usable = False
        if not usable:
            raise InputError(
                f"radius is {self.radius}, which with length {self.length}, density {self.density} "
                f"and youngs_modulus {self.youngs_modulus} gives no finite natural frequency; "
                "give all of them in SI units [m, kg/m³, Pa]."
            )
        if self.radius > self.length / 2:
            raise InputError(
                f"radius is {self.radius}, with which an arm of length {self.length} would be "
                f"thicker than it is long; give a radius of at most {self.length / 2:g} [m]."
            )
        return self

    @property
    def area(self) -> float:
        """The cross-section's area [m²]."""
        return math.pi * self.radius**2

    @property
    def second_moment(self) -> float:
        """The cross-section's second moment of area about a diameter, I [m⁴]."""
        return math.pi / 4 * self.radius**4

    @property
    def bending_stiffness(self) -> float:
        """The bending stiffness E I [N m²]."""
        return self.youngs_modulus * self.second_moment

    @property
    def mass_per_length(self) -> float:
        """The backbone's mass per unit length, rho A [kg/m]."""
        return self.density * self.area

    @property
    def transverse_inertia_per_length(self) -> float:
        """The sections' moment of inertia about a diameter per unit length, rho I [kg m]."""
        return self.density * self.second_moment

    @property
    def axial_inertia_per_length(self) -> float:
        """The sections' moment of inertia about the tangent per unit length, 2 rho I [kg m]."""
        return 2 * self.transverse_inertia_per_length

    @property
    def backbone_mass(self) -> float:
        """The mass of the backbone without disks [kg]."""
        return self.mass_per_length * self.length

    @property
    def mass(self) -> float:
        """The mass of the arm: backbone and disks [kg]."""
        return self.backbone_mass + sum(disk.mass for disk in self.disks)

    @property
    def straight_modal_mass(self) -> float:
        """The generalised mass of one bend coordinate at bend 0, the base clamped [kg m⁴].

        rho A l⁵/20 + rho I l³/3, plus m s⁴/4 + j_t s² of each disk.
        """
        backbone = (
            self.mass_per_length * self.length**5 / 20
            + self.transverse_inertia_per_length * self.length**3 / 3
        )
        return backbone + sum(
            disk.mass * disk.position**4 / 4 + disk.transverse_inertia * disk.position**2
            for disk in self.disks
        )

    @property
    def clamped_frequency(self) -> float:
        """The natural frequency of the arm at bend 0, base clamped, gravity off [rad/s].

        Constant curvature is stiffer than a true cantilever, whose first mode is 21 % lower.
        """
        stiffness = self.bending_stiffness * self.length
        frequency: float = (stiffness / self.straight_modal_mass) ** 0.5
        return frequency

    @property
    def structural_damping(self) -> float:
        """The structural damping per unit length, from damping or damping_ratio [N m² s]."""
        if self.damping_ratio is None:
            return self.damping
        stiffness = self.bending_stiffness * self.length
        critical: float = 2 * (stiffness * self.straight_modal_mass) ** 0.5 / self.length
        return self.damping_ratio * critical
