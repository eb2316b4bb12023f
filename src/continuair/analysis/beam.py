"""The arm as an Euler-Bernoulli beam: what the assumption of constant curvature costs.

Small deflections of the straight arm. Its deflection is a sum of shapes whose curvatures are
Legendre polynomials. One of them, constant over the whole arm, is the model of this package; with
SHAPES of them between any two disks the lowest frequency is that of the beam.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigvalsh

from continuair import checks
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

Array = NDArray[np.float64]

SHAPES = 8
"""Shapes per piece and plane of bending: the lowest frequency is then off by 1e-8 at most."""

CUTS = 30
"""Disks at which the arm is cut, as the beam's curvature jumps or has kinks there; of more, those
that move most as it bends: the worst of 80 frequencies, of up to 60 heavy disks, was 2.3e-4 off."""


def curvature_error(vehicle: Vehicle, *, gravity: float = 9.81) -> dict[str, dict[str, Any]]:
    """Return how far an arm of constant curvature is from an Euler-Bernoulli beam.

    Quantity -> model, reference (both in `units`) and error, model / reference - 1. Compared are
    the tip's deflection and angle under a force and a couple at the tip, its sag when the arm is
    held level, and the first bending frequency with the UAV clamped and free, disks included; of
    the two planes, which differ for a free UAV of unequal moments, the lower one's. Last, beside
    them, what decoupling does to the last of these: the clamped frequency of an arm of constant
    curvature against its free one. Gravity [m/s²] acts in the sag alone.
    Raises InputError for a batched vehicle.
    """
    check_single_vehicle(vehicle)
    gravity = checks.gravity(gravity)
    arm = vehicle.arm
    L, EI = arm.length, arm.bending_stiffness
    clamped, free = (beam_frequency(vehicle, free=free) for free in (False, True))
    clamped_arc, free_arc = (arc_frequency(vehicle, free=free) for free in (False, True))
    sag, sag_arc = _sag(vehicle, gravity)
    pairs = {
        "tip deflection under a tip force": (L**3 / (4 * EI), L**3 / (3 * EI), "m/N"),
        "tip angle under a tip force": (L**2 / (2 * EI), L**2 / (2 * EI), "rad/N"),
        "tip deflection under a tip couple": (L**2 / (2 * EI), L**2 / (2 * EI), "m/(N m)"),
        "sag of the tip, arm held level": (sag_arc, sag, "m"),
        "first frequency, UAV clamped": (clamped_arc, clamped, "rad/s"),
        "first frequency, UAV free": (free_arc, free, "rad/s"),
        "first frequency, UAV free, decoupled": (clamped_arc, free_arc, "rad/s"),
    }
    return {
        name: {
            "model": model,
            "reference": reference,
            "error": model / reference - 1 if reference else 0.0,
            "units": units,
        }
        for name, (model, reference, units) in pairs.items()
    }


def beam_frequency(vehicle: Vehicle, *, free: bool = False) -> float:
    """Return the first bending frequency of the straight arm without gravity [rad/s].

    free: the UAV moves, else it is clamped. Of the two planes, which differ for a free UAV of
    unequal moments, the lower one's. Rayleigh-Ritz; the rotary inertia of the sections is included.
    """
    return _first_frequency(vehicle, _Shapes(_cuts(vehicle.arm), SHAPES), free)


def arc_frequency(vehicle: Vehicle, *, free: bool = False) -> float:
    """Return the same of an arm of constant curvature: with one shape for the whole arm."""
    return _first_frequency(vehicle, _Shapes(np.array([0.0, vehicle.arm.length]), 1), free)


@dataclass(frozen=True)
class _Shapes:
    """Curvatures that are Legendre polynomials P_i, i < count, of one piece of the arm, and 0 else.

    cuts: arc lengths (pieces + 1,) from base to tip [m]. Shapes are told piece by piece.
    """

    cuts: Array
    count: int

    def norms(self) -> Array:
        """Integrals of the squares of the curvatures over the arm [m]."""
        return np.outer(np.diff(self.cuts), 1 / (2 * np.arange(self.count) + 1)).ravel()

    def at(self, s: float) -> tuple[Array, Array]:
        """Deflection [m²] and slope [m] at an arc length s [m]."""
        half = np.diff(self.cuts) / 2
        within = np.clip((s - self.cuts[:-1]) / half - 1, -1, 1)
        polynomials = np.eye(self.count)
        once, twice = (legendre.legint(polynomials, m=m, lbnd=-1, axis=1) for m in (1, 2))
        slope = half * legendre.legval(within, once.T)
        # Beyond its piece a shape goes on straight.
        beyond = np.maximum(s - self.cuts[1:], 0)
        deflection = half**2 * legendre.legval(within, twice.T) + slope * beyond
        return deflection.T.ravel(), slope.T.ravel()

    def nodes(self) -> tuple[Array, Array]:
        """Arc lengths and weights [m] at which products of two deflections are integrated."""
        nodes, weights = legendre.leggauss(self.count + 2)
        half = np.diff(self.cuts)[:, None] / 2
        return (self.cuts[:-1, None] + half * (1 + nodes)).ravel(), (half * weights).ravel()


def _cuts(arm: Section) -> Array:
    """Arc lengths of base, tip and disks [m], of many disks those that move most as it bends."""
    between = [disk for disk in arm.disks if 0 < disk.position < arm.length]
    moving = sorted(between, key=lambda disk: -disk.straight_modal_mass)[:CUTS]
    return np.unique([0.0, arm.length, *(disk.position for disk in moving)])


def _first_frequency(vehicle: Vehicle, shapes: _Shapes, free: bool) -> float:
    M = _mass_matrix(vehicle, shapes)
    hub, bend = slice(0, 6), slice(6, None)
    inertia = M[bend, bend]
    if free:
        inertia = inertia - M[bend, hub] @ np.linalg.solve(M[hub, hub], M[hub, bend])
    # Divided by the stiffness, as the inertia of the shapes of a short piece is next to nothing.
    scale = np.sqrt(vehicle.arm.bending_stiffness * np.repeat(shapes.norms(), 2))
    last = len(scale) - 1
    (largest,) = eigvalsh(inertia / np.outer(scale, scale), subset_by_index=[last, last])
    return float(1 / np.sqrt(largest))


def _mass_matrix(vehicle: Vehicle, shapes: _Shapes) -> Array:
    """Mass matrix of the straight vehicle; coordinates: UAV velocity 3, spin 3, then 2 per shape.

    Body axes. A bend coordinate is a shape's curvature where its piece ends [1/m], in x, then y.
    """
    arm = vehicle.arm
    moments = np.array([arm.transverse_inertia_per_length, arm.axial_inertia_per_length])
    motions = [
        _weighted_motions(vehicle, shapes, s, arm.mass_per_length * ds, moments * ds)
        for s, ds in zip(*shapes.nodes(), strict=True)
    ]
    for disk in arm.disks:
        motions.append(_weighted_motions(vehicle, shapes, disk.position, disk.mass, disk.inertia))
    of_all = np.vstack(motions)
    M: Array = of_all.T @ of_all
    M[:3, :3] += vehicle.uav.mass * np.eye(3)
    M[3:6, 3:6] += vehicle.uav.inertia
    return M


def _weighted_motions(
    vehicle: Vehicle, shapes: _Shapes, s: float, mass: float, inertia: Any
) -> Array:
    """Velocity and spin (6, coordinates) of a section or disk at arc length s, over coordinates,
    times the roots of its mass and of its inertia, transverse and axial [kg m²]."""
    deflection, slope = shapes.at(s)
    x, y, z = np.asarray(vehicle.uav.mount) - [0.0, 0.0, s]
    moves = np.zeros((3, 6 + 2 * len(slope)))
    turns = np.zeros_like(moves)
    moves[:, :3] = turns[:, 3:6] = np.eye(3)
    # The velocity ω × r, as a matrix on ω.
    moves[:, 3:6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    moves[0, 6::2] = moves[1, 7::2] = deflection
    # A deflection towards x tilts the hanging arm about -y, one towards y about x.
    turns[1, 6::2], turns[0, 7::2] = -slope, slope
    transverse, axial = np.sqrt(inertia)
    turns *= np.array([transverse, transverse, axial])[:, None]
    return np.vstack([np.sqrt(mass) * moves, turns])


def _sag(vehicle: Vehicle, gravity: float) -> tuple[float, float]:
    """Deflection of the tip under gravity across the straight arm [m]: beam, constant curvature."""
    arm = vehicle.arm
    L, EI = arm.length, arm.bending_stiffness
    beam = arm.mass_per_length * L**4 / 8
    arc = arm.mass_per_length * L**4 / 12
    for disk in arm.disks:
        a = disk.position
        beam += disk.mass * a**2 * (3 * L - a) / 6
        arc += disk.mass * a**2 * L / 4
    return gravity * beam / EI, gravity * arc / EI
