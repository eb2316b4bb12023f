"""Masses: M of Eq. (10), and the weight and potential energy of Eq. (9).

Slices of the backbone at Gauss-Legendre nodes, disks, and the bodies on the tips have mass. The
paper's Assumption 1 drops disks. They, the bodies, and the rotary inertia of the slices (ρI across,
2ρI along the tangent) are included here.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from continuair.equations.kinematics import (
    Array,
    check_coordinates,
    euler_rate_matrix,
    jacobian,
    position,
    rotation,
    section_rotation,
    skew,
    tangents,
    tip_of,
)
from continuair.vehicle.arms import TipBody
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

# NumPy takes longer to find the nodes than the mass matrix takes.
_gauss_nodes = functools.lru_cache(np.polynomial.legendre.leggauss)


def mass_matrix(vehicle: Vehicle, q: Array, nodes: int = 24) -> Array:
    """Return the mass matrix, the Hessian of the kinetic energy in q̇.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    array (6 + 2N, 6 + 2N)
        M.

    Raises
    ------
    InputError
        If `q` has another shape.

    Notes
    -----
    M of Eq. (10), from Eq. (8) of Amiri et al. (2026).
    """
    check_coordinates("q", q, vehicle)
    q = np.asarray(q)
    uav = vehicle.uav
    R, T = rotation(q), euler_rate_matrix(q)
    M = np.zeros((len(q), len(q)), dtype=np.result_type(q, float))
    M[:3, :3] = uav.mass * np.eye(3)
    M[3:6, 3:6] = T.T @ R @ np.asarray(uav.inertia) @ R.T @ T
    for arm, index, section in _sections(vehicle):
        s, mass, transverse, axial = slices(section, nodes)
        J = jacobian(vehicle, q, s, arm=arm, section=index)
        linear, angular = J[:, :3], J[:, 3:]
        along = tangents(vehicle, q, s, arm, index)[:, None] @ angular
        M += _squared(linear, mass) + _squared(angular, transverse)
        M += _squared(along, axial - transverse)
    for arm, body in _tip_bodies(vehicle):
        J, axes = _body_jacobian(vehicle, q, arm, body), _tip_axes(vehicle, q, arm)
        linear, angular = J[:3], axes.T @ J[3:]
        M += body.mass * linear.T @ linear + angular.T @ np.asarray(body.inertia) @ angular
    return M


def weight_vector(vehicle: Vehicle, q: Array, gravity: float = 9.81, nodes: int = 24) -> Array:
    """Return the part of G due to gravity.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    gravity : float, default 9.81
        Gravitational acceleration, downwards [m/s²].
    nodes : int, default 24
        Gauss-Legendre nodes on each section's backbone.

    Returns
    -------
    array (6 + 2N,)
        The part of G that the paper names.

    Raises
    ------
    InputError
        If `q` has another shape.

    Notes
    -----
    From Eq. (9) of Amiri et al. (2026).
    """
    check_coordinates("q", q, vehicle)
    G = np.zeros(len(q), dtype=np.result_type(q, float))
    for arm, index, section in _sections(vehicle):
        s, mass, _, _ = slices(section, nodes)
        J = jacobian(vehicle, q, s, arm=arm, section=index)
        G += gravity * np.einsum("n,nj->j", mass, J[:, 2])
    for arm, body in _tip_bodies(vehicle):
        G += gravity * body.mass * _body_jacobian(vehicle, q, arm, body)[2]
    G[2] += vehicle.uav.mass * gravity
    return G


def mass_times_height(vehicle: Vehicle, q: Array, nodes: int = 24) -> float:
    """Return Σ m z of the whole vehicle [kg m], in Eq. (9), with z of the world."""
    total = vehicle.uav.mass * q[2]
    for arm, index, section in _sections(vehicle):
        s, mass, _, _ = slices(section, nodes)
        total = total + mass @ position(vehicle, q, s, arm, index)[:, 2]
    for arm, body in _tip_bodies(vehicle):
        at = position(vehicle, q, **tip_of(vehicle, arm))
        total = total + body.mass * (at + _tip_axes(vehicle, q, arm) @ np.asarray(body.centre))[2]
    return total


def _squared(rows: Array, weights: Array) -> Array:
    """Return Σ weight JᵀJ (k, k) over the Jacobians J (n, i, k) of n slices."""
    flat = rows.reshape(-1, rows.shape[-1])
    return np.asarray((np.repeat(weights, rows.shape[1])[:, None] * flat).T @ flat)


def _sections(vehicle: Vehicle) -> Iterator[tuple[int, int, Section]]:
    """Yield every section with the index of its arm and its own."""
    for arm, chain in enumerate(vehicle.arms):
        for index, section in enumerate(chain.section):
            yield arm, index, section


def _tip_bodies(vehicle: Vehicle) -> Iterator[tuple[int, TipBody]]:
    """Yield the body on the tip of every arm that has one, with the index of the arm."""
    for arm, chain in enumerate(vehicle.arms):
        if chain.tip:
            yield arm, chain.tip


def _tip_axes(vehicle: Vehicle, q: Array, arm: int) -> Array:
    """Return the axes (3, 3) of an arm's tip, and of the body on it, in the world."""
    return rotation(q) @ section_rotation(vehicle, q, **tip_of(vehicle, arm))


def _body_jacobian(vehicle: Vehicle, q: Array, arm: int, body: TipBody) -> Array:
    """Return J (6, 6 + 2N) at the centre of the body on an arm's tip, in world axes."""
    J = jacobian(vehicle, q, **tip_of(vehicle, arm))
    off_tip = _tip_axes(vehicle, q, arm) @ np.asarray(body.centre)
    return np.vstack([J[:3] - skew(off_tip) @ J[3:], J[3:]])


def slices(section: Section, nodes: int) -> tuple[Array, Array, Array, Array]:
    """Return positions and inertias of every backbone node and disk of a section.

    Parameters
    ----------
    section : Section
        The section.
    nodes : int
        Gauss-Legendre nodes on the backbone.

    Returns
    -------
    s : array (n,)
        Arc lengths from the section's base [m].
    mass : array (n,)
        Masses [kg].
    transverse : array (n,)
        Inertias about axes across the tangent [kg m²].
    axial : array (n,)
        Inertias about the tangent [kg m²].
    """
    x, weight = _gauss_nodes(nodes)
    ds = 0.5 * section.length * weight
    masses, inertias = section.mass_shares(0.5 * (1.0 + x))
    rows = [
        np.column_stack(
            [
                0.5 * section.length * (1.0 + x),
                section.mass_per_length * masses * ds,
                section.transverse_inertia_per_length * inertias * ds,
                section.axial_inertia_per_length * inertias * ds,
            ]
        )
    ]
    rows += [
        np.array([[d.position, d.mass, d.transverse_inertia, d.axial_inertia]])
        for d in section.disks
    ]
    s, mass, transverse, axial = np.vstack(rows).T
    return s, mass, transverse, axial
