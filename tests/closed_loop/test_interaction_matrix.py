"""The interaction matrix: known values, and the image's motion under a moving camera."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from continuair.equations.camera import (
    interaction_matrix,
    interaction_matrix_in_pixels,
    project,
    to_pixels,
)
from continuair.vehicle.camera import Camera

CAMERA = Camera(focal_length=(800.0, 800.0), principal_point=(500.0, 500.0))


def test_in_pixels_it_has_the_value_of_the_machine_vision_toolbox() -> None:
    """`visjac_p` of machinevision-toolbox at pixel (660, 660), 5 m away."""
    expected = [[-160, 0, 32, 32, -832, 160], [0, -160, 32, 832, -32, -160]]
    L = interaction_matrix_in_pixels(CAMERA, [660.0, 660.0], 5.0)
    np.testing.assert_allclose(L, expected, rtol=0, atol=5e-13)


def moved(points: np.ndarray, twist: np.ndarray, time: float) -> np.ndarray:
    """Points (n, 3) in the axes of a camera that has moved with a constant twist, exactly."""
    v, w = twist[:3], twist[3:]
    turn = Rotation.from_rotvec(time * w)
    # The path under v, integrated: the average of the rotations met.
    angle = np.linalg.norm(w)
    axis = w / angle
    swept = time * angle
    shift = (
        np.sin(swept) * v
        + (1 - np.cos(swept)) * np.cross(axis, v)
        + (swept - np.sin(swept)) * axis * (axis @ v)
    ) / angle
    return turn.apply(points - shift, inverse=True)


@pytest.mark.parametrize("in_pixels", [False, True], ids=["normalised", "pixels"])
def test_it_is_the_images_rate_under_finite_camera_motion(in_pixels: bool) -> None:
    rng = np.random.default_rng(3)
    camera = Camera(focal_length=(800.0, 650.0), principal_point=(480.0, 510.0))
    for _ in range(1000):
        points = rng.uniform([-1.5, -1.5, 1.0], [1.5, 1.5, 4.0], (4, 3))
        twist, image = rng.normal(size=6), project(points)
        h = 1e-5
        ahead, behind = (project(moved(points, twist, t)) for t in (h, -h))
        if in_pixels:
            ahead, behind = to_pixels(camera, ahead), to_pixels(camera, behind)
            L = interaction_matrix_in_pixels(camera, to_pixels(camera, image), points[:, 2])
        else:
            L = interaction_matrix(image, points[:, 2])
        rate = (ahead - behind) / (2 * h)
        assert np.abs(L @ twist - rate).max() < 1e-7 * np.abs(rate).max()
