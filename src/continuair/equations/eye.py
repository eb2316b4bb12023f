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
    tip_of,
)
from continuair.vehicle.vehicle import Vehicle


def camera_pose(vehicle: Vehicle, q: Array) -> tuple[Array, Array]:
    """Position (3,) [m] of the camera and its axes (3, 3) in the world: Eq. (1) and its mount.

    q: (6 + 2N,). The mount, camera.position and camera.attitude, is in the frame camera.tip_frame
    of the tip of its arm, camera.arm. Below κ_s the tip is that of κ_s (Remark 1).
    """
    camera = vehicle.camera
    at, tip = position(vehicle, q, **_tip(vehicle)), _tip_axes(vehicle, q)
    at = at + tip @ np.asarray(camera.position)
    return at, tip @ Rotation.from_quat(camera.attitude).as_matrix()


def camera_jacobian(vehicle: Vehicle, q: Array) -> Array:
    """J_c (6, 6 + 2N): from q̇ to the camera's twist (v, ω) [m/s, rad/s], in camera axes.

    J at the tip, before Eq. (8), with v = v_tip + ω × (what the camera sits off the tip),
    both turned from world into camera axes. The frame camera.tip_frame decides what ψ̇a turns.
    """
    J = jacobian(vehicle, q, tip_frame=vehicle.camera.tip_frame, **_tip(vehicle))
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
    """J_L (2n, 6 + 2N), from q̇ to the rate of the image of points at rest: L J_c, Eqs. (12), (14).

    points: (n, 3) in the world [m]. Raises InputError for a point that is not in front of
    the camera.
    """
    return interaction_matrix(*look(vehicle, q, points)) @ camera_jacobian(vehicle, q)


def printed_image_jacobian(vehicle: Vehicle, q: Array, points: Any) -> Array:
    """J_L (2n, 6 + 2N) with the paper's T_a⁻¹ in it, L T_a⁻¹ J_t; arguments as in `image_jacobian`.

    T_a = diag(T_e, T_e), Eq. (17). J_t is read as the text has it, "expressed in the tip frame",
    and at the camera: that is J_c, so that T_a⁻¹ is all that differs. It is 1 for a level UAV
    without yaw only. Read in world axes, as J_p and J_o are printed, J_t would need a rotation for
    T_a⁻¹, and the product is wrong everywhere.
    """
    T = euler_rate_matrix(q)
    nil = np.zeros((3, 3))
    T_a = np.block([[T, nil], [nil, T]])
    L = interaction_matrix(*look(vehicle, q, points))
    return np.asarray(L @ np.linalg.solve(T_a, camera_jacobian(vehicle, q)))


def _tip(vehicle: Vehicle) -> dict[str, Any]:
    return tip_of(vehicle, vehicle.camera_arm)


def _tip_axes(vehicle: Vehicle, q: Array) -> Array:
    frame = section_rotation(vehicle, q, tip_frame=vehicle.camera.tip_frame, **_tip(vehicle))
    return rotation(q) @ frame
