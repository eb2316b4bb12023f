"""Vehicles, random states and slopes that the tests of the readable form share."""

from collections.abc import Callable
from typing import Any

import numpy as np

import continuair as ca

# Remark 1 off, so that these tests see the equations and not the threshold.
PLAIN = ca.load_vehicle("paper").replace({"arm.kappa_s": 0.0})
FURNISHED = PLAIN.replace(
    {
        "arm.damping": 0.3,
        "uav.mount": [0.03, -0.05, 0.04],
        "uav.inertia": [[0.024, 0.001, 0.002], [0.001, 0.026, -0.001], [0.002, -0.001, 0.04]],
        "arm.disks": [
            {"position": 0.6, "mass": 0.05, "inertia": [2e-5, 3e-5]},
            {"position": 1.0, "mass": 0.1, "inertia": [3e-5, 5e-5]},
        ],
    }
)
# A thick, light tube of an arm: rotary inertia is a tenth of its bend inertia.
THICK = FURNISHED.replace({"arm.radius": 0.2, "arm.density": 5.0, "arm.youngs_modulus": 1e4})
# Each furnishing alone: one that is wrong cannot hide behind another.
VEHICLES = {
    "plain": PLAIN,
    "damped": PLAIN.replace({"arm.damping": 0.3}),
    "mounted": PLAIN.replace({"uav.mount": [0.03, -0.05, 0.04]}),
    "disks": PLAIN.replace({"arm.disks": FURNISHED.arm.disks}),
    "thick": THICK,
    "furnished": FURNISHED,
}


def states(n: int, seed: int, smallest: float = 0.2) -> list[tuple[np.ndarray, np.ndarray]]:
    """n pairs (q, q̇): |κ| from smallest to a full circle, |θ| <= 1.2, all other angles."""
    rng = np.random.default_rng(seed)
    full = np.pi
    q = np.column_stack(
        [
            rng.uniform(-2, 2, (n, 3)),
            rng.uniform(-full, full, n),
            rng.uniform(-1.2, 1.2, n),
            rng.uniform(-full, full, n),
            np.exp(rng.uniform(np.log(smallest), np.log(2 * full), n)) * rng.choice([-1, 1], n),
            rng.uniform(-full, full, n),
        ]
    )
    return list(zip(q, rng.normal(size=(n, 8)), strict=True))


def slope(function: Callable[[np.ndarray], Any], q: np.ndarray) -> np.ndarray:
    """∂function/∂q on the last axis, by complex steps: exact to rounding."""
    columns = []
    for i in range(len(q)):
        shifted = q.astype(complex)
        shifted[i] += 1e-30j
        columns.append(np.imag(function(shifted)) / 1e-30)
    return np.stack(columns, axis=-1)


def vector_of(skew: np.ndarray) -> np.ndarray:
    """The vector (3,) of a skew matrix (3, 3), or of the first two axes of more."""
    return np.stack([skew[2, 1], skew[0, 2], skew[1, 0]])
