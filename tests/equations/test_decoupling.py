"""What masks on M and C do: the coupled model, the paper's decoupled one, and others."""

import numpy as np
import pytest

from continuair import equations as eq
from tests.equations.samples import FURNISHED, PLAIN, states


def test_in_free_fall_only_the_decoupled_bend_feels_gravity() -> None:
    """All masses of the coupled model fall alike, so its own motion has no g in it."""
    for q, qd in states(10, seed=41):
        change = {}
        for mask in ("coupled", "block"):
            fall, float_ = (
                eq.forward_dynamics(FURNISHED, q, qd, mask=mask, gravity=g) for g in (9.81, 0.0)
            )
            change[mask] = (fall - float_)[3:]
            size = np.linalg.norm(float_)
        assert np.linalg.norm(change["block"][3:]) > 0.1
        assert np.linalg.norm(change["coupled"]) < 5e-14 * size


def test_in_free_fall_the_coupled_vehicle_falls_at_g() -> None:
    for q, qd in states(5, seed=42):
        fall, float_ = (eq.forward_dynamics(FURNISHED, q, qd, gravity=g) for g in (9.81, 0.0))
        # The accelerations that both share, up to 1e5 m/s² of the elastic arm, leave 1e-12.
        np.testing.assert_allclose((fall - float_)[:3], [0, 0, -9.81], rtol=0, atol=2e-12)


@pytest.mark.parametrize("softened", [True, False])
def test_a_light_arm_leaves_the_uav_alone_only_if_its_stiffness_vanishes_too(
    softened: bool,
) -> None:
    """UAV accelerations of the two models: O(ρ) apart with E ∝ ρ, but O(1) apart with E fixed.

    A light arm as stiff as ever accelerates as 1/ρ, so its reaction ρ k̈ does not vanish. The arm's
    own accelerations differ at any density: the decoupled arm does not feel that its base turns.
    """
    for q, qd in states(5, seed=43):
        gaps, of_arm = [], []
        for factor in (1e-3, 1e-4):
            stiffness = 1e7 * factor if softened else 207e9
            light = PLAIN.replace({"arm.density": 7850.0 * factor, "arm.youngs_modulus": stiffness})
            a, b = (
                eq.forward_dynamics(light, q, qd, mask=mask, gravity=0.0)
                for mask in ("coupled", "block")
            )
            gaps.append(np.linalg.norm((a - b)[:6]))
            of_arm.append(np.linalg.norm((a - b)[6:]))
        # The next order in ρ: arm over UAV, 3e-4 of mass and 1e-2 of inertia, at the first factor.
        assert gaps[0] / gaps[1] == pytest.approx(10.0 if softened else 1.0, rel=0.05)
        if softened:
            assert of_arm[1] == pytest.approx(of_arm[0], rel=0.05)
            assert of_arm[0] > 0.1


def test_block_mask_couples_uav_and_arm_by_velocities_but_not_by_accelerations() -> None:
    q, qd = states(1, seed=44)[0]
    kept = eq.MASKS["block"]
    M, C = eq.mass_matrix(FURNISHED, q), eq.coriolis_matrix(FURNISHED, q, qd)
    assert np.abs((kept * M)[:6, 6:]).max() == 0
    still = qd.copy()
    still[6:] = 0.0
    # The UAV's block of C changes with the arm's rates.
    change = (kept * (C - eq.coriolis_matrix(FURNISHED, q, still)))[:6, :6]
    assert np.abs(change).max() > 0.01
    pushed = eq.forward_dynamics(FURNISHED, q, qd, tau=[0] * 6 + [1.0, 0.5], mask="block")
    free = eq.forward_dynamics(FURNISHED, q, qd, mask="block")
    np.testing.assert_array_equal(pushed[:6], free[:6])


def test_diagonal_mask_solves_every_row_alone() -> None:
    q, qd = states(1, seed=45)[0]
    tau = np.arange(8.0)
    M, C = eq.mass_matrix(FURNISHED, q), eq.coriolis_matrix(FURNISHED, q, qd)
    left = tau - eq.gravity_vector(FURNISHED, q) - eq.damping_vector(FURNISHED, q, qd)
    expected = (left - np.diag(C) * qd) / np.diag(M)
    found = eq.forward_dynamics(FURNISHED, q, qd, tau, mask="diagonal")
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_any_array_of_factors_is_a_mask() -> None:
    q, qd = states(1, seed=46)[0]
    blocks = [[int((i < 6) == (j < 6)) for j in range(8)] for i in range(8)]
    np.testing.assert_array_equal(
        eq.forward_dynamics(FURNISHED, q, qd, mask=blocks),
        eq.forward_dynamics(FURNISHED, q, qd, mask="block"),
    )
    translation_only = np.ones((8, 8))
    translation_only[:3, 6:] = translation_only[6:, :3] = 0.0
    cut = eq.forward_dynamics(FURNISHED, q, qd, mask=translation_only)
    for mask in ("coupled", "block"):
        assert np.abs(cut - eq.forward_dynamics(FURNISHED, q, qd, mask=mask)).max() > 0.1


def test_zero_tau_is_no_tau() -> None:
    q, qd = states(1, seed=47)[0]
    np.testing.assert_array_equal(
        eq.forward_dynamics(FURNISHED, q, qd),
        eq.forward_dynamics(FURNISHED, q, qd, np.zeros(8), np.zeros(6)),
    )
