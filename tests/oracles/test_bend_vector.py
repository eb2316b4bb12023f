"""The kernels near and through the straight arm, where polar coordinates lose their digits."""

import numpy as np
import pytest

import continuair as ca
from continuair.engine.engine import Drive, Engine, Start
from tests.oracles.bend_vector import accelerations

pytestmark = pytest.mark.targets

FURNISHED = ca.load_vehicle("paper").replace(
    {
        "arm.damping": 0.3,
        "uav.mount": [0.03, -0.05, 0.04],
        "arm.disks": [{"position": 0.9, "mass": 0.1, "inertia": [3e-5, 5e-5]}],
    }
)


def kernel(model: str, k: np.ndarray, kd: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """a_o - g, ω̇ and k̈ of the kernels (rows, 8) for a level vehicle."""
    states = np.zeros((len(k), 17))
    states[:, 6] = 1.0
    states[:, 7:9], states[:, 12:15], states[:, 15:17] = k, omega, kd
    nothing = Drive(np.zeros((1, 1, 19)), False, 0, 9.81)
    rates = Engine(FURNISHED, model).derivative(Start(states, np.zeros((len(k), 2))), nothing)
    rates[:, 11] += 9.81
    return np.asarray(rates[:, 9:17])


@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_kernels_equal_kane_on_nodes_from_straight_to_a_small_bend(model: str) -> None:
    rng = np.random.default_rng(3)
    sizes = np.array([0.0, 1e-12, 1e-8, 1e-5, 1e-4, 1e-3, 5e-3, 0.01, 0.02, 0.1, 0.4])
    angle = rng.uniform(-np.pi, np.pi, len(sizes))
    k = sizes[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    kd, omega = rng.normal(size=(len(k), 2)), rng.normal(size=(len(k), 3))
    fast = kernel(model, k, kd, omega)
    for i in range(len(k)):
        slow = np.concatenate(accelerations(FURNISHED, k[i], kd[i], omega[i], model))
        # Reached: some 1e-13; demanded of the straight arm: 1e-9.
        assert np.linalg.norm(fast[i] - slow) < 1e-11 * np.linalg.norm(slow)


@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_accelerations_and_their_derivatives_are_continuous_through_straight(model: str) -> None:
    """One-sided first and second differences meet at k = 0 as the spacing goes to 0."""
    gaps = []
    for h in (2e-2, 1e-2):
        at = np.arange(-3, 4)[:, None] * h * np.array([0.6, -0.8])
        n = len(at)
        rows = kernel(model, at, np.tile([0.7, 0.2], (n, 1)), np.tile([0.5, -0.3, 0.4], (n, 1)))
        first = (-3 * rows[3] + 4 * rows[4] - rows[5]) / (2 * h)
        first_left = (3 * rows[3] - 4 * rows[2] + rows[1]) / (2 * h)
        second = (2 * rows[3] - 5 * rows[4] + 4 * rows[5] - rows[6]) / h**2
        second_left = (2 * rows[3] - 5 * rows[2] + 4 * rows[1] - rows[0]) / h**2
        gaps.append([np.abs(first - first_left).max(), np.abs(second - second_left).max()])
    # A kink would leave a gap that does not shrink; smooth ones shrink by 2 (odd terms) or more.
    assert gaps[1][0] < 0.6 * gaps[0][0] or gaps[1][0] < 1e-8
    assert gaps[1][1] < 0.6 * gaps[0][1] or gaps[1][1] < 1e-4
