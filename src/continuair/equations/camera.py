"""The pinhole camera in plain NumPy, Eqs. (13) and (14): projection and interaction matrix."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.equations.turns import euler_angles
from continuair.errors import InputError, shown
from continuair.vehicle.camera import Camera
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

TIP_OF_STRAIGHT_ARM = np.diag([1.0, -1.0, -1.0])
"""Axes of the straight arm's tip frame in the arm's axes."""

_LEVEL = 1e-9
"""Cosine of an angle that is a right one, but for rounding."""


def on_body(vehicle: Vehicle) -> Array:
    """Position (..., 3) of the camera in body axes with its arm straight [m]; without arms it is at
    uav.mount."""
    off_tip = np.asarray(vehicle.camera.position) @ TIP_OF_STRAIGHT_ARM
    if not vehicle.arms:
        return np.asarray(vehicle.uav.mount + off_tip)
    arm = vehicle.arms[vehicle.camera_arm]
    length = arm.section[0].length
    for section in arm.section[1:]:
        length = length + section.length
    tip = np.multiply.outer(length, [0.0, 0.0, -1.0])
    if not vehicle.has_arm_list:
        return np.asarray(tip + arm.mount + off_tip)
    return np.asarray(Rotation.from_quat(arm.attitude).apply(tip + off_tip) + arm.mount)


def axes_on_body(vehicle: Vehicle) -> Array:
    """The camera's axes (..., 3, 3) in body axes with its arm straight."""
    tip = TIP_OF_STRAIGHT_ARM @ Rotation.from_quat(vehicle.camera.attitude).as_matrix()
    if not vehicle.has_arm_list or not vehicle.arms:
        return np.asarray(tip)
    arm = vehicle.arms[vehicle.camera_arm]
    return np.asarray(Rotation.from_quat(arm.attitude).as_matrix() @ tip)


def facing(
    vehicle: Vehicle, point: Any, distance: Any, camera_attitude: Any = None
) -> tuple[Array, Array]:
    """UAV position (..., 3) [m] and Euler angles (φ, θ, ψ) with the camera `distance` (...) before
    a point (..., 3) on its axis, all arms straight.

    camera_attitude (4,): camera axes to world, x y z w; looking straight down with x along the
    world's by default, level for a camera that looks along its tip. Raises InputError where the
    UAV would have to be upside down, as for a camera that looks up to look down.
    """
    axes = axes_on_body(vehicle)
    wanted = TIP_OF_STRAIGHT_ARM
    if camera_attitude is not None:
        wanted = Rotation.from_quat(camera_attitude).as_matrix()
    turn = wanted @ np.swapaxes(axes, -1, -2)
    if (turn[..., 2, 2] < -_LEVEL).any():
        side = "down" if camera_attitude is None else "so"
        raise InputError(
            f"camera looks along {shown(np.round(axes.reshape(-1, 3, 3)[0, :, 2], 2))} in body "
            f"axes, but is to look along {shown(np.round(wanted[:, 2], 2))} in the world, for "
            f"which the UAV would be upside down; give it a camera that looks {side} in hover."
        )
    back = np.multiply.outer(distance, -wanted[:, 2])
    at = np.asarray(point) + back - np.einsum("...ij,...j->...i", turn, on_body(vehicle))
    return np.asarray(at), euler_angles(turn)


def project(points: Any) -> Array:
    """Normalised image (2n,) of points (n, 3) [m] in camera axes, Eq. (13): X/Z and Y/Z in turn.

    Raises InputError for a point that is not in front of the camera.
    """
    rows = np.asarray(points, float)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise InputError(f"points has shape {rows.shape}; give (n, 3) coordinates in camera axes.")
    if not (rows[:, 2] > 0.0).all():
        raise InputError(
            f"points holds the depth {shown(float(rows[:, 2].min()))} m; give points in front of "
            "the camera."
        )
    return (rows[:, :2] / rows[:, 2:]).ravel()


def to_pixels(camera: Camera, image: Any) -> Array:
    """Pixels (..., 2n) from a normalised image (..., 2n), Eq. (13)."""
    image = np.asarray(image, float)
    n = image.shape[-1] // 2
    return image * np.tile(camera.focal_length, n) + np.tile(camera.principal_point, n)


def to_normalised(camera: Camera, pixels: Any) -> Array:
    """Normalised image (..., 2n) from pixels (..., 2n), Eq. (13)."""
    pixels = np.asarray(pixels, float)
    n = pixels.shape[-1] // 2
    return (pixels - np.tile(camera.principal_point, n)) / np.tile(camera.focal_length, n)


def in_view(camera: Camera, image: Any, depth: Any) -> Array:
    """Whether each point (..., n) lies in the image and in front of the camera."""
    pixels = to_pixels(camera, image)
    pairs = pixels.reshape(*pixels.shape[:-1], -1, 2)
    inside = ((pairs >= 0.0) & (pairs <= np.asarray(camera.image_size, float))).all(-1)
    return inside & (np.asarray(depth) > 0.0)


def interaction_matrix(image: Any, depth: Any) -> Array:
    """L (..., 2n, 6) in normalised coordinates, Eq. (14): the image's rate per camera twist.

    image: (..., 2n); depth: (..., n) or one for all [m]. The twist is (v, ω) in camera axes.
    """
    image = np.asarray(image, float)
    pairs = image.reshape(*image.shape[:-1], -1, 2)
    x, y = pairs[..., 0], pairs[..., 1]
    inverse = 1.0 / np.broadcast_to(np.asarray(depth, float), x.shape)
    nil = np.zeros_like(x)
    u = np.stack([-inverse, nil, x * inverse, x * y, -(1.0 + x**2), y], axis=-1)
    v = np.stack([nil, -inverse, y * inverse, 1.0 + y**2, -x * y, -x], axis=-1)
    return np.stack([u, v], axis=-2).reshape(*image.shape, 6)


def interaction_matrix_in_pixels(camera: Camera, pixels: Any, depth: Any) -> Array:
    """L (..., 2n, 6) in pixels: the normalised one with each row times its focal length."""
    L = interaction_matrix(to_normalised(camera, pixels), depth)
    return np.tile(camera.focal_length, L.shape[-2] // 2)[:, None] * L
