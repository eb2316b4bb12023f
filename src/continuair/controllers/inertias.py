"""Inertias for the design of controllers, of vehicles with straight or bent arms."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from continuair import checks
from continuair.equations.camera import axes_on_body, on_body
from continuair.equations.kinematics import skew
from continuair.equations.level import level_inertia
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
    return straight_inertia(check_single_vehicle(vehicle, strain=True))[:6, :6]


def bend_inertia(vehicle: Vehicle) -> np.ndarray:
    """Return the inertia (bends, bends) of the straight arms' bend vectors, base fixed [kg m⁴]."""
    return straight_inertia(check_single_vehicle(vehicle, strain=True))[6:, 6:]


# Many gains are designed for one vehicle.
@lru_cache(maxsize=1024)
def straight_inertia(vehicle: Vehicle) -> np.ndarray:
    """Return M (coordinates, coordinates) of the level, straight vehicle, about B's origin.

    Its rows are those of velocity, angular velocity and the rates of the coordinates of sections.
    """
    return checks.frozen(level_inertia(vehicle, np.zeros(vehicle.layout.bends)))


def camera_inertia(vehicle: Vehicle) -> np.ndarray:
    """Return Λ (6, 6), the inertia at the camera in its axes, with all arms straight and frozen."""
    return camera_inertia_of(check_single_vehicle(vehicle, strain=True))


# Many gains are designed for one vehicle.
@lru_cache(maxsize=1024)
def camera_inertia_of(vehicle: Vehicle) -> np.ndarray:
    R = axes_on_body(vehicle).T
    J = np.block([[R, -R @ skew(on_body(vehicle))], [np.zeros((3, 3)), R]])
    inverse = np.linalg.inv(J)
    return checks.frozen(inverse.T @ straight_inertia(vehicle)[:6, :6] @ inverse)
