"""Inertias that controllers are tuned by, of vehicles whose arms are straight or held bent."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from continuair import checks
from continuair.equations import mass_matrix
from continuair.equations.camera import axes_on_body, on_body
from continuair.equations.kinematics import skew, unbounded
from continuair.vehicle.arc import polar_of
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle


def rigid_inertia(vehicle: Vehicle) -> np.ndarray:
    """Inertia (6, 6) of the vehicle with its arms frozen straight, about B's origin, body axes."""
    return _rigid_inertia(check_single_vehicle(vehicle))


def _rigid_inertia(vehicle: Vehicle) -> np.ndarray:
    # Polar coordinates have no straight arm: this bend moves the tip by 5e-7 of its length.
    return _of_polar(vehicle, np.outer(1e-6 / _lengths(vehicle), [1.0, 0.0]))[:6, :6]


def _lengths(vehicle: Vehicle) -> np.ndarray:
    return np.array([each.length for arm in vehicle.arms for each in arm.section])


def _of_polar(vehicle: Vehicle, bend: np.ndarray) -> np.ndarray:
    """M (coordinates, coordinates) of the level vehicle with bends (sections, 2) [1/m] of which
    none is 0, κ_s off."""
    q = np.zeros(vehicle.layout.coordinates)
    kappa, psi = polar_of(q)
    kappa[:], psi[:] = np.hypot(*bend.T), np.arctan2(*bend.T[::-1])
    return mass_matrix(unbounded(vehicle), q)


def bend_inertia(vehicle: Vehicle) -> np.ndarray:
    """Inertia (bends, bends) of the straight arms' bend vectors, the base fixed [kg m⁴]."""
    check_single_vehicle(vehicle)
    if not vehicle.has_arm_list:
        return float(vehicle.arm.straight_modal_mass) * np.eye(2)
    return straight_inertia(vehicle)[6:, 6:]


def straight_inertia(vehicle: Vehicle) -> np.ndarray:
    """M (coordinates, coordinates) of the level vehicle with straight arms, about B's origin: for
    velocity, angular velocity and the rates of the bend vectors."""
    return held_inertia(vehicle, np.zeros((vehicle.sections, 2)))


def held_inertia(vehicle: Vehicle, bend: np.ndarray) -> np.ndarray:
    """`straight_inertia` of arms that are held at bends (sections, 2) [1/m]."""
    # As much to both sides, as what is linear in the angle is opposite there: straight to 1e-8,
    # and with as many digits of 1 - cos.
    aside = np.outer(1e-4 / _lengths(vehicle), [1.0, 0.0])
    straight = np.hypot(*bend.T)[:, None] < np.hypot(*aside.T)[:, None]
    found = []
    for side in (aside, -aside):
        at = np.where(straight, side, bend)
        rates = np.eye(6 + bend.size)
        for section, (x, y) in enumerate(at):
            # The rates of κ and ψa by those of the bend vector.
            kappa, own = np.hypot(x, y), vehicle.layout.polar_of(section)
            rates[own, own] = [[x / kappa, y / kappa], [-y / kappa**2, x / kappa**2]]
        found.append(rates.T @ _of_polar(vehicle, at) @ rates)
    return np.asarray(np.mean(found, axis=0))


def camera_inertia(vehicle: Vehicle) -> np.ndarray:
    """Λ (6, 6): inertia that a camera at its arm's tip feels, in its axes, with all arms straight
    and frozen."""
    return camera_inertia_of(check_single_vehicle(vehicle))


# Many gains are designed for one vehicle.
@lru_cache(maxsize=1024)
def camera_inertia_of(vehicle: Vehicle) -> np.ndarray:
    R = axes_on_body(vehicle).T
    J = np.block([[R, -R @ skew(on_body(vehicle))], [np.zeros((3, 3)), R]])
    inverse = np.linalg.inv(J)
    return checks.frozen(inverse.T @ _rigid_inertia(vehicle) @ inverse)
