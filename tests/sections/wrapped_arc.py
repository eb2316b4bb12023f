"""A kind of section that only the tests define: an arc behind functions of its own."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types
from continuair.sections.arc import Arc
from continuair.sections.kind import SectionCode, SectionKind, section_types
from continuair.vehicle.section import Section


class WrappedSection(Section):
    """A section of the kind."""

    @property
    def kind(self) -> str:
        return "wrapped arc"


@dataclass(frozen=True)
class WrappedArc(SectionKind):
    """What an arc is and does, said once more."""

    name: ClassVar[str] = "wrapped arc"
    rows: ClassVar[int] = Arc.rows
    columns: ClassVar[int] = Arc.columns
    parameters: ClassVar[tuple[str, ...]] = Arc.parameters
    polar: ClassVar[bool] = True

    def units(self, section: Section, runs: int) -> np.ndarray:
        return Arc().units(section, runs)

    def stiffness(self, section: Section, runs: int) -> np.ndarray:
        return Arc().stiffness(section, runs)

    def damping(self, section: Section, runs: int) -> np.ndarray:
        return Arc().damping(section, runs)

    def pack(self, section: Section, runs: int) -> dict[str, np.ndarray]:
        return Arc().pack(section, runs)

    def table(self, section: Section, runs: int, at: slice) -> np.ndarray:
        return Arc().table(section, runs, at)

    def device(self, numbers: Numbers, tree: Tree, section: int) -> SectionCode:
        types, own = device_types(numbers, tree), section_types(numbers, tree, self.coordinates)
        arc = Arc().device(numbers, tree, section)
        State, Plant, Table, Real = types.State, types.Plant, types.Table, types.Real
        vec3, Element = types.vec3, own.Element
        ArcShape, Motion, Place = arc.Shape, arc.Motion, arc.Place

        @wp.struct
        class Shape:
            """That of the arc, under another name."""

            own: ArcShape

        @wp.func
        def shape(y: State, table: Table, vehicle: int, w: vec3, v: vec3):
            out = Shape()
            out.own = arc.shape(y, table, vehicle, w, v)
            return out

        @wp.func
        def motion(y: State, s: Shape):
            return arc.motion(y, s.own)

        @wp.func
        def element(plant: Plant, s: Shape, m: Motion):
            return arc.element(plant, s.own, m)

        @wp.func
        def full_bias(s: Shape, e: Element, m: Motion, w: vec3):
            return arc.full_bias(s.own, e, m, w)

        @wp.func
        def turning_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
            return arc.turning_bias(s.own, e, m, w, v)

        @wp.func
        def bending_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
            return arc.bending_bias(s.own, e, m, w, v)

        @wp.func
        def first_bending(s: Shape, e: Element, m: Motion, w: vec3):
            return arc.first_bending(s.own, e, m, w)

        @wp.func
        def own_bending(s: Shape, m: Motion):
            return arc.own_bending(s.own, m)

        @wp.func
        def joint(plant: Plant, s: Shape, m: Motion):
            return arc.joint(plant, s.own, m)

        @wp.func
        def carried(plant: Plant, s: Shape, m: Motion):
            return arc.carried(plant, s.own, m)

        @wp.func
        def place(y: State, plant: Plant, share: Real):
            return arc.place(y, plant, share)

        @wp.func
        def swept_by(at: Place):
            return arc.swept_by(at)

        @wp.func
        def turned_by(at: Place):
            return arc.turned_by(at)

        @wp.func
        def pushed_by(at: Place, force: vec3, moment: vec3):
            return arc.pushed_by(at, force, moment)

        @wp.func
        def bent(y: State):
            return arc.bent(y)

        return holding(SectionCode, locals())
