"""The camera on the tip: its pose, its Jacobian J_c, and the image Jacobian J_L = L J_c.

The paper's J_L, before Eq. (15), is L T_a⁻¹ J_t. There T_a applies the UAV's Euler-rate matrix to
linear velocity too, where a rotation into camera axes belongs. `printed_image_jacobian` serves to
measure the effect of that error.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.equations.camera import interaction_matrix, project
from continuair.equations.kinematics import (
    Array,
    TipArguments,
    euler_rate_matrix,
    jacobian,
    position,
    rotation,
    section_rotation,
    skew,
    tip_of,
)
from continuair.typing import ArrayLike
from continuair.vehicle.vehicle import Vehicle


def camera_pose(vehicle: Vehicle, q: Array) -> tuple[Array, Array]:
    """Return the camera's pose in the world.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].

    Returns
    -------
    position : array (3,)
        Position in world axes [m].
    axes : array (3, 3)
        Rotation from camera to world axes.

    Raises
    ------
    InputError
        If `q` has another shape.

    Notes
    -----
    Eq. (1) of Amiri et al. (2026) and the camera's mount, camera.position and camera.attitude. The
    mount is in the frame camera.tip_frame of the tip of the arm camera.arm. Below κ_s the tip is
    that of κ_s (Remark 1).
    """
    camera = vehicle.camera
    at, tip = position(vehicle, q, **_tip(vehicle)), _tip_axes(vehicle, q)
    at = at + tip @ np.asarray(camera.position)
    return at, tip @ Rotation.from_quat(camera.attitude).as_matrix()


def camera_jacobian(vehicle: Vehicle, q: Array) -> Array:
    """Return the Jacobian from q̇ to the camera's twist.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].

    Returns
    -------
    array (6, 6 + 2N)
        J_c, to the twist (v, ω) in camera axes [m/s, rad/s].

    Raises
    ------
    InputError
        If `q` has another shape.

    Notes
    -----
    J of the tip, before Eq. (8) of Amiri et al. (2026), with v = v_tip + ω × r, r from tip to
    camera. Both are turned from world into camera axes. The convention camera.tip_frame decides how
    ψ̇a turns the camera.
    """
    J = jacobian(vehicle, q, tip_frame=vehicle.camera.tip_frame, **_tip(vehicle))
    off_tip = _tip_axes(vehicle, q) @ np.asarray(vehicle.camera.position)
    linear, angular = J[:3] - skew(off_tip) @ J[3:], J[3:]
    _, axes = camera_pose(vehicle, q)
    return np.vstack([axes.T @ linear, axes.T @ angular])


def look(vehicle: Vehicle, q: Array, points: ArrayLike) -> tuple[Array, Array]:
    """Return the image and the depths of points in the world.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    points : array_like (n, 3)
        Points in world axes [m].

    Returns
    -------
    image : array (2n,)
        Normalised image coordinates.
    depths : array (n,)
        Depths along the optical axis [m].

    Raises
    ------
    InputError
        If a shape differs, or a point is not in front of the camera.

    Notes
    -----
    Eq. (13) of Amiri et al. (2026).
    """
    at, axes = camera_pose(vehicle, q)
    seen = (np.asarray(points, float) - at) @ axes
    return project(seen), seen[:, 2]


def image_jacobian(vehicle: Vehicle, q: Array, points: ArrayLike) -> Array:
    """Return the Jacobian from q̇ to the rate of the image of points at rest.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    points : array_like (n, 3)
        Points in world axes [m].

    Returns
    -------
    array (2n, 6 + 2N)
        J_L = L J_c, for normalised image coordinates.

    Raises
    ------
    InputError
        If a shape differs, or a point is not in front of the camera.

    Notes
    -----
    Eqs. (12) and (14) of Amiri et al. (2026).
    """
    return interaction_matrix(*look(vehicle, q, points)) @ camera_jacobian(vehicle, q)


def printed_image_jacobian(vehicle: Vehicle, q: Array, points: ArrayLike) -> Array:
    """Return the image Jacobian with the paper's T_a⁻¹ in it.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array (6 + 2N,)
        The paper's coordinates [m, rad, 1/m].
    points : array_like (n, 3)
        Points in world axes [m].

    Returns
    -------
    array (2n, 6 + 2N)
        L T_a⁻¹ J_t, for normalised image coordinates.

    Raises
    ------
    InputError
        If a shape differs, or a point is not in front of the camera.

    Notes
    -----
    T_a = diag(T_e, T_e), Eq. (17) of Amiri et al. (2026). J_t is read as the text has it,
    "expressed in the tip frame", and at the camera. It is then J_c, and T_a⁻¹ is the only
    difference from `image_jacobian`. T_a⁻¹ is 1 only for a level UAV without yaw. In world axes, as
    J_p and J_o are printed, J_t would need a rotation for T_a⁻¹, and the product would be wrong
    everywhere.
    """
    T = euler_rate_matrix(q)
    nil = np.zeros((3, 3))
    T_a = np.block([[T, nil], [nil, T]])
    L = interaction_matrix(*look(vehicle, q, points))
    return np.asarray(L @ np.linalg.solve(T_a, camera_jacobian(vehicle, q)))


def _tip(vehicle: Vehicle) -> TipArguments:
    return tip_of(vehicle, vehicle.camera_arm)


def _tip_axes(vehicle: Vehicle, q: Array) -> Array:
    frame = section_rotation(vehicle, q, tip_frame=vehicle.camera.tip_frame, **_tip(vehicle))
    return rotation(q) @ frame
