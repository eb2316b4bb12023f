"""The vehicle: a multirotor UAV, a continuum arm that hangs from it, and a camera at the arm's tip.

SI units and radians. Body axes: x forward, y left, z up, at the UAV's centre of mass.
All classes are immutable and hold plain numbers and tuples; in a *batched* vehicle, made by
`Vehicle.replace`, the fields that vary hold NumPy arrays with a leading dimension (runs).
"""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import field_validator, model_validator

from continuair.errors import ContinuairWarning, InputError, shown
from continuair.files import Presets
from continuair.vehicle import runs as batch
from continuair.vehicle.fields import (
    CountPair,
    Matrix,
    NotNegative,
    NotNegativePair,
    Pair,
    Part,
    Positive,
    PositivePair,
    Quaternion,
    Title,
    Vector,
    symmetric_matrix,
)

_PRESETS = Presets("vehicle", Path(__file__).parents[1] / "presets")
# No rigid body exceeds the triangle inequality of its moments; rounded or measured data may.
_TRIANGLE_EXCESS = 0.05
_ROUNDING = 1e-9
_UNIT_NORM_TOLERANCE = 1e-3


class Uav(Part):
    """The multirotor, a rigid body."""

    mass: Positive
    """the mass of the UAV without the arm [kg]"""

    inertia: Matrix
    """the inertia of the UAV about its centre of mass in body axes, diagonal or 3x3 [kg m²]"""

    mount: Vector = (0.0, 0.0, 0.0)
    """the position of the arm's base in body axes, as 3 numbers [m]"""

    @field_validator("inertia", mode="before")
    @classmethod
    def _physical_inertia(cls, value: object) -> Matrix:
        matrix = symmetric_matrix(value)
        if not (matrix[0][1] or matrix[0][2] or matrix[1][2]):
            moments = sorted((matrix[0][0], matrix[1][1], matrix[2][2]))
        else:
            moments = np.linalg.eigvalsh(matrix).tolist()
        if not moments[0] > 0:
            raise ValueError(
                f"must be positive definite, and its eigenvalue {moments[0]:.6g} kg m² is not"
            )
        _check_triangle("uav.inertia", *moments)
        return matrix


def _check_triangle(field: str, smallest: float, middle: float, largest: float) -> None:
    """Refuse, or warn about, principal moments that no distribution of mass can have."""
    if largest <= (smallest + middle) * (1 + _ROUNDING):
        return
    text = (
        f"the largest principal moment {largest:.6g} kg m² exceeds the sum "
        f"{smallest + middle:.6g} kg m² of the other two"
    )
    if largest > (smallest + middle) * (1 + _TRIANGLE_EXCESS):
        raise ValueError(f"belongs to no rigid body: {text} by more than 5 %")
    text = f"{field} belongs to no rigid body: {text} by less than 5 %, and is used as given."
    warnings.warn(text, ContinuairWarning, stacklevel=2)


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
        _check_triangle("arm.disks inertia", *sorted((transverse, transverse, axial)))
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
    """the radius of the round, solid backbone [m]"""

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

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.damping and self.damping_ratio is not None:
            raise InputError(
                f"damping is {self.damping} while damping_ratio is {self.damping_ratio}; "
                "keep one of them (damping 0, or no damping_ratio)."
            )
        for index, disk in enumerate(self.disks):
            if disk.position > self.length * (1 + _ROUNDING):
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


class Camera(Part):
    """The camera at the arm's tip; it looks along the arm's tangent, +z of the tip frame."""

    focal_length: PositivePair = (800.0, 800.0)
    """the focal lengths along the image's axes, as 2 numbers [px]"""

    principal_point: Pair = (500.0, 500.0)
    """the image coordinates of the optical axis, as 2 numbers [px]"""

    image_size: CountPair = (1000, 1000)
    """the width and height of the image, as 2 whole numbers [px]"""

    position: Vector = (0.0, 0.0, 0.0)
    """the position of the camera in the tip frame, as 3 numbers [m]"""

    attitude: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """the rotation from camera axes to the tip frame, as a unit quaternion (x, y, z, w) [-]"""

    tip_frame: Literal["untwisted", "frenet"] = "untwisted"
    """the tip frame: untwisted, as the material is, or frenet, spinning with the bend direction"""

    noise: NotNegative = 0.0
    """the standard deviation of the feature points' noise [px]"""

    frame_rate: NotNegative = 0.0
    """the frames per second, 0 for one at every control instant [Hz]"""

    latency: NotNegative = 0.0
    """the time from a frame's exposure until the controller has it [s]"""

    @field_validator("attitude")
    @classmethod
    def _unit_norm(cls, value: tuple[float, float, float, float]) -> tuple[float, ...]:
        norm = math.hypot(*value)
        if abs(norm - 1) > _UNIT_NORM_TOLERANCE:
            raise ValueError(f"must have norm 1 (it has {norm:.6g})")
        if abs(norm - 1) <= _ROUNDING:
            return value
        return tuple(component / norm for component in value)


class Vehicle(Part):
    """An aerial continuum manipulator: UAV, arm and camera; for one run or batched over runs."""

    name: Title
    """the name of the vehicle, for titles and provenance"""

    uav: Uav
    """the UAV's parameters, a table ([uav])"""

    arm: Arm
    """the arm's parameters, a table ([arm])"""

    camera: Camera = Camera()
    """the camera's parameters, a table ([camera])"""

    @field_validator("uav", "arm", "camera", mode="before")
    @classmethod
    def _one_run(cls, value: object) -> object:
        if batch.count(value) is not None:
            raise ValueError("must be of one run (a batched vehicle is made by vehicle.replace)")
        return value

    @property
    def sections(self) -> int:
        """The number of the arm's sections, each of constant curvature."""
        return 1

    @property
    def mass(self) -> float:
        """The mass of UAV and arm [kg]."""
        return self.uav.mass + self.arm.mass

    @property
    def runs(self) -> int | None:
        """The number of runs of a batched vehicle; None for a plain one."""
        return batch.count(self)

    def replace(self, changes: Mapping[str, Any]) -> Vehicle:
        """Return a copy with dotted fields changed, as in `{"arm.radius": 0.01, "uav.mass": 3}`.

        Parameters in a list go by index: "arm.disks.0.mass". A value with one more leading
        dimension than its field is an array over runs and makes the copy batched; all such arrays
        must be of one length. (An inertia of shape (3, 3) is one matrix; give three runs of
        diagonals as (3, 3, 3).) Raises InputError, naming the run, if any run is not valid.
        """
        if not isinstance(changes, Mapping):
            text = "must be a mapping such as {'arm.radius': 0.01}"
            raise InputError(f"changes is {shown(changes)}, but {text}; give the fields to change.")
        return batch.replace(self, changes)

    def select(self, run: int) -> Vehicle:
        """Return the plain vehicle of one run; a plain vehicle is the same in every run."""
        if self.runs is None:
            return self
        whole = isinstance(run, (int, np.integer)) and not isinstance(run, bool)
        if not whole or not 0 <= run < self.runs:
            valid = f"give a whole number from 0 to {self.runs - 1}"
            raise InputError(f"run is {shown(run)}, but the vehicle has {self.runs} runs; {valid}.")
        selected: Vehicle = batch.pick(self, int(run))
        return selected

    def describe(self) -> dict[str, Any]:
        """Return all parameters as nested dicts and lists that JSON can hold, for provenance."""
        description: dict[str, Any] = batch.plain(self)
        return description


def preset_names() -> tuple[str, ...]:
    """Return the names of the vehicles that come with the package."""
    return _PRESETS.names()


def load_vehicle(name_or_path: str | os.PathLike[str]) -> Vehicle:
    """Return a preset by name, or the vehicle that a TOML file describes.

    Raises InputError if there is no such preset or file, or the file is no valid vehicle.
    """
    file, fields = _PRESETS.read(name_or_path)
    try:
        return Vehicle(**fields)
    except InputError as error:
        raise error.within(f"{file}: ") from None


def check_vehicle(value: Any) -> Vehicle:
    """Return a vehicle, plain or batched; raises InputError for anything else."""
    if not isinstance(value, Vehicle):
        raise InputError(f"vehicle is {shown(value)}; load one with continuair.load_vehicle.")
    return value


def check_single_vehicle(value: Any) -> Vehicle:
    """Return a vehicle that must be of one run; raises InputError for anything else."""
    if check_vehicle(value).runs is not None:
        raise InputError(
            f"vehicle {shown(value.name)} holds {value.runs} runs, but must be of one run; choose "
            "one with vehicle.select(run)."
        )
    return value
