"""The vehicle as mass points, whose Jacobians make M, C and G of Eq. (10).

A rigid body moves like six points on its principal axes that have its mass and its second moments.
The kinetic energy of points is Σ ½ m |J q̇|², so that M = Σ m JᵀJ, and C = Σ m JᵀJ̇ is exactly the
matrix of Christoffel symbols. The formulas are those of `continuair.equations`; arrays may hold
complex numbers, or the variables of `expressions`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import Vehicle
from continuair.equations import (
    arc_jacobian,
    arc_position,
    arc_rotation,
    euler_rate_matrix,
    rotation,
    skew,
    slices,
)
from continuair.errors import InputError

Array = np.ndarray


@dataclass(frozen=True)
class Points:
    """Mass points of a vehicle.

    mass (n,) [kg]; s (n,), arc length of the cross-section that each point is fixed to [m], 0 for
    the UAV; offset (n, 3), its place in the axes of that cross-section [m].
    """

    mass: Array
    s: Array
    offset: Array


def points_of(vehicle: Vehicle, *, rotary_inertia: bool, nodes: int) -> Points:
    """Return the points of a UAV with one section, with Gauss nodes along the backbone."""
    mount = np.asarray(vehicle.arms[0].mount)
    inertia, axes = np.linalg.eigh(np.asarray(vehicle.uav.inertia))
    at_uav = _six_points(vehicle.uav.mass, 0.5 * inertia.sum() - inertia) @ axes.T - mount
    found = [(vehicle.uav.mass, 0.0, offset) for offset in at_uav]
    for s, mass, transverse, axial in zip(*slices(vehicle.arm, nodes), strict=True):
        if mass == 0.0:
            if rotary_inertia and max(transverse, axial) > 0.0:
                raise InputError(
                    "arm.disks", "has a disk with inertia and mass 0", "give it a mass"
                )
            continue
        second = np.array([0.5 * axial, 0.5 * axial, transverse - 0.5 * axial])
        if not rotary_inertia:
            second *= 0.0
        found += [(mass, s, offset) for offset in _six_points(mass, second)]
    mass, s, offset = (np.array(column) for column in zip(*found, strict=True))
    return _merged(Points(mass / 6.0, s, offset))


def _six_points(mass: float, second_moments: Array) -> Array:
    """Places (6, 3) on principal axes of a sixth of a mass each, with Σ m x² as given (3,)."""
    reach = np.diag(np.sqrt(3.0 * np.maximum(second_moments, 0.0) / mass))
    return np.vstack([reach, -reach])


def _merged(points: Points) -> Points:
    """Return the points without those that coincide."""
    places, which = np.unique(
        np.column_stack([points.s, points.offset]) + 0.0, axis=0, return_inverse=True
    )
    mass = np.bincount(np.ravel(which), points.mass)
    return Points(mass, places[:, 0], places[:, 1:])


def point_jacobian(q: Array, s: Any, offset: Any, mount: Any) -> Array:
    """J (..., 3, 8) of points in world axes, after Eq. (7): J_p with T for the printed T_e⁻¹.

    q: (8,). s: (...). offset: (..., 3). mount: (3,), where the arm begins, in body axes.
    """
    R, T = rotation(q), euler_rate_matrix(q)
    κ, ψa = q[6], q[7]
    off_section = np.einsum("...ij,...j->...i", arc_rotation(κ, ψa, s), offset)
    at = mount + arc_position(κ, ψa, s) + off_section
    J_pa, J_oa = arc_jacobian(κ, ψa, s)
    to_position = np.broadcast_to(np.eye(3), (*np.shape(s), 3, 3))
    to_attitude = -skew(at @ R.T) @ T
    to_bend = R @ (J_pa - skew(off_section) @ J_oa)
    return np.concatenate([to_position, to_attitude, to_bend], axis=-1)
