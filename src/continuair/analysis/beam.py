"""The arm as an Euler-Bernoulli beam: what the assumption of constant curvature costs.

Small deflections of the straight arm. Its deflection is a sum of shapes whose curvatures are
Legendre polynomials; the first has constant curvature and is the model of this package alone, and
with SHAPES of them the lowest frequency is that of the beam.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigvalsh

from continuair import checks
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

Array = NDArray[np.float64]

SHAPES = 12
"""Shapes per plane of bending: the lowest frequency is then off by 1e-11, and by 1e-4 at most with
disks between base and tip, where the beam's curvature jumps or has kinks."""

_NODES, _WEIGHTS = legendre.leggauss(2 * SHAPES)


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
    clamped_arc, free_arc = (beam_frequency(vehicle, 1, free=free) for free in (False, True))
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


def beam_frequency(vehicle: Vehicle, shapes: int = SHAPES, *, free: bool = False) -> float:
    """Return the first bending frequency of the straight arm without gravity [rad/s].

    shapes: per plane of bending; 1 is the arm of constant curvature. free: the UAV moves, else it
    is clamped. Of the two planes, which differ for a free UAV of unequal moments, the lower one's.
    Rayleigh-Ritz; the rotary inertia of the sections is included.
    """
    M = _mass_matrix(vehicle, shapes)
    hub, bend = slice(0, 6), slice(6, None)
    inertia = M[bend, bend]
    if free:
        inertia = inertia - M[bend, hub] @ np.linalg.solve(M[hub, hub], M[hub, bend])
    arm = vehicle.arm
    # The integral of the square of a Legendre polynomial over the arm.
    stiffness = arm.bending_stiffness * arm.length / (2 * np.arange(shapes) + 1)
    squares = eigvalsh(np.diag(np.repeat(stiffness, 2)), inertia)
    return float(np.sqrt(squares[0]))


def _mass_matrix(vehicle: Vehicle, shapes: int) -> Array:
    """Mass matrix of the straight vehicle; coordinates: UAV velocity 3, spin 3, then 2 per shape.

    Body axes. A bend coordinate is a shape's curvature at the tip [1/m], in x and in y in turn.
    """
    arm, uav = vehicle.arm, vehicle.uav
    M: Array = np.zeros((6 + 2 * shapes, 6 + 2 * shapes))
    M[:3, :3], M[3:6, 3:6] = uav.mass * np.eye(3), uav.inertia
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        s, ds = arm.length * (1 + node) / 2, arm.length * weight / 2
        inertia = (arm.transverse_inertia_per_length * ds, arm.axial_inertia_per_length * ds)
        _add(M, vehicle, shapes, s, arm.mass_per_length * ds, inertia)
    for disk in arm.disks:
        _add(M, vehicle, shapes, disk.position, disk.mass, disk.inertia)
    return M


def _add(
    M: Array, vehicle: Vehicle, shapes: int, s: float, mass: float, inertia: tuple[float, float]
) -> None:
    """Add a section or disk at arc length s; inertia: transverse and axial [kg m²]."""
    deflection, slope = _shape_functions(shapes, vehicle.arm.length, s)
    x, y, z = np.asarray(vehicle.uav.mount) - [0.0, 0.0, s]
    moves = np.zeros((3, len(M)))
    turns = np.zeros((3, len(M)))
    moves[:, :3] = turns[:, 3:6] = np.eye(3)
    # The velocity ω × r, as a matrix on ω.
    moves[:, 3:6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    moves[0, 6::2] = moves[1, 7::2] = deflection
    # A deflection towards x tilts the hanging arm about -y, one towards y about x.
    turns[1, 6::2], turns[0, 7::2] = -slope, slope
    M += mass * moves.T @ moves + turns.T * [inertia[0], inertia[0], inertia[1]] @ turns


def _shape_functions(shapes: int, length: float, s: float) -> tuple[Array, Array]:
    """Deflection [m²] and slope [m] at s of the shapes with curvatures P_i(2 s/l - 1)."""
    at = 2 * s / length - 1
    polynomials = np.eye(shapes)
    once, twice = (legendre.legint(polynomials, m=m, lbnd=-1, axis=1) for m in (1, 2))
    deflection = (length / 2) ** 2 * np.asarray(legendre.legval(at, twice.T))
    slope = length / 2 * np.asarray(legendre.legval(at, once.T))
    return deflection, slope


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
