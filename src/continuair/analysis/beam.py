"""The arm as an Euler-Bernoulli beam: the error of the constant-curvature assumption.

Small deflections of the straight arm. The deflection is a sum of shapes whose curvatures are
Legendre polynomials. One of them, constant over the whole arm, is the model of this package; with
SHAPES of them between any two disks the lowest frequency is that of the beam.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigvalsh

from continuair import checks
from continuair.typing import Array, ArrayLike
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

SHAPES = 8
"""Shapes per piece and plane of bending: the lowest frequency is then off by 1e-8 at most."""

CUTS = 30
"""Most disks at which the arm is cut, as the beam's curvature jumps or has kinks there.

Of more disks, those that move most in bending are used. The largest error of 80 frequencies, with
up to 60 heavy disks, was 2.3e-4.
"""


class BeamComparison(TypedDict):
    """A quantity of the arm of constant curvature beside that of its reference.

    model, reference: in `units`; error: model / reference - 1, or 0 if the reference is 0.
    """

    model: float
    reference: float
    error: float
    units: str


def curvature_error(vehicle: Vehicle, *, gravity: float = 9.81) -> dict[str, BeamComparison]:
    """Compare an arm of constant curvature with an Euler-Bernoulli beam.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with an [arm] table.
    gravity : float, optional
        Acceleration of gravity [m/s²]; it affects the sag only.

    Returns
    -------
    dict
        Quantity to `model`, `reference`, `error` (model / reference - 1) and `units`.

    Raises
    ------
    InputError
        If `vehicle` is a batch, or has several sections.

    Notes
    -----
    Compared are the tip's deflection and angle under a tip force and a tip couple, its sag with the
    arm held level, and the first bending frequency with the UAV clamped and free, disks included. A
    free UAV of unequal moments of inertia has two frequencies; the lower one is used. The last row
    gives the error of decoupling: the clamped frequency of the constant-curvature arm against its
    free one.
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

    free: the UAV moves, else it is clamped. A free UAV of unequal moments of inertia has two
    frequencies; the lower one is returned. Rayleigh-Ritz; rotary inertia of the sections is
    included.
    """
    return _first_frequency(vehicle, _Shapes(_cuts(vehicle.arm), SHAPES), free)


def arc_frequency(vehicle: Vehicle, *, free: bool = False) -> float:
    """Return the first bending frequency of an arm of constant curvature [rad/s], as
    `beam_frequency`."""
    return _first_frequency(vehicle, _Shapes(np.array([0.0, vehicle.arm.length]), 1), free)


@dataclass(frozen=True)
class _Shapes:
    """Shapes whose curvature is a Legendre polynomial P_i, i < count, on one piece of the arm, else
    0.

    cuts: arc lengths (pieces + 1,) from base to tip [m]. Shapes are ordered by piece.
    """

    cuts: Array
    count: int

    def norms(self) -> Array:
        """Return the integrals of the squared curvatures over the arm [m]."""
        return np.outer(np.diff(self.cuts), 1 / (2 * np.arange(self.count) + 1)).ravel()

    def at(self, s: float) -> tuple[Array, Array]:
        """Return deflections [m²] and slopes [m] at an arc length s [m]."""
        half = np.diff(self.cuts) / 2
        within = np.clip((s - self.cuts[:-1]) / half - 1, -1, 1)
        polynomials = np.eye(self.count)
        once, twice = (legendre.legint(polynomials, m=m, lbnd=-1, axis=1) for m in (1, 2))
        slope = half * legendre.legval(within, once.T)
        # Beyond its piece a shape is straight.
        beyond = np.maximum(s - self.cuts[1:], 0)
        deflection = half**2 * legendre.legval(within, twice.T) + slope * beyond
        return deflection.T.ravel(), slope.T.ravel()

    def nodes(self) -> tuple[Array, Array]:
        """Return arc lengths and weights [m] that integrate products of two deflections."""
        nodes, weights = legendre.leggauss(self.count + 2)
        half = np.diff(self.cuts)[:, None] / 2
        return (self.cuts[:-1, None] + half * (1 + nodes)).ravel(), (half * weights).ravel()


def _cuts(arm: Section) -> Array:
    """Return arc lengths of base, tip and disks [m]; of many disks, those that move most in
    bending."""
    between = [disk for disk in arm.disks if 0 < disk.position < arm.length]
    moving = sorted(between, key=lambda disk: -disk.straight_modal_mass)[:CUTS]
    return np.unique([0.0, arm.length, *(disk.position for disk in moving)])


def _first_frequency(vehicle: Vehicle, shapes: _Shapes, free: bool) -> float:
    """Return the first bending frequency [rad/s] for a set of shapes."""
    M = _mass_matrix(vehicle, shapes)
    hub, bend = slice(0, 6), slice(6, None)
    inertia = M[bend, bend]
    if free:
        inertia = inertia - M[bend, hub] @ np.linalg.solve(M[hub, hub], M[hub, bend])
    # Scaled by the stiffness, as the inertia of shapes of a short piece is tiny.
    scale = np.sqrt(vehicle.arm.bending_stiffness * np.repeat(shapes.norms(), 2))
    last = len(scale) - 1
    (largest,) = eigvalsh(inertia / np.outer(scale, scale), subset_by_index=[last, last])
    return float(1 / np.sqrt(largest))


def _mass_matrix(vehicle: Vehicle, shapes: _Shapes) -> Array:
    """Return the mass matrix of the straight vehicle: UAV velocity 3, angular velocity 3, 2 per
    shape.

    Body axes. A bend coordinate is a shape's curvature at its piece's end [1/m], in x, then y.
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
    vehicle: Vehicle, shapes: _Shapes, s: float, mass: float, inertia: ArrayLike
) -> Array:
    """Return the mass-weighted Jacobian (6, coordinates) of a section or disk at arc length s.

    Velocity and angular velocity, times the square roots of the mass [kg] and of the inertia,
    transverse and axial [kg m²].
    """
    deflection, slope = shapes.at(s)
    x, y, z = np.asarray(vehicle.uav.mount) - [0.0, 0.0, s]
    moves = np.zeros((3, 6 + 2 * len(slope)))
    turns = np.zeros_like(moves)
    moves[:, :3] = turns[:, 3:6] = np.eye(3)
    # The velocity ω × r, as a matrix on ω.
    moves[:, 3:6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    moves[0, 6::2] = moves[1, 7::2] = deflection
    # A deflection towards x rotates the hanging arm about -y, one towards y about x.
    turns[1, 6::2], turns[0, 7::2] = -slope, slope
    transverse, axial = np.sqrt(inertia)
    turns *= np.array([transverse, transverse, axial])[:, None]
    return np.vstack([np.sqrt(mass) * moves, turns])


def _sag(vehicle: Vehicle, gravity: float) -> tuple[float, float]:
    """Return the tip's deflection [m] under gravity across the straight arm: beam, constant
    curvature."""
    arm = vehicle.arm
    L, EI = arm.length, arm.bending_stiffness
    beam = arm.mass_per_length * L**4 / 8
    arc = arm.mass_per_length * L**4 / 12
    for disk in arm.disks:
        a = disk.position
        beam += disk.mass * a**2 * (3 * L - a) / 6
        arc += disk.mass * a**2 * L / 4
    return gravity * beam / EI, gravity * arc / EI
