"""Gains of the paper's law from a bandwidth, and the inertias that controllers are tuned by."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.camera import interaction_matrix
from continuair.controllers.controller import number
from continuair.equations import mass_matrix
from continuair.errors import InputError
from continuair.vehicle import Vehicle

_FLOOR = 1e-6
"""What makes W definite in the 2n - 6 directions that no camera motion reaches."""


def design(
    vehicle: Vehicle,
    bandwidth: float,
    *,
    desired: Any = None,
    distance: float = 2.0,
    damping: float = 1e-4,
    sliding: float = 1e-6,
) -> dict[str, Any]:
    """Gains Kp, Kd, Cp, Cd, Cs for `servoing`, that make the camera's loop critically damped.

    bandwidth: ω [rad/s]; desired: the image to reach (2n,), normalised, of points `distance` [m]
    away, the paper's 0.5 m square by default; damping: K_d = damping W; sliding: C_s. With
    W = (L⁺)ᵀ Λ L⁺, Λ the inertia that the camera feels, J_LᵀW J_L is that of the vehicle itself, so
    that K_p = ω² W and C_d = 2/ω give every direction seen the same double pole. Raises InputError.
    """
    ω = number("bandwidth", bandwidth, 0.0, above=True)
    if desired is None:
        half = 0.25 / distance
        desired = [half, -half, -half, -half, -half, half, half, half]
    image = np.asarray(desired, float)
    L = interaction_matrix(image, distance)
    if np.linalg.matrix_rank(L) < 6:
        raise InputError(
            "desired does not determine the camera's pose; give at least 4 points that are not on "
            "a line (3 suffice only off the singular cylinder)."
        )
    inverse = np.linalg.pinv(L)
    W = inverse.T @ camera_inertia(vehicle) @ inverse + _FLOOR * np.eye(len(image))
    W = (W + W.T) / 2
    return {
        "Kp": ω**2 * W,
        "Kd": number("damping", damping, 0.0, above=True) * W,
        "Cp": 1.0,
        "Cd": 2.0 / ω,
        "Cs": number("sliding", sliding, 0.0, above=True),
        "points": len(image) // 2,
    }


def rigid_inertia(vehicle: Vehicle) -> np.ndarray:
    """Inertia (6, 6) of the vehicle with its arm frozen straight, about B's origin, body axes."""
    # Polar coordinates have no straight arm: this bend moves the tip by 5e-7 of its length.
    plain, q = vehicle.replace({"arm.kappa_s": 0.0}), np.zeros(8)
    q[6] = 1e-6 / vehicle.arm.length
    return mass_matrix(plain, q)[:6, :6]


def straight_bend_inertia(vehicle: Vehicle) -> float:
    """Inertia of the straight arm's bend about its fixed base, M₇₇ [kg m⁴]."""
    return float(vehicle.arm.straight_modal_mass)


def camera_inertia(vehicle: Vehicle) -> np.ndarray:
    """Λ (6, 6): inertia that a camera at the tip of the straight, frozen arm feels, in its axes."""
    camera, arm = vehicle.camera, vehicle.arm
    tip = np.diag([1.0, -1.0, -1.0])
    on_body = np.asarray(vehicle.uav.mount) + [0.0, 0.0, -arm.length] + tip @ camera.position
    R = (tip @ _rotation(camera.attitude)).T
    x, y, z = on_body
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    J = np.block([[R, -R @ cross], [np.zeros((3, 3)), R]])
    inverse = np.linalg.inv(J)
    return np.asarray(inverse.T @ rigid_inertia(vehicle) @ inverse)


def _rotation(attitude: Any) -> np.ndarray:
    x, y, z, w = attitude
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
