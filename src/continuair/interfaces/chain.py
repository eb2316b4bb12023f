"""An arm's section as a chain of rigid links, for engines of rigid bodies.

The joints sit in the middles of equal parts of the backbone, so that the first and the last link
are half as long as the others. Errors are proportional to one over the square of their number.
Every joint bends about two axes as its part does, and does not twist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvalsh

from continuair.vehicle.disk import Disk
from continuair.vehicle.section import Section


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


def fastest_mode(section: Section, joints: int) -> tuple[float, float]:
    """Frequency of the clamped chain's fastest mode [rad/s], and its |λ| with damping [1/s]."""
    links = links_of(section, joints)[1:]
    tops = np.cumsum([0.0, *(link.length for link in links)])[:-1]
    centres = tops + [link.centre for link in links]
    levers = np.tril(centres[:, None] - tops)
    turned = np.tril(np.ones((joints, joints)))
    M = levers.T @ np.diag([link.mass for link in links]) @ levers
    M += turned.T @ np.diag([link.transverse for link in links]) @ turned
    K = section.bending_stiffness * joints / section.length * np.eye(joints)
    square = float(eigvalsh(K, M)[-1])
    decay = 0.5 * section.structural_damping / section.bending_stiffness * square
    return np.sqrt(square), max(np.sqrt(square), decay + np.sqrt(max(decay**2 - square, 0.0)))
