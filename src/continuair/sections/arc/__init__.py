"""The arc: a section of constant curvature, whose coordinates are its bend vector.

Only this package, and vehicle/arc.py for arrays of the host, depend on its two coordinates.
"""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types
from continuair.sections.arc.bend import bend_code
from continuair.sections.arc.element import element_code
from continuair.sections.arc.joint import joint_code
from continuair.sections.arc.moments import MOMENTS, TERMS, length_unit, polynomials
from continuair.sections.arc.place import place_code
from continuair.sections.kind import SectionCode, SectionKind, SymbolicSection
from continuair.sections.rod import Rod
from continuair.typing import Array
from continuair.vehicle.arc import COORDINATES
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section
from continuair.vehicle.strain import CONSTANT

if TYPE_CHECKING:
    from casadi import DM, SX

    from continuair.sections.symbolic import Frame


@dataclass(frozen=True)
class Arc(SectionKind):
    """A section of constant curvature.

    Kernels hold its bend vector in units of 1/λ, and moments about its base as polynomials in the
    squared bend.

    Parameters
    ----------
    coordinates : int, default 2
        Number of coordinates.
    """

    coordinates: int = COORDINATES

    name: ClassVar[str] = "arc"
    rows: ClassVar[int] = TERMS
    columns: ClassVar[int] = len(MOMENTS)
    parameters: ClassVar[tuple[str, ...]] = ("axial",)
    polar: ClassVar[bool] = True

    @property
    def strains(self) -> tuple[tuple[int, int], ...]:
        """Return the component and the order of each coordinate: a bend that is constant."""
        return CONSTANT.coordinates

    def units(self, section: Section, runs: int) -> Array:
        """Return λ [m], the factor from each component of the bend [1/m] to its kernel unit.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        ndarray
            Of shape (runs, coordinates).
        """
        return self._each(length_unit(per_run(section.length, runs)))

    def stiffness(self, section: Section, runs: int) -> Array:
        """Return E I l [N m³], the elastic force per component of the bend.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        ndarray
            Of shape (runs, coordinates).
        """
        return self._each(per_run(section.bending_stiffness, runs) * per_run(section.length, runs))

    def damping(self, section: Section, runs: int) -> Array:
        """Return d l [N m³ s], the damping force per rate of the bend.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        ndarray
            Of shape (runs, coordinates).
        """
        return self._each(per_run(section.structural_damping, runs) * per_run(section.length, runs))

    def pack(self, section: Section, runs: int) -> dict[str, Array]:
        """Return the polar inertia of the cross-sections, of backbone and disks [kg m²].

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        dict of str to ndarray
            Values (runs,) of ``axial``.
        """
        rod = Rod(section, runs)
        return {"axial": np.asarray(rod.backbone[2] + sum(disk[3] for disk in rod.disks))}

    def table(self, section: Section, runs: int, at: slice) -> Array:
        """Return the coefficients of the moments of some runs.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.
        at : slice
            The requested runs.

        Returns
        -------
        ndarray
            Of shape (n, rows, columns).
        """
        rod = Rod(section, runs)
        disks = [[part[at] for part in disk] for disk in rod.disks]
        return polynomials(rod.length[at], [part[at] for part in rod.backbone], disks)

    def symbolic(
        self, section: Section, base: "Frame", coordinates: "SX", rate: "DM", table: Array
    ) -> SymbolicSection:
        """Return the arc in CasADi.

        Parameters
        ----------
        section : Section
            A section of a vehicle.
        base : Frame
            The frame at its base.
        coordinates : SX
            Its bend vector [1/m].
        rate : DM
            Rates of the bend vector, as a matrix times the rates z of the vehicle.
        table : ndarray
            Its table of coefficients.

        Returns
        -------
        SymbolicSection
            The arc.
        """
        from continuair.sections.arc.symbolic import BentArc

        return BentArc(section, base, coordinates, rate, table)

    def device(self, numbers: Numbers, tree: Tree, section: int) -> SectionCode:
        """Return the device code of an arc; equal arguments return the same object.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.
        section : int
            Index of the section among all sections of the tree.

        Returns
        -------
        SectionCode
            The code.
        """
        return _device(numbers, tree, section)

    def _each(self, of_section: np.ndarray) -> np.ndarray:
        """Return values of a section (runs,), repeated for its coordinates (runs, coordinates)."""
        return np.repeat(of_section[:, None], self.coordinates, axis=1)


@cache
def _device(numbers: Numbers, tree: Tree, section: int) -> SectionCode:
    types, of_element = device_types(numbers, tree), element_code(numbers, tree)
    of_joint, of_place = joint_code(numbers, tree), place_code(numbers, tree)
    bends = bend_code(numbers, tree)
    bend_of, bend_rate_of, bent_by = bends.bend_of, bends.bend_rate_of, bends.bent
    Real, State, Plant, Table = types.Real, types.State, types.Plant, types.Table
    vec3, Shape, Motion = types.vec3, of_element.Shape, of_element.Motion
    shape_of, motion_of, element_of = of_element.shape, of_element.motion, of_element.element
    joint_of, carried_of, place_of = of_joint.joint, of_joint.carried, of_place.place
    first_row, first = tree.first_row[section], types.layout.of_section[section].start

    @wp.func
    def shape(y: State, table: Table, vehicle: int, w: vec3, v: vec3):
        b = bend_of(y, section)
        return shape_of(table, vehicle, first_row, wp.dot(b, b))

    @wp.func
    def motion(y: State, s: Shape):
        return motion_of(s, bend_of(y, section), bend_rate_of(y, section))

    @wp.func
    def element(plant: Plant, s: Shape, m: Motion):
        return element_of(s, plant.axial[section], m)

    @wp.func
    def joint(plant: Plant, s: Shape, m: Motion):
        return joint_of(s, plant.unit[first], m)

    @wp.func
    def carried(plant: Plant, s: Shape, m: Motion):
        return carried_of(s, plant.unit[first], m)

    @wp.func
    def place(y: State, plant: Plant, share: Real):
        b, db = bend_of(y, section), bend_rate_of(y, section)
        return place_of(b, db, plant.unit[first], share)

    @wp.func
    def bent(y: State):
        return bent_by(y, section)

    shared = of_element, of_place
    found = {field: getattr(part, field) for part in shared for field in vars(part)} | locals()
    return holding(SectionCode, found)
