"""The readable form: kinematics, energies and the structure of the dynamics."""

from typing import Any

import numpy as np
import pytest
import sympy as sp

import continuair as ca
from continuair import equations as eq

PLAIN = ca.load_vehicle("paper").replace({"arm.kappa_s": 0.0})
VEHICLE = PLAIN.replace(
    {
        "arm.damping": 0.3,
        "uav.mount": [0.03, -0.05, 0.04],
        "uav.inertia": [[0.024, 0.001, 0.002], [0.001, 0.026, -0.001], [0.002, -0.001, 0.04]],
        "arm.disks": [{"position": 0.6, "mass": 0.05, "inertia": [2e-5, 3e-5]}],
    }
)
RNG = np.random.default_rng(7)


def states(n: int) -> list[tuple[np.ndarray, np.ndarray]]:
    q = RNG.uniform(-1.2, 1.2, (n, 8))
    q[:, 6] = RNG.uniform(0.2, 5.0, n)
    return list(zip(q, RNG.normal(size=(n, 8)), strict=True))


def slope(function: Any, q: np.ndarray) -> np.ndarray:
    """∂function/∂q on the last axis, by a complex step: exact to rounding."""
    columns = []
    for i in range(8):
        shifted = q.astype(complex)
        shifted[i] += 1e-30j
        columns.append(np.imag(function(shifted)) / 1e-30)
    return np.stack(columns, axis=-1)


def test_linear_jacobian_is_the_slope_of_position() -> None:
    for q, _ in states(5):
        expected = slope(lambda x: eq.position(VEHICLE, x, 0.7), q)
        np.testing.assert_allclose(eq.jacobian(VEHICLE, q, 0.7)[:3], expected, atol=1e-13)


@pytest.mark.parametrize("frame", ["untwisted", "frenet"])
def test_angular_jacobian_is_the_spin_of_the_section(frame: str) -> None:
    for q, _ in states(5):
        R = eq.rotation(q) @ eq.section_rotation(VEHICLE, q, 0.7, frame)
        dR = slope(lambda x: eq.rotation(x) @ eq.section_rotation(VEHICLE, x, 0.7, frame), q)
        spin = np.einsum("ijk,lj->ilk", dR, R)
        expected = np.stack([spin[2, 1], spin[0, 2], spin[1, 0]])
        np.testing.assert_allclose(eq.jacobian(VEHICLE, q, 0.7, frame)[3:], expected, atol=1e-13)


def test_appendix_a_is_the_derivative_of_the_hanging_arm() -> None:
    s, κ, ψ = sp.symbols("s kappa psi", positive=True)
    F = sp.Matrix(
        [
            (1 - sp.cos(κ * s)) / κ * sp.cos(ψ),
            (1 - sp.cos(κ * s)) / κ * sp.sin(ψ),
            -sp.sin(κ * s) / κ,
        ]
    )
    J = sp.lambdify((s, κ, ψ), F.jacobian([κ, ψ]))
    q = np.array([0, 0, 0, 0, 0, 0, 1.3, 0.4])
    np.testing.assert_allclose(eq.arm_jacobian(PLAIN, q, 0.8)[0], J(0.8, 1.3, 0.4), atol=1e-14)


def test_appendix_b_integrated_is_what_the_mass_matrix_holds() -> None:
    for q, _ in states(5):
        by_κ, by_ψ = eq.integrated_coupling(PLAIN, q)
        M = eq.mass_matrix(PLAIN, q, nodes=32)
        np.testing.assert_allclose(M[:3, 6], by_κ, atol=1e-12)
        np.testing.assert_allclose(M[:3, 7], by_ψ, atol=1e-12)


def test_appendix_b_printed_is_the_integrand_by_the_bend_angle() -> None:
    """Printed M₁₇ is by the bend angle κ l, so l times it is by κ; M₁₈ is by ψa in both."""
    long = PLAIN.replace({"arm.length": 1.3})
    for q, _ in states(5):
        s, arm = 0.6, long.arm
        M17, M18 = eq.appendix_b(long, q, s)
        J = eq.jacobian(long, q, s)
        assert M17 * arm.length == pytest.approx(arm.mass_per_length * J[0, 6], rel=1e-12)
        assert pytest.approx(arm.mass_per_length * J[0, 7], rel=1e-12) == M18


def test_coupling_of_translation_and_bend_stays_and_of_direction_vanishes_when_straight() -> None:
    sizes = np.array([0.02, 0.01])
    pairs = [
        eq.integrated_coupling(PLAIN, np.array([0, 0, 0, 0.1, 0.2, 0.3, κ, 0.4])) for κ in sizes
    ]
    arm = PLAIN.arm
    limit = arm.mass_per_length * arm.length**3 / 6
    assert np.linalg.norm(pairs[1][0]) == pytest.approx(limit, rel=1e-4)
    ratio = np.linalg.norm(pairs[0][1]) / np.linalg.norm(pairs[1][1])
    assert ratio == pytest.approx(2.0, rel=1e-3)


def test_mass_matrix_is_symmetric_positive_definite_and_the_hessian_of_kinetic_energy() -> None:
    """Kinetic energy summed over nodes whose velocities are differences of their positions."""
    q, qd = states(1)[0]
    M = eq.mass_matrix(VEHICLE, q)
    np.testing.assert_allclose(M, M.T, atol=1e-14)
    assert np.linalg.eigvalsh(M)[0] > 0
    arm, (x, weight) = VEHICLE.arm, np.polynomial.legendre.leggauss(24)
    h = 1e-6

    def moving(function: Any) -> np.ndarray:
        return np.asarray((function(q + h * qd) - function(q - h * qd)) / (2 * h))

    def kinetic(s: float, mass: float, inertia: np.ndarray) -> float:
        v = moving(lambda p: eq.position(VEHICLE, p, s))
        turn = eq.rotation(q) @ eq.section_rotation(VEHICLE, q, s)
        spin = turn.T @ moving(lambda p: eq.rotation(p) @ eq.section_rotation(VEHICLE, p, s))
        w = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        return float(0.5 * mass * v @ v + 0.5 * w @ (inertia * w))

    total = sum(
        kinetic(
            0.5 * arm.length * (1 + xi),
            0.5 * arm.length * wi * arm.mass_per_length,
            0.5 * arm.length * wi * arm.transverse_inertia_per_length * np.array([1, 1, 2]),
        )
        for xi, wi in zip(x, weight, strict=True)
    )
    total += kinetic(0.6, 0.05, np.array([2e-5, 2e-5, 3e-5]))
    spin = eq.rotation(q).T @ moving(eq.rotation)
    w = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    total += 0.5 * VEHICLE.uav.mass * qd[:3] @ qd[:3] + 0.5 * w @ np.array(VEHICLE.uav.inertia) @ w
    # Second-order differences at 1e-6.
    assert 0.5 * qd @ M @ qd == pytest.approx(total, rel=1e-8)


def test_mass_rate_less_twice_coriolis_is_skew() -> None:
    for q, qd in states(3):
        rate = slope(lambda x: eq.mass_matrix(VEHICLE, x), q) @ qd
        S = rate - 2 * eq.coriolis_matrix(VEHICLE, q, qd)
        np.testing.assert_allclose(S, -S.T, atol=1e-12)


@pytest.mark.parametrize("mask", ["coupled", "block"])
def test_energy_changes_by_the_power_of_inputs_less_dissipation(mask: str) -> None:
    for q, qd in states(10):
        tau, wrench = RNG.normal(size=8), RNG.normal(size=6)
        qdd = eq.forward_dynamics(VEHICLE, q, qd, tau, wrench, mask=mask)
        kept = eq.MASKS[mask]
        M = kept * eq.mass_matrix(VEHICLE, q)
        Md = kept * (slope(lambda x: eq.mass_matrix(VEHICLE, x), q) @ qd)
        G = slope(lambda x: eq.potential_energy(VEHICLE, x), q)
        gained = qd @ M @ qdd + 0.5 * qd @ Md @ qd + G @ qd
        J = eq.jacobian(VEHICLE, q, VEHICLE.arm.length)
        put_in = qd @ tau + qd @ J.T @ wrench - qd @ eq.damping_vector(VEHICLE, q, qd)
        scale = np.abs(qd @ M @ qdd) + np.abs(G @ qd)
        assert abs(gained - put_in) < 1e-12 * scale


def test_gravity_vector_is_the_slope_of_potential_energy() -> None:
    q, _ = states(1)[0]
    expected = slope(lambda x: eq.potential_energy(VEHICLE, x), q)
    np.testing.assert_allclose(eq.gravity_vector(VEHICLE, q), expected, atol=1e-11)
    parts = eq.weight_vector(VEHICLE, q) + eq.elastic_vector(VEHICLE, q)
    np.testing.assert_array_equal(eq.gravity_vector(VEHICLE, q), parts)


def test_bend_inertia_of_the_straight_arm() -> None:
    q = np.array([0, 0, 0, 0, 0, 0, 1e-3, 0.0])
    found = eq.mass_matrix(VEHICLE, q)[6, 6]
    assert found == pytest.approx(VEHICLE.arm.straight_modal_mass, rel=1e-6)


def test_nodes_converge_spectrally() -> None:
    q, _ = states(1)[0]
    q[6] = 2 * np.pi
    best = eq.mass_matrix(PLAIN, q, nodes=40)
    errors = [np.abs(eq.mass_matrix(PLAIN, q, nodes=n) - best).max() for n in (6, 8, 10, 12)]
    assert all(b < 0.05 * a for a, b in zip(errors[:-1], errors[1:], strict=True))


def test_a_light_arm_leaves_the_uav_alone_at_first_order_in_its_density() -> None:
    q, qd = states(1)[0]
    gaps = []
    for factor in (1e-3, 1e-4):
        light = PLAIN.replace({"arm.density": 7850.0 * factor, "arm.youngs_modulus": 2e11 * factor})
        a, b = (eq.forward_dynamics(light, q, qd, mask=mask) for mask in ("coupled", "block"))
        gaps.append(np.abs(a - b)[:6].max())
    assert gaps[0] / gaps[1] == pytest.approx(10.0, rel=0.05)


def test_in_free_fall_only_the_decoupled_bend_feels_gravity() -> None:
    q, qd = states(1)[0]
    for mask, feels in (("coupled", False), ("block", True)):
        a, b = (eq.forward_dynamics(PLAIN, q, qd, mask=mask, gravity=g)[6] for g in (0.0, 9.81))
        assert (abs(a - b) > 1.0) == feels
        if not feels:
            assert abs(a - b) < 1e-9 * abs(a)


def test_threshold_replaces_a_small_bend_and_bad_choices_are_named() -> None:
    vehicle = ca.load_vehicle("paper")
    small, at = np.zeros(8), np.zeros(8)
    small[6], at[6] = 1e-4, vehicle.arm.kappa_s
    np.testing.assert_array_equal(eq.mass_matrix(vehicle, small), eq.mass_matrix(vehicle, at))
    with pytest.raises(ca.InputError, match="mask"):
        eq.forward_dynamics(vehicle, at, at, mask="blocks")
    with pytest.raises(ca.InputError, match="tip_frame"):
        eq.jacobian(vehicle, at, 0.5, "twisted")
