"""The eye in hand: where the camera is, its Jacobian J_c, and the image Jacobian J_L = L J_c.

The paper's J_L, before Eq. (15), is L T_a⁻¹ J_t: T_a applies the UAV's Euler-rate matrix to linear
velocity too, where a rotation into camera axes belongs. `printed_image_jacobian` measures that
slip.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.equations.camera import interaction_matrix, project
from continuair.equations.kinematics import (
    Array,
    euler_rate_matrix,
    jacobian,
    position,
    rotation,
    section_rotation,
    skew,
)
from continuair.vehicle.vehicle import Vehicle


def camera_pose(vehicle: Vehicle, q: Array) -> tuple[Array, Array]:
    """Position (3,) [m] of the camera and its axes (3, 3) in the world: Eq. (1) and its mount.

    q: (8,). The mount, camera.position and camera.attitude, is in the tip frame camera.tip_frame.
    """
    camera = vehicle.camera
    tip = _tip_axes(vehicle, q)
    at = position(vehicle, q, vehicle.arm.length) + tip @ np.asarray(camera.position)
    return at, tip @ Rotation.from_quat(camera.attitude).as_matrix()


def camera_jacobian(vehicle: Vehicle, q: Array) -> Array:
    """J_c (6, 8): from q̇ to the camera's twist (v, ω) [m/s, rad/s], in camera axes.

    q: (8,). J at the tip, before Eq. (8), with v = v_tip + ω × (what the camera sits off the tip),
    both turned from world into camera axes. The frame camera.tip_frame decides what ψ̇a turns.
    """
    J = jacobian(vehicle, q, vehicle.arm.length, vehicle.camera.tip_frame)
    off_tip = _tip_axes(vehicle, q) @ np.asarray(vehicle.camera.position)
    linear, angular = J[:3] - skew(off_tip) @ J[3:], J[3:]
    _, axes = camera_pose(vehicle, q)
    return np.vstack([axes.T @ linear, axes.T @ angular])


def look(vehicle: Vehicle, q: Array, points: Any) -> tuple[Array, Array]:
    """Normalised image (2n,), Eq. (13), and depths (n,) [m] of points (n, 3) in the world [m].

    Raises InputError for a point that is not in front of the camera.
    """
    at, axes = camera_pose(vehicle, q)
    seen = (np.asarray(points, float) - at) @ axes
    return project(seen), seen[:, 2]


def image_jacobian(vehicle: Vehicle, q: Array, points: Any) -> Array:
    """J_L (2n, 8): from q̇ to the rate of the image of points at rest, L J_c, Eqs. (12) and (14).

    q: (8,); points: (n, 3) in the world [m]. Raises InputError for a point that is not in front of
    the camera.
    """
    return interaction_matrix(*look(vehicle, q, points)) @ camera_jacobian(vehicle, q)


def printed_image_jacobian(vehicle: Vehicle, q: Array, points: Any) -> Array:
    """J_L (2n, 8) with the paper's T_a⁻¹ in it, L T_a⁻¹ J_t; arguments as in `image_jacobian`.

    T_a = diag(T_e, T_e). J_t is read as the text has it, "expressed in the tip frame", and at the
    camera: that is J_c, so that T_a⁻¹ is all that differs. It is 1 for a level UAV without yaw
    only. Read in world axes, as J_p and J_o are printed, J_t would need a rotation for T_a⁻¹, and
    the product is wrong everywhere.
    """
    T = euler_rate_matrix(q)
    nil = np.zeros((3, 3))
    T_a = np.block([[T, nil], [nil, T]])
    L = interaction_matrix(*look(vehicle, q, points))
    return np.asarray(L @ np.linalg.solve(T_a, camera_jacobian(vehicle, q)))


def _tip_axes(vehicle: Vehicle, q: Array) -> Array:
    frame = section_rotation(vehicle, q, vehicle.arm.length, vehicle.camera.tip_frame)
    return rotation(q) @ frame
