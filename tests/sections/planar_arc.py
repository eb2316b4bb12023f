"""A kind of section with one coordinate: an arc that bends along x of its base alone."""

from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types
from continuair.sections.arc import Arc
from continuair.sections.arc.element import element_code
from continuair.sections.arc.joint import joint_code
from continuair.sections.arc.place import place_code
from continuair.sections.kind import SectionCode, SectionKind, section_types
from continuair.vehicle.section import Section


class PlanarSection(Section):
    """A section of the kind."""

    @property
    def kind(self) -> str:
        return "planar arc"

    @property
    def coordinates(self) -> int:
        return 1


@dataclass(frozen=True)
class PlanarArc(SectionKind):
    """The first coordinate of an arc whose second one stays 0."""

    name: ClassVar[str] = "planar arc"
    rows: ClassVar[int] = Arc.rows
    columns: ClassVar[int] = Arc.columns
    parameters: ClassVar[tuple[str, ...]] = Arc.parameters

    def units(self, section: Section, runs: int) -> np.ndarray:
        return Arc().units(section, runs)[:, :1]

    def stiffness(self, section: Section, runs: int) -> np.ndarray:
        return Arc().stiffness(section, runs)[:, :1]

    def damping(self, section: Section, runs: int) -> np.ndarray:
        return Arc().damping(section, runs)[:, :1]

    def pack(self, section: Section, runs: int) -> dict[str, np.ndarray]:
        return Arc().pack(section, runs)

    def table(self, section: Section, runs: int, at: slice) -> np.ndarray:
        return Arc().table(section, runs, at)

    def device(self, numbers: Numbers, tree: Tree, section: int) -> SectionCode:
        return _device(numbers, tree, section)


@cache
def _device(numbers: Numbers, tree: Tree, section: int) -> SectionCode:
    types, own = device_types(numbers, tree), section_types(numbers, tree, 1)
    arc, two = element_code(numbers, tree), section_types(numbers, tree, 2)
    tip, places = joint_code(numbers, tree), place_code(numbers, tree)
    State, Plant, Table, Real = types.State, types.Plant, types.Table, types.Real
    vec2, vec3, layout = types.vec2, types.vec3, types.layout
    Element, Bias, Joint, Coordinates = own.Element, own.Bias, own.Joint, own.Coordinates
    ArcElement, ArcBias = two.Element, two.Bias
    Shape, Motion, Place = arc.Shape, arc.Motion, places.Place
    first_row, zero, half = tree.first_row[section], Real(0.0), Real(0.5)
    B, DB = layout.bend_of(section).start, layout.bend_rate_of(section).start
    first = layout.of_section[section].start

    @wp.func
    def shape(y: State, table: Table, vehicle: int, w: vec3, v: vec3):
        return arc.shape(table, vehicle, first_row, y[B] * y[B])

    @wp.func
    def motion(y: State, s: Shape):
        return arc.motion(s, vec2(y[B], zero), vec2(y[DB], zero))

    @wp.func
    def element(plant: Plant, s: Shape, m: Motion):
        e = arc.element(s, plant.axial[section], m)
        out = Element()
        out.H = e.H
        out.I = e.I
        for r in range(3):
            out.F[r, 0] = e.F[r, 0]
            out.L[r, 0] = e.L[r, 0]
        out.N[0, 0] = e.N[0, 0]
        return out

    @wp.func
    def of_arc(e: Element):
        out = ArcElement()
        out.H = e.H
        out.I = e.I
        return out

    @wp.func
    def planar(b: ArcBias):
        out = Bias()
        out.force = b.force
        out.moment = b.moment
        out.coordinates[0] = b.coordinates[0]
        return out

    @wp.func
    def full_bias(s: Shape, e: Element, m: Motion, w: vec3):
        return planar(arc.full_bias(s, of_arc(e), m, w))

    @wp.func
    def turning_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        return planar(arc.turning_bias(s, of_arc(e), m, w, v))

    @wp.func
    def bending_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        return planar(arc.bending_bias(s, of_arc(e), m, w, v))

    @wp.func
    def first_bending(s: Shape, e: Element, m: Motion, w: vec3):
        return planar(arc.first_bending(s, of_arc(e), m, w))

    @wp.func
    def own_bending(s: Shape, m: Motion):
        return Coordinates(arc.own_bending(s, m)[0])

    @wp.func
    def joint(plant: Plant, s: Shape, m: Motion):
        j = tip.joint(s, plant.unit[first], m)
        out = Joint()
        out.p = j.p
        out.R = j.R
        for r in range(3):
            out.P[r, 0] = j.P[r, 0]
            out.W[r, 0] = j.W[r, 0]
        out.moved = j.moved
        out.turned = j.turned
        return out

    @wp.func
    def carried(plant: Plant, s: Shape, m: Motion):
        return tip.carried(s, plant.unit[first], m)

    @wp.func
    def place(y: State, plant: Plant, share: Real):
        return places.place(vec2(y[B], zero), vec2(y[DB], zero), plant.unit[first], share)

    @wp.func
    def swept_by(at: Place):
        return places.swept_by(at)

    @wp.func
    def turned_by(at: Place):
        return places.turned_by(at)

    @wp.func
    def pushed_by(at: Place, force: vec3, moment: vec3):
        return Coordinates(places.pushed_by(at, force, moment)[0])

    @wp.func
    def bent(y: State):
        return half * y[B] * y[B]

    return holding(SectionCode, locals())
