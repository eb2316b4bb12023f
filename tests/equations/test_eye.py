"""The eye in hand: its Jacobians against the slopes of its pose and of what it sees."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from continuair import equations
from tests.closed_loop import eye

FRAMES = ("untwisted", "frenet")
STATES = 250


@pytest.mark.parametrize("tip_frame", FRAMES)
def test_j_c_is_the_rate_of_the_cameras_pose(tip_frame: str) -> None:
    vehicle = eye.with_frame(eye.MOUNTED, tip_frame)
    h = 1e-5
    for q, qd in zip(*eye.states(STATES, seed=4), strict=True):
        _, axes = equations.camera_pose(vehicle, q)
        (ahead, to), (behind, start) = (
            equations.camera_pose(vehicle, q + shift * qd) for shift in (h, -h)
        )
        v = axes.T @ (ahead - behind) / (2 * h)
        # In the camera's axes midway; those at the middle differ by h².
        w = Rotation.from_matrix(start.T @ to).as_rotvec() / (2 * h)
        found = equations.camera_jacobian(vehicle, q) @ qd
        assert np.abs(found - [*v, *w]).max() < eye.DIFFERENCES * max(1.0, np.abs(found).max())


@pytest.mark.long
@pytest.mark.parametrize("tip_frame", FRAMES)
def test_j_l_is_the_slope_of_the_projection_through_the_full_kinematics(tip_frame: str) -> None:
    vehicle = eye.with_frame(eye.MOUNTED, tip_frame)
    q, _ = eye.states(STATES, seed=5)
    for at in q:
        points = eye.in_front(vehicle, at) + eye.CORNERS
        J_L = equations.image_jacobian(vehicle, at, points)
        error = J_L - eye.finite_differences(vehicle, at, points)
        assert np.abs(error).max() < eye.DIFFERENCES * np.abs(J_L).max()


def slip(roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> float:
    """Error of the printed J_L as a share of J_L's norm; finite differences say what is right."""
    q = np.array([0.0, 0.0, 3.0, roll, pitch, yaw, 0.1, 0.0])
    points = eye.in_front(eye.PLAIN, q) + eye.CORNERS
    right = eye.finite_differences(eye.PLAIN, q, points)
    printed = equations.printed_image_jacobian(eye.PLAIN, q, points)
    return float(np.linalg.norm(printed - right) / np.linalg.norm(right))


def test_the_printed_j_l_is_right_for_a_level_uav_without_yaw_and_at_any_roll() -> None:
    assert slip() < 1e-9
    assert slip(roll=0.3) < 1e-9


def test_the_printed_j_l_is_off_by_the_yaw_and_by_the_pitch() -> None:
    # T_e is Rz(ψ) of a level UAV, which turns by ψ all that is across the optical axis, nearly all.
    for yaw in (np.pi / 6, np.pi / 2, np.pi):
        assert slip(yaw=yaw) == pytest.approx(2 * np.sin(yaw / 2), rel=1e-3)
    # The pitch goes into depth, which the image hardly shows, as 1 / cos θ and tan θ.
    assert 0.01 < slip(pitch=0.2) < 0.02
    assert 0.05 < slip(pitch=0.5) < 0.10
