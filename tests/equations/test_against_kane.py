"""The readable form against Kane's equations with the bend vector, and those through straight."""

import numpy as np
import pytest

import continuair as ca
from continuair import equations as eq
from tests.equations import bend_axes, many_digits
from tests.equations.samples import FURNISHED, VEHICLES, states
from tests.oracles.bend_vector import kane_accelerations

MODELS = pytest.mark.parametrize(
    ("model", "mask"), [("coupled", "coupled"), ("decoupled", "block")]
)
STATES_PER_VEHICLE = 17  # six vehicles: about a hundred states for each model


def gaps(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Relative errors of a_o, ω̇ and k̈, each by its own norm: k̈ of a stiff arm hides the others."""
    groups = (slice(0, 3), slice(3, 6), slice(6, 8))
    return np.array(
        [np.linalg.norm((found - expected)[i]) / np.linalg.norm(expected[i]) for i in groups]
    )


@MODELS
@pytest.mark.parametrize("vehicle", VEHICLES.values(), ids=VEHICLES)
def test_papers_equations_are_kanes(vehicle: ca.Vehicle, model: str, mask: str) -> None:
    """Reached: 1e-12, at |κ| near 0.02, where polar roundings have grown to that (as 1/κ²)."""
    rng = np.random.default_rng(51)
    for q, qd in states(STATES_PER_VEHICLE, seed=51, smallest=0.02):
        force, moment, bend_moment = rng.normal(0, 5, 3), rng.normal(0, 1, 3), rng.normal(0, 5, 2)
        wrench = rng.normal(0, 5, 6)
        tau = bend_axes.generalised(q, force, moment, bend_moment)
        polar = eq.forward_dynamics(vehicle, q, qd, tau, wrench, mask=mask)
        v, omega, bend_rate = bend_axes.velocities(q, qd)
        kane = kane_accelerations(
            vehicle,
            eq.rotation(q),
            bend_axes.bend(q),
            v,
            omega,
            bend_rate,
            force_world=force,
            moment_body=moment,
            bend_moment=bend_moment,
            tip_wrench=wrench,
            model=model,
        )
        error = gaps(bend_axes.accelerations(q, qd, polar), np.concatenate(kane))
        assert error.max() < 1e-11


@pytest.mark.long
@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_kanes_equations_keep_their_digits_from_straight_to_a_full_circle(model: str) -> None:
    """Against polar equations with 120 digits; reached: 9e-15, the rounding of a linear system."""
    rng = np.random.default_rng(52)
    for size in (0.0, 1e-12, 1e-6, 1e-3, 0.3, np.pi, 2 * np.pi):
        direction = rng.uniform(-np.pi, np.pi)
        bend = size * np.array([np.cos(direction), np.sin(direction)])
        euler, omega, bend_rate = rng.uniform(-1.2, 1.2, 3), rng.normal(size=3), rng.normal(size=2)
        force, moment, bend_moment = rng.normal(0, 5, 3), rng.normal(0, 1, 3), rng.normal(0, 5, 2)
        wrench = rng.normal(0, 5, 6)
        exact = many_digits.accelerations(
            FURNISHED,
            euler,
            bend,
            omega,
            bend_rate,
            force,
            moment,
            bend_moment,
            wrench,
            model,
            nodes=24 if size > 0.1 else 8,  # eight integrate up to s^15: exact at a small bend
        )
        kane = kane_accelerations(
            FURNISHED,
            eq.rotation(np.array([0, 0, 0, *euler])),
            bend,
            np.zeros(3),
            omega,
            bend_rate,
            force_world=force,
            moment_body=moment,
            bend_moment=bend_moment,
            tip_wrench=wrench,
            model=model,
        )
        assert gaps(np.concatenate(kane), exact).max() < 1e-13


def test_polar_equations_lose_their_digits_where_kanes_do_not() -> None:
    """Why an oracle without polar coordinates is needed below |κ| of 0.02."""
    errors = []
    for κ in (1e-5, 1e-3, 0.1):
        q, qd = np.array([0, 0, 0, 0.3, -0.4, 0.5, κ, 0.7]), np.full(8, 0.5)
        qd[7] = 0.5 / κ
        v, omega, bend_rate = bend_axes.velocities(q, qd)
        kane = kane_accelerations(FURNISHED, eq.rotation(q), bend_axes.bend(q), v, omega, bend_rate)
        polar = bend_axes.accelerations(q, qd, eq.forward_dynamics(FURNISHED, q, qd))
        errors.append(gaps(polar, np.concatenate(kane)).max())
    assert errors[0] > 1e-9 > 1e-11 > errors[1] > 1e-13 > errors[2]


@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_uniform_motion_of_the_whole_changes_nothing(model: str) -> None:
    arguments = ([0.3, 0.2], [0.1, 0.4, -0.2], [0.5, -0.6])
    bend, omega, bend_rate = arguments
    still, moving = (
        kane_accelerations(FURNISHED, np.eye(3), bend, v, omega, bend_rate, model=model)
        for v in (np.zeros(3), np.array([5.0, -3.0, 2.0]))
    )
    for a, b in zip(still, moving, strict=True):
        np.testing.assert_array_equal(a, b)
