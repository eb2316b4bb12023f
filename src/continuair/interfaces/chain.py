"""An arm's section as a chain of rigid links, for engines of rigid bodies.

The joints sit in the middles of equal parts of the backbone, so that the first and the last link
are half as long as the others. Errors are proportional to one over the square of their number.
Every joint moves as the strain of its part allows: it bends about two axes, and twists, stretches
and shears where the section does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import Legendre
from scipy.linalg import eigvalsh

from continuair.vehicle.disk import Disk
from continuair.vehicle.section import Section
from continuair.vehicle.strain import COMPONENTS


@dataclass(frozen=True)
class Link:
    """A rigid piece of a section along -z of its axes: its length [m], mass [kg], the height of its
    centre of mass below its upper end [m], and its moments about that [kg m²]."""

    length: float
    mass: float
    centre: float
    transverse: float
    axial: float


def links_of(section: Section, joints: int) -> list[Link]:
    """Return the links of a section, from its base on: one more than joints."""
    part = section.length / joints
    ends = np.array([0.0, *(part * (np.arange(joints) + 0.5)), section.length])
    found = []
    for start, end in zip(ends[:-1], ends[1:], strict=True):
        last = end == ends[-1]
        disks = [d for d in section.disks if start <= d.position and (last or d.position < end)]
        found.append(_link(section, start, end, disks))
    return found


def _link(section: Section, start: float, end: float, disks: list[Disk]) -> Link:
    length = end - start
    rod = section.mass_per_length * length
    masses = np.array([rod, *(disk.mass for disk in disks)])
    places = np.array([length / 2, *(disk.position - start for disk in disks)])
    own = section.transverse_inertia_per_length * length + rod * length**2 / 12
    centre = masses @ places / masses.sum()
    transverse = own + sum(disk.transverse_inertia for disk in disks)
    axial = section.axial_inertia_per_length * length + sum(disk.axial_inertia for disk in disks)
    transverse += masses @ (places - centre) ** 2
    return Link(float(length), float(masses.sum()), float(centre), float(transverse), float(axial))


@dataclass(frozen=True)
class Freedom:
    """A motion of a joint for one component of the strain.

    component: index in COMPONENTS. kind: "hinge" or "slide"; axis: "x", "y" or "z". sign: of its
    angle or displacement for a positive strain. stiffness, damping: of one joint.
    """

    component: int
    kind: str
    axis: str
    sign: float
    stiffness: float
    damping: float

    @property
    def name(self) -> str:
        """Return "x" of a hinge, and "slide_x" of a slide."""
        return self.axis if self.kind == "hinge" else f"slide_{self.axis}"


_FREEDOMS = {
    "bend_x": ("hinge", "y", -1.0), "bend_y": ("hinge", "x", 1.0), "twist": ("hinge", "z", -1.0),
    "stretch": ("slide", "z", -1.0), "shear_x": ("slide", "x", 1.0), "shear_y": ("slide", "y", 1.0),
}  # fmt: skip
"""Motion of a joint per component: the tip goes to x where the arm turns about -y."""


def freedoms_of(section: Section, joints: int) -> list[Freedom]:
    """Return the motions of a section's joints, hinges before slides, each along x, y and z."""
    part, time = section.length / joints, section.structural_damping / section.bending_stiffness
    found = []
    for component, rigidity in enumerate(section.rigidities()):
        if section.orders.counts[component]:
            stiffness = rigidity / part
            motion = _FREEDOMS[COMPONENTS[component]]
            found.append(Freedom(component, *motion, stiffness, time * stiffness))
    return sorted(found, key=lambda each: (each.kind, each.axis))


def coordinates_of(section: Section, joints: int) -> list[tuple[Freedom, np.ndarray]]:
    """Return, for each coordinate of a section, the freedom of its joints and factors (joints,).

    The coordinate is the sum of the factors times angles or displacements. For an arc it is the
    mean bend; others are the projections on the polynomials, by the midpoint rule.
    """
    by_component = {each.component: each for each in freedoms_of(section, joints)}
    middles = (np.arange(joints) + 0.5) / joints
    return [
        (by_component[component],
         by_component[component].sign * (2 * order + 1) / section.length
         * Legendre.basis(order, domain=[0.0, 1.0])(middles))
        for component, order in section.orders.coordinates
    ]  # fmt: skip


def fastest_mode(section: Section, joints: int) -> tuple[float, float]:
    """Frequency of the clamped chain's fastest mode [rad/s], and its |λ| with damping [1/s]."""
    links, freedoms = links_of(section, joints)[1:], freedoms_of(section, joints)
    stiffness = {COMPONENTS[each.component]: each.stiffness for each in freedoms}
    tops = np.cumsum([0.0, *(link.length for link in links)])[:-1]
    centres = tops + [link.centre for link in links]
    levers, moved = np.tril(centres[:, None] - tops), np.tril(np.ones((joints, joints)))
    masses, across, axial = (
        np.diag([getattr(link, name) for link in links]) for name in ("mass", "transverse", "axial")
    )
    aside, turned, shears = [levers], [moved], [stiffness["bend_x"]]
    if "shear_x" in stiffness:
        # Shear and bend in one plane move the same bodies.
        aside, turned = [levers, moved], [moved, 0.0 * moved]
        shears.append(stiffness["shear_x"])
    pushed, spun = np.hstack(aside), np.hstack(turned)
    square = _fastest(pushed.T @ masses @ pushed + spun.T @ across @ spun, shears)
    for name, bodies in (("twist", axial), ("stretch", masses)):
        if name in stiffness:
            square = max(square, _fastest(moved.T @ bodies @ moved, [stiffness[name]]))
    decay = 0.5 * section.structural_damping / section.bending_stiffness * square
    return np.sqrt(square), max(np.sqrt(square), decay + np.sqrt(max(decay**2 - square, 0.0)))


def _fastest(M: np.ndarray, stiffness: list[float]) -> float:
    """Return the square of the highest frequency; stiffness: of the freedoms of equal parts."""
    K = np.diag(np.repeat(stiffness, len(M) // len(stiffness)))
    return float(eigvalsh(K, M)[-1])
