"""The first control of ViSP's four-point example, and its interaction matrix in pixels."""

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import equations
from continuair.equations.camera import interaction_matrix_in_pixels
from continuair.vehicle.camera import Camera
from tests.oracles.conftest import Claim

SOURCE = "ViSP (recorded values)"
"""ViSP has no wheel on the Python package index; these are figures that it printed."""

SQUARE = np.array([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.1, 0.1, 0.0], [-0.1, 0.1, 0.0]])
DESIRED_DISTANCE = 0.75
START_POSITION, START_ROTATION_VECTOR = [0.15, -0.1, 1.0], np.radians([10.0, -10.0, 50.0])
RATE, PERIOD = 0.5, 0.04
NORM = 0.4691083424
VELOCITY = [
    0.01003309011,
    -0.04475670204,
    -0.06391670757,
    0.0751236902,
    0.001163861144,
    0.5158536869,
]


def test_four_point_servoing(claim: Claim) -> None:
    """vpServo, eye in hand, current interaction matrix, pseudo-inverse: v = -λ L⁺ (s - s*)."""
    start = START_POSITION, Rotation.from_rotvec(START_ROTATION_VECTOR).as_matrix()
    wanted = equations.project(SQUARE + [0.0, 0.0, DESIRED_DISTANCE])
    errors, twists = equations.kinematic_servoing(SQUARE, start, wanted, RATE, PERIOD, steps=1)
    e, v = errors[0], twists[0]
    what = "ViSP's four-point example, first control"
    claim(f"{what}: norm of the image error", SOURCE, 5e-11, float(np.linalg.norm(e)), NORM)
    claim(
        f"{what}: camera velocity, largest difference of its six components",
        SOURCE,
        5e-11,
        float(np.abs(v - VELOCITY).max()),
        note="ten recorded digits: pip finds no ViSP to run",
    )


def test_interaction_matrix_at_a_pixel(claim: Claim) -> None:
    """f = 800 px, principal point (500, 500): pixel (660, 660) at 5 m, in closed form."""
    expected = [[-160, 0, 32, 32, -832, 160], [0, -160, 32, 832, -32, -160]]
    L = interaction_matrix_in_pixels(Camera(), [660.0, 660.0], 5.0)
    claim(
        "interaction matrix in pixels at (660, 660), 5 m away, largest difference",
        "machinevision-toolbox (recorded values)",
        1e-12,
        float(np.abs(L - expected).max()),
        unit="px/s",
    )
