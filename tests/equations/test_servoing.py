"""Classic visual servoing of a free camera, as in ViSP's four-point tutorial."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import continuair as ca
from tests.refusals import refused

POINTS = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
GAIN, PERIOD = 0.5, 0.04
# Object in the camera's axes: tutorial-ibvs-4pts.cpp of ViSP, where θu is the angle-axis vector.
TURN = Rotation.from_rotvec(np.radians([10.0, -10.0, 50.0])).as_matrix()
START = np.array([0.15, -0.1, 1.0]), TURN
WANTED = ca.equations.project(POINTS + [0.0, 0.0, 0.75])


def servoed(steps: int) -> tuple[np.ndarray, np.ndarray]:
    return ca.equations.kinematic_servoing(POINTS, START, WANTED, GAIN, PERIOD, steps)


def test_it_starts_as_visp_starts() -> None:
    errors, twists = servoed(1)
    assert f"{np.linalg.norm(errors[0]):.10f}" == "0.4691083424"
    expected = [0.01003309011, -0.04475670204, -0.06391670757]
    expected += [0.0751236902, 0.001163861144, 0.5158536869]
    assert [f"{x:.10g}" for x in twists[0]] == [f"{x:.10g}" for x in expected]


def test_it_converges_at_its_gain() -> None:
    norms = np.linalg.norm(servoed(500)[0], axis=1)
    assert (np.diff(norms) < 0.0).all()
    # In the end e, 2e-5 here, shrinks as (1 - λ Δt)ⁿ but for what is quadratic in it.
    assert abs(norms[-1] / norms[-2] - (1.0 - GAIN * PERIOD)) < 5e-7
    assert norms[-1] < 1e-4 * norms[0]


def test_the_first_step_moves_the_image_as_a_camera_on_its_screw_sees_it() -> None:
    """By the path of the camera itself, in 2,000 short straight steps."""
    errors, twists = servoed(2)
    at, axes = np.zeros(3), np.eye(3)
    for _ in range(2000):
        h = PERIOD / 2000
        half = axes @ Rotation.from_rotvec(0.5 * h * twists[0, 3:]).as_matrix()
        at = at + h * half @ twists[0, :3]
        axes = axes @ Rotation.from_rotvec(h * twists[0, 3:]).as_matrix()
    seen = (POINTS @ TURN.T + START[0] - at) @ axes
    # The midpoint rule's error: the square of |ω| h = 1e-5, a share of the 3 mm that are moved.
    np.testing.assert_allclose(WANTED - ca.equations.project(seen), errors[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-5, 1e-3, 1.0, 3.0, 40.0])
def test_a_held_twist_moves_a_body_by_the_exponential_of_its_screw(size: float) -> None:
    v, w = np.array([0.7, -0.2, 0.4]), np.array([2.0, -1.0, 2.0]) / 3.0
    X = np.zeros((4, 4))
    X[:3, :3] = np.cross(np.eye(3), size * w)
    X[:3, 3] = v
    found = ca.equations.rigid_motion([*v, *(size * w)], 1.0)
    # SciPy squares its Padé form up to six times for the largest of these.
    np.testing.assert_allclose(found, expm(X), rtol=0, atol=1e-13)


def test_a_point_that_gets_behind_the_camera_is_told_of() -> None:
    behind = np.array([0.15, -0.1, -1.0]), TURN
    with refused("points"):
        ca.equations.kinematic_servoing(POINTS, behind, WANTED, GAIN, PERIOD, 1)
