"""The arc: a section of constant curvature, whose coordinates are its bend vector.

All that knows that an arc has two coordinates, in a plane, is in this package, and of the host's
arrays in vehicle/arc.py.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types
from continuair.sections.arc.bend import bend_code
from continuair.sections.arc.element import element_code
from continuair.sections.arc.joint import joint_code
from continuair.sections.arc.moments import MOMENTS, TERMS, length_unit, polynomials
from continuair.sections.arc.place import place_code
from continuair.sections.kind import SectionCode, SectionKind
from continuair.vehicle.arc import COORDINATES
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section


@dataclass(frozen=True)
class Arc(SectionKind):
    """A section of constant curvature: its bend vector in units of 1/λ, and moments about its base
    as polynomials in the squared bend."""

    coordinates: int = COORDINATES

    name: ClassVar[str] = "arc"
    rows: ClassVar[int] = TERMS
    columns: ClassVar[int] = len(MOMENTS)
    parameters: ClassVar[tuple[str, ...]] = ("axial",)
    polar: ClassVar[bool] = True

    def units(self, section: Section, runs: int) -> np.ndarray:
        return self._each(length_unit(per_run(section.length, runs)))

    def stiffness(self, section: Section, runs: int) -> np.ndarray:
        return self._each(per_run(section.bending_stiffness, runs) * per_run(section.length, runs))

    def damping(self, section: Section, runs: int) -> np.ndarray:
        return self._each(per_run(section.structural_damping, runs) * per_run(section.length, runs))

    def pack(self, section: Section, runs: int) -> dict[str, np.ndarray]:
        """The polar inertia of the cross-sections, of backbone and disks [kg m²]."""
        rod = _Rod(section, runs)
        return {"axial": np.asarray(rod.backbone[2] + sum(disk[3] for disk in rod.disks))}

    def table(self, section: Section, runs: int, at: slice) -> np.ndarray:
        rod = _Rod(section, runs)
        disks = [[part[at] for part in disk] for disk in rod.disks]
        return polynomials(rod.length[at], [part[at] for part in rod.backbone], disks)

    def symbolic(self, section: Section, base: Any, coordinates: Any, rate: Any, table: Any) -> Any:
        from continuair.sections.arc.symbolic import BentArc

        return BentArc(section, base, coordinates, rate, table)

    def device(self, numbers: Numbers, tree: Tree, section: int) -> SectionCode:
        return _device(numbers, tree, section)

    def _each(self, of_section: np.ndarray) -> np.ndarray:
        """For every coordinate (runs, coordinates) what holds for the section (runs,)."""
        return np.repeat(of_section[:, None], self.coordinates, axis=1)


class _Rod:
    """An arc's parts over runs: length (runs,); (mass, transverse, axial inertia) of the backbone,
    and after its position of every disk."""

    def __init__(self, section: Section, runs: int) -> None:
        self.length = per_run(section.length, runs)
        densities = (
            section.mass_per_length,
            section.transverse_inertia_per_length,
            section.axial_inertia_per_length,
        )
        self.backbone = [per_run(density, runs) * self.length for density in densities]
        self.disks = [
            [
                per_run(value, runs)
                for value in (d.position, d.mass, d.transverse_inertia, d.axial_inertia)
            ]
            for d in section.disks
        ]


@cache
def _device(numbers: Numbers, tree: Tree, section: int) -> SectionCode:
    types, of_element = device_types(numbers, tree), element_code(numbers, tree)
    of_joint, of_place = joint_code(numbers, tree), place_code(numbers, tree)
    bends = bend_code(numbers, tree)
    bend_of, bend_rate_of, bent_by = bends.bend_of, bends.bend_rate_of, bends.bent
    Real, State, Plant, Table = types.Real, types.State, types.Plant, types.Table
    Shape, Motion = of_element.Shape, of_element.Motion
    shape_of, motion_of, element_of = of_element.shape, of_element.motion, of_element.element
    joint_of, carried_of, place_of = of_joint.joint, of_joint.carried, of_place.place
    first_row, first = tree.first_row[section], types.layout.of_section[section].start

    @wp.func
    def shape(y: State, table: Table, vehicle: int):
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
