"""Inertias for the design of controllers, of vehicles with straight or bent arms."""

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
    """Return the inertia of the vehicle with its arms frozen straight.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).

    Returns
    -------
    array (6, 6)
        Spatial inertia (linear, then angular) about B's origin, body axes [kg, kg m, kg m²].

    Raises
    ------
    InputError
        If `vehicle` is a batch.
    """
    return _rigid_inertia(check_single_vehicle(vehicle))


def _rigid_inertia(vehicle: Vehicle) -> np.ndarray:
    # Polar coordinates have no straight arm: this bend moves the tip by 5e-7 of its length.
    return _of_polar(vehicle, np.outer(1e-6 / _lengths(vehicle), [1.0, 0.0]))[:6, :6]


def _lengths(vehicle: Vehicle) -> np.ndarray:
    return np.array([each.length for arm in vehicle.arms for each in arm.section])


def _of_polar(vehicle: Vehicle, bend: np.ndarray) -> np.ndarray:
    """Return M of the level vehicle with bends (sections, 2) [1/m], none of them 0, κ_s off."""
    q = np.zeros(vehicle.layout.coordinates)
    kappa, psi = polar_of(q)
    kappa[:], psi[:] = np.hypot(*bend.T), np.arctan2(*bend.T[::-1])
    return mass_matrix(unbounded(vehicle), q)


def bend_inertia(vehicle: Vehicle) -> np.ndarray:
    """Return the inertia (bends, bends) of the straight arms' bend vectors, base fixed [kg m⁴]."""
    check_single_vehicle(vehicle)
    if not vehicle.has_arm_list:
        return float(vehicle.arm.straight_modal_mass) * np.eye(2)
    return straight_inertia(vehicle)[6:, 6:]


def straight_inertia(vehicle: Vehicle) -> np.ndarray:
    """Return M (coordinates, coordinates) of the level, straight vehicle, about B's origin.

    Its rows are those of velocity, angular velocity and the rates of the bend vectors.
    """
    return held_inertia(vehicle, np.zeros((vehicle.sections, 2)))


def held_inertia(vehicle: Vehicle, bend: np.ndarray) -> np.ndarray:
    """Return `straight_inertia` for arms that are held at bends (sections, 2) [1/m]."""
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
    """Return Λ (6, 6), the inertia at the camera in its axes, with all arms straight and frozen."""
    return camera_inertia_of(check_single_vehicle(vehicle))


# Many gains are designed for one vehicle.
@lru_cache(maxsize=1024)
def camera_inertia_of(vehicle: Vehicle) -> np.ndarray:
    R = axes_on_body(vehicle).T
    J = np.block([[R, -R @ skew(on_body(vehicle))], [np.zeros((3, 3)), R]])
    inverse = np.linalg.inv(J)
    return checks.frozen(inverse.T @ _rigid_inertia(vehicle) @ inverse)
