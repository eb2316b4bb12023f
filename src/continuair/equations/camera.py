"""The pinhole camera in plain NumPy, Eqs. (13) and (14): projection and interaction matrix."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.equations.turns import Array, euler_angles
from continuair.errors import InputError, shown
from continuair.typing import ArrayLike
from continuair.vehicle.camera import Camera
from continuair.vehicle.vehicle import Vehicle

TIP_OF_STRAIGHT_ARM = np.diag([1.0, -1.0, -1.0])
"""Axes of the straight arm's tip frame in the arm's axes."""

_LEVEL = 1e-9
"""Cosine below which an angle counts as a right angle."""


def on_body(vehicle: Vehicle) -> Array:
    """Return the camera's position (..., 3) in body axes with its arm straight [m].

    Without arms the camera is at uav.mount.
    """
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
    """Return the camera's axes (..., 3, 3) in body axes with its arm straight."""
    tip = TIP_OF_STRAIGHT_ARM @ Rotation.from_quat(vehicle.camera.attitude).as_matrix()
    if not vehicle.has_arm_list or not vehicle.arms:
        return np.asarray(tip)
    arm = vehicle.arms[vehicle.camera_arm]
    return np.asarray(Rotation.from_quat(arm.attitude).as_matrix() @ tip)


def facing(
    vehicle: Vehicle,
    point: ArrayLike,
    distance: ArrayLike,
    camera_attitude: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Return the UAV pose from which the camera looks at a point.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle or a batch, with a camera; all arms count as straight.
    point : array_like (..., 3)
        Point in world axes [m].
    distance : array_like (...)
        Distance of the camera from the point, along the camera's optical axis [m].
    camera_attitude : array_like (4,), optional
        Unit quaternion x y z w from camera axes to world axes. Default: straight down, with the
        camera's x axis parallel to the world's.

    Returns
    -------
    position : array (..., 3)
        Position of the UAV in world axes [m].
    angles : array (..., 3)
        Euler angles (φ, θ, ψ) [rad]. By default zero for a camera that looks along its tip.

    Raises
    ------
    InputError
        If the UAV would be upside down.
    """
    axes = axes_on_body(vehicle)
    wanted = TIP_OF_STRAIGHT_ARM
    if camera_attitude is not None:
        wanted = Rotation.from_quat(camera_attitude).as_matrix()
    turn = wanted @ np.swapaxes(axes, -1, -2)
    if (turn[..., 2, 2] < -_LEVEL).any():
        side = "down" if camera_attitude is None else "so"
        raise InputError(
            "camera",
            (
                f"looks along {shown(np.round(axes.reshape(-1, 3, 3)[0, :, 2], 2))} in "
                f"body axes, but is to look along {shown(np.round(wanted[:, 2], 2))} in "
                "the world, for which the UAV would be upside down"
            ),
            f"give it a camera that looks {side} in hover",
        )
    back = np.multiply.outer(distance, -wanted[:, 2])
    at = np.asarray(point) + back - np.einsum("...ij,...j->...i", turn, on_body(vehicle))
    return np.asarray(at), euler_angles(turn)


def project(points: ArrayLike) -> Array:
    """Project points in camera axes into the normalised image.

    Parameters
    ----------
    points : array_like (n, 3)
        Points in camera axes [m].

    Returns
    -------
    array (2n,)
        X/Z and Y/Z of each point in turn.

    Raises
    ------
    InputError
        If the shape differs, or a point is not in front of the camera.

    Notes
    -----
    Eq. (13) of Amiri et al. (2026).
    """
    rows = np.asarray(points, float)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise InputError(
            "points", f"has shape {rows.shape}", "give (n, 3) coordinates in camera axes"
        )
    if not (rows[:, 2] > 0.0).all():
        raise InputError(
            "points",
            f"holds the depth {shown(float(rows[:, 2].min()))} m",
            "give points in front of the camera",
        )
    return (rows[:, :2] / rows[:, 2:]).ravel()


def to_pixels(camera: Camera, image: ArrayLike) -> Array:
    """Return pixels of a normalised image.

    Parameters
    ----------
    camera : Camera
        The camera's focal lengths and principal point [px].
    image : array_like (..., 2n)
        Normalised image coordinates.

    Returns
    -------
    array (..., 2n)
        Pixel coordinates.

    Notes
    -----
    Eq. (13) of Amiri et al. (2026).
    """
    image = np.asarray(image, float)
    n = image.shape[-1] // 2
    return image * np.tile(camera.focal_length, n) + np.tile(camera.principal_point, n)


def to_normalised(camera: Camera, pixels: ArrayLike) -> Array:
    """Return the normalised image of pixels.

    Parameters
    ----------
    camera : Camera
        The camera's focal lengths and principal point [px].
    pixels : array_like (..., 2n)
        Pixel coordinates.

    Returns
    -------
    array (..., 2n)
        Normalised image coordinates.

    Notes
    -----
    Eq. (13) of Amiri et al. (2026).
    """
    pixels = np.asarray(pixels, float)
    n = pixels.shape[-1] // 2
    return (pixels - np.tile(camera.principal_point, n)) / np.tile(camera.focal_length, n)


def in_view(camera: Camera, image: ArrayLike, depth: ArrayLike) -> Array:
    """Return whether points lie in the image and in front of the camera.

    Parameters
    ----------
    camera : Camera
        The camera's intrinsics and image size [px].
    image : array_like (..., 2n)
        Normalised image coordinates.
    depth : array_like (..., n)
        Depths along the optical axis [m].

    Returns
    -------
    array (..., n) of bool
        True for each point in view.
    """
    pixels = to_pixels(camera, image)
    pairs = pixels.reshape(*pixels.shape[:-1], -1, 2)
    inside = ((pairs >= 0.0) & (pairs <= np.asarray(camera.image_size, float))).all(-1)
    return inside & (np.asarray(depth) > 0.0)


def interaction_matrix(image: ArrayLike, depth: ArrayLike) -> Array:
    """Return the interaction matrix of a normalised image.

    Parameters
    ----------
    image : array_like (..., 2n)
        Normalised image coordinates.
    depth : array_like (..., n) or float
        Depths along the optical axis, or one for all points [m].

    Returns
    -------
    array (..., 2n, 6)
        L, from the camera's twist (v, ω) in camera axes [m/s, rad/s] to the rate of the image
        [1/s].

    Notes
    -----
    Eq. (14) of Amiri et al. (2026).
    """
    image = np.asarray(image, float)
    pairs = image.reshape(*image.shape[:-1], -1, 2)
    x, y = pairs[..., 0], pairs[..., 1]
    inverse = 1.0 / np.broadcast_to(np.asarray(depth, float), x.shape)
    nil = np.zeros_like(x)
    u = np.stack([-inverse, nil, x * inverse, x * y, -(1.0 + x**2), y], axis=-1)
    v = np.stack([nil, -inverse, y * inverse, 1.0 + y**2, -x * y, -x], axis=-1)
    return np.stack([u, v], axis=-2).reshape(*image.shape, 6)


def interaction_matrix_in_pixels(camera: Camera, pixels: ArrayLike, depth: ArrayLike) -> Array:
    """Return L (..., 2n, 6) in pixels: the normalised one with each row times its focal length."""
    L = interaction_matrix(to_normalised(camera, pixels), depth)
    return np.tile(camera.focal_length, L.shape[-2] // 2)[:, None] * L
