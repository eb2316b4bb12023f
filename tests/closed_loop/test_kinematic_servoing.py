"""Classic visual servoing of a free camera, as in ViSP's four-point tutorial."""

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.equations.camera import interaction_matrix, project

POINTS = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
GAIN, PERIOD = 0.5, 0.04
# Object in the camera's axes: tutorial-ibvs-4pts.cpp of ViSP, where θu is the angle-axis vector.
START = np.array([0.15, -0.1, 1.0]), Rotation.from_rotvec(np.radians([10.0, -10.0, 50.0]))
WANTED = project(POINTS + [0.0, 0.0, 0.75])


def exponential(twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and rotation of a body that moves with a constant twist in its own axes."""
    generator = np.zeros((4, 4))
    x, y, z = twist[3:]
    generator[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    generator[:3, 3] = twist[:3]
    # The series of the matrix exponential: |twist| times 40 ms is below 0.03.
    term, total = np.eye(4), np.eye(4)
    for n in range(1, 12):
        term = term @ (time * generator) / n
        total = total + term
    return total[:3, 3], total[:3, :3]


def servoed(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Norms of e = s - s* and the camera's twists along the motion."""
    t, R = START[0], START[1].as_matrix()
    norms, twists = [], []
    for _ in range(steps):
        points = POINTS @ R.T + t
        error = project(points) - WANTED
        twist = -GAIN * np.linalg.pinv(interaction_matrix(project(points), points[:, 2])) @ error
        norms.append(np.linalg.norm(error))
        twists.append(twist)
        shift, turn = exponential(twist, PERIOD)
        t, R = turn.T @ (t - shift), turn.T @ R
    return np.array(norms), np.array(twists)


def test_it_starts_as_visp_starts() -> None:
    norms, twists = servoed(1)
    assert f"{norms[0]:.10f}" == "0.4691083424"
    expected = [0.01003309011, -0.04475670204, -0.06391670757]
    expected += [0.0751236902, 0.001163861144, 0.5158536869]
    assert [f"{x:.10g}" for x in twists[0]] == [f"{x:.10g}" for x in expected]


def test_it_converges_at_its_gain() -> None:
    norms, _ = servoed(500)
    assert (np.diff(norms) < 0.0).all()
    # In the end e, 2e-5 here, shrinks as (1 - λ Δt)ⁿ but for what is quadratic in it.
    assert abs(norms[-1] / norms[-2] - (1.0 - GAIN * PERIOD)) < 5e-7
    assert norms[-1] < 1e-4 * norms[0]
