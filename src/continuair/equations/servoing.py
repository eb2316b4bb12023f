"""Classic visual servoing of a camera that moves freely, without a vehicle.

This is the law of Eqs. (15) and (16) where the camera's velocity can be chosen, as in textbooks.
Other packages have it too, such as ViSP's tutorial-ibvs-4pts.
"""

from __future__ import annotations

import numpy as np

from continuair.equations.camera import interaction_matrix, project
from continuair.equations.kinematics import Array, skew
from continuair.typing import ArrayLike


def kinematic_servoing(
    points: ArrayLike,
    start: tuple[ArrayLike, ArrayLike],
    wanted: ArrayLike,
    gain: float,
    period: float,
    steps: int,
) -> tuple[Array, Array]:
    """Simulate image-based visual servoing of a camera without dynamics.

    Parameters
    ----------
    points : array_like (n, 3)
        Points on an object at rest, in its axes [m].
    start : tuple of array_like
        Position (3,) [m] and rotation (3, 3) of the object in camera axes.
    wanted : array_like (2n,)
        Desired image s_d, normalised.
    gain : float
        Gain λ [1/s].
    period : float
        Time for which each twist is held [s].
    steps : int
        Number of steps.

    Returns
    -------
    errors : array (steps, 2n)
        Errors e = s_d - s of each step, normalised.
    twists : array (steps, 6)
        Twists v = λ L⁺ e of each step, (v, ω) in camera axes [m/s, rad/s].

    Raises
    ------
    InputError
        If a point is not in front of the camera.

    Notes
    -----
    L is that of the current image and depths, Eq. (14) of Amiri et al. (2026).
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
        # An object at rest moves against the camera.
        object_in_camera = rigid_motion(twist, -period) @ object_in_camera
    return np.array(errors), np.array(twists)


def rigid_motion(twist: ArrayLike, time: float) -> Array:
    """Return the pose of a body after a time at constant twist.

    Parameters
    ----------
    twist : array_like (6,)
        (v, ω) in the body's axes [m/s, rad/s].
    time : float
        Time [s].

    Returns
    -------
    array (4, 4)
        Pose at `time` relative to the pose at 0, as a homogeneous transform.

    Notes
    -----
    The exponential of X = [[[ω]×, v], [0, 0]] t, in closed form since X⁴ = -θ² X², θ = ‖ω t‖:
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


def _pose(position: ArrayLike, axes: ArrayLike) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, position
    return pose
