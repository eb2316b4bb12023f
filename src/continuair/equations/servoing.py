"""Classic visual servoing of a camera that moves freely, without a vehicle, as textbooks have it.

What remains of the law, Eqs. (15) and (16), when the camera's velocity can be chosen: the ground
that it shares with other packages, such as ViSP's tutorial-ibvs-4pts.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.equations.camera import interaction_matrix, project
from continuair.equations.kinematics import Array, skew


def kinematic_servoing(
    points: Any, start: tuple[Any, Any], wanted: Any, gain: float, period: float, steps: int
) -> tuple[Array, Array]:
    """Errors e = s_d - s (steps, 2n), normalised, and twists v = λ L⁺ e (steps, 6) of each step.

    points: (n, 3) on the object at rest [m]. start: position (3,) [m] and rotation (3, 3) of the
    object in camera axes. wanted: the image s_d (2n,), normalised. gain: λ [1/s].

    The twist, (v, ω) [m/s, rad/s] in camera axes, is held for a period [s], and L is that of the
    image and the depths of now, Eq. (14). Raises InputError if a point gets behind the camera.
    """
    object_in_camera = _pose(*start)
    errors, twists = [], []
    for _ in range(steps):
        seen = np.asarray(points, float) @ object_in_camera[:3, :3].T + object_in_camera[:3, 3]
        image = project(seen)
        error = np.asarray(wanted, float) - image
        twist = gain * np.linalg.pinv(interaction_matrix(image, seen[:, 2])) @ error
        errors.append(error)
        twists.append(twist)
        # What is at rest moves against the camera.
        object_in_camera = rigid_motion(twist, -period) @ object_in_camera
    return np.array(errors), np.array(twists)


def rigid_motion(twist: Any, time: float) -> Array:
    """Pose (4, 4) after a time [s] of a body that keeps its twist (6,), (v, ω) in its own axes.

    The exponential of X = [[[ω]×, v], [0, 0]] t, in closed form since X⁴ = -θ² X², θ = |ω t|:
    1 + X + (1 - cos θ)/θ² X² + (θ - sin θ)/θ³ X³.
    """
    moved = np.asarray(twist, float) * time
    X = np.zeros((4, 4))
    X[:3, :3], X[:3, 3] = skew(moved[3:]), moved[:3]
    θ = float(np.linalg.norm(moved[3:]))
    squared = 0.5 * np.sinc(θ / (2.0 * np.pi)) ** 2
    # The limit, which is exact to rounding there, for an angle whose cube is next to nothing.
    cubed = (θ - np.sin(θ)) / θ**3 if θ > 1e-5 else 1.0 / 6.0
    return np.asarray(np.eye(4) + X + squared * X @ X + cubed * X @ X @ X)


def _pose(position: Any, axes: Any) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, position
    return pose
