"""Appendix B: what is printed, what it is the integrand of, and its limits."""

from typing import Any

import numpy as np
import pytest
import sympy as sp

import continuair as ca
from continuair import equations as eq
from tests.equations.samples import FURNISHED, PLAIN, states

LONG = PLAIN.replace({"arm.length": 1.3})  # at length 1, κ and κ l would look alike

s, κ, l_a, μ = sp.symbols("s kappa l mu", positive=True)
φ, θ, ψ, ψa = sp.symbols("phi theta psi psi_a")


def body_to_world() -> Any:
    return sp.rot_ccw_axis3(ψ) * sp.rot_ccw_axis2(θ) * sp.rot_ccw_axis1(φ)


def backbone() -> Any:
    out = (1 - sp.cos(κ * s)) / κ
    return sp.Matrix([out * sp.cos(ψa), out * sp.sin(ψa), -sp.sin(κ * s) / κ])


def printed(angle: Any) -> tuple[Any, Any]:
    """M₁₇ and M₁₈ as Appendix B prints them, `angle` standing where it prints κ."""
    sine, cosine = sp.sin(angle * s / l_a), sp.cos(angle * s / l_a)
    radial = l_a * cosine - l_a + angle * s * sine
    r13 = sp.sin(φ) * sp.sin(ψ) + sp.cos(φ) * sp.cos(ψ) * sp.sin(θ)
    minus_r12 = sp.cos(φ) * sp.sin(ψ) - sp.cos(ψ) * sp.sin(φ) * sp.sin(θ)
    bracket = (
        (l_a * sine - angle * s * cosine) * r13
        - sp.sin(ψa) * minus_r12 * radial
        + sp.cos(ψa) * sp.cos(ψ) * sp.cos(θ) * radial
    )
    across = sp.cos(ψa) * minus_r12 + sp.cos(ψ) * sp.cos(θ) * sp.sin(ψa)
    return μ / angle**2 * bracket, l_a * μ / angle * (cosine - 1) * across


def slopes_of_the_backbone() -> Any:
    """A function of (s, κ, ψa): ∂r/∂(κ, ψa), (3, 2), by SymPy."""
    return sp.lambdify((s, κ, ψa), backbone().jacobian([κ, ψa]))


def test_printed_elements_are_integrands_by_the_bend_angle() -> None:
    """μ (R ∂r/∂(κl))₁ and μ (R ∂r/∂ψa)₁ at one s, if the printed κ is the bend angle κ l."""
    slopes = slopes_of_the_backbone()
    turn = sp.lambdify((φ, θ, ψ), body_to_world())
    arm = LONG.arm
    for q, _ in states(10, seed=14):
        row = arm.mass_per_length * (turn(*q[3:6]) @ slopes(0.6, q[6], q[7]))[0]
        # Rounding of sums that 1/κ² multiplies, at |κ| >= 0.2.
        found = eq.appendix_b(LONG, q, 0.6)
        np.testing.assert_allclose(found, row / [arm.length, 1.0], rtol=0, atol=1e-14)


def test_integrated_coupling_is_the_integral_over_the_backbone() -> None:
    slopes = slopes_of_the_backbone()
    turn = sp.lambdify((φ, θ, ψ), body_to_world())
    x, weight = np.polynomial.legendre.leggauss(32)
    arm = LONG.arm
    for q, _ in states(10, seed=15):
        along = [slopes(0.5 * arm.length * (1 + xi), q[6], q[7]) for xi in x]
        total = 0.5 * arm.length * np.tensordot(weight, along, 1)
        expected = arm.mass_per_length * turn(*q[3:6]) @ total
        found = np.column_stack(eq.integrated_coupling(LONG, q))
        # 1/κ³ at |κ| >= 0.2 multiplies roundings by a hundred.
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("bend", [0.3, 0.1, 0.03])
def test_with_a_vanishing_bend_m17_tends_to_a_constant_and_m18_to_zero_in_proportion(
    bend: float,
) -> None:
    """μ l³/6 and μ l³ κ/6 across the arm, μ l⁴ κ/12 along it; next orders are (κ l)² of them."""
    arm, angle = LONG.arm, 0.4
    q = np.array([0, 0, 0, 0, 0, 0, bend, angle])
    by_κ, by_ψ = eq.integrated_coupling(LONG, q)
    across = arm.mass_per_length * arm.length**3 / 6
    along = arm.mass_per_length * arm.length**4 / 12
    sine, cosine = np.sin(angle), np.cos(angle)
    near = (bend * arm.length) ** 2
    np.testing.assert_allclose(by_κ[:2], across * np.array([cosine, sine]), rtol=near)
    np.testing.assert_allclose(by_κ[2] / bend, along, rtol=near)
    np.testing.assert_allclose(by_ψ[:2] / bend, across * np.array([-sine, cosine]), rtol=near)
    assert by_ψ[2] == 0.0


@pytest.mark.parametrize("at", [1e-1, 1e-2, 1e-3])
def test_near_the_base_both_integrands_vanish_as_the_square_of_arc_length(at: float) -> None:
    """The paper's "at least quadratically in s": s²/2 across the arm, and less along it."""
    turn = sp.lambdify((φ, θ, ψ), body_to_world())
    arm = LONG.arm
    for q, _ in states(5, seed=16):
        bend, angle = q[6:]
        across = np.array([np.cos(angle), np.sin(angle), 0.0])
        around = bend * np.array([-np.sin(angle), np.cos(angle), 0.0])
        first = turn(*q[3:6])[0]
        M17, M18 = eq.appendix_b(LONG, q, at)
        # What follows is |κ| s of it, along the arm.
        half = 0.5 * arm.mass_per_length
        near = abs(bend) * at
        assert abs(M17 / at**2 - half * first @ across / arm.length) < near * half / arm.length
        assert abs(M18 / at**2 - half * first @ around) < near * half * abs(bend)


def test_code_holds_what_is_printed() -> None:
    symbols = (φ, θ, ψ, κ, ψa, s, l_a, μ)
    exact = sp.lambdify(symbols, printed(κ))
    for q, _ in states(10, seed=11):
        arm = LONG.arm
        bend_angle = q[6] * arm.length
        expected = exact(*q[3:6], bend_angle, q[7], 0.6, arm.length, arm.mass_per_length)
        np.testing.assert_allclose(eq.appendix_b(LONG, q, 0.6), expected, rtol=2e-13)


def test_integrated_coupling_is_what_the_mass_matrix_holds() -> None:
    for q, _ in states(10, seed=12):
        by_κ, by_ψ = eq.integrated_coupling(LONG, q)
        M = eq.mass_matrix(LONG, q, nodes=32)
        # 1/κ³ at |κ| >= 0.2 multiplies roundings by a hundred.
        np.testing.assert_allclose(M[:3, 6], by_κ, rtol=0, atol=1e-14)
        np.testing.assert_allclose(M[:3, 7], by_ψ, rtol=0, atol=1e-14)


def test_printed_element_integrates_to_the_first_component() -> None:
    x, weight = np.polynomial.legendre.leggauss(32)
    arm = LONG.arm
    for q, _ in states(5, seed=13):
        integrand = [eq.appendix_b(LONG, q, 0.5 * arm.length * (1 + xi)) for xi in x]
        by_angle, by_ψ = 0.5 * arm.length * weight @ np.array(integrand)
        first, second = eq.integrated_coupling(LONG, q)
        assert arm.length * by_angle == pytest.approx(first[0], abs=1e-14)
        assert by_ψ == pytest.approx(second[0], abs=1e-14)


def test_disks_only_add_to_the_coupling_of_the_backbone() -> None:
    """What the paper says when it leaves them out."""
    q = np.array([0, 0, 0, 0, 0, 0, 0.7, 0.0])
    by_κ, _ = eq.integrated_coupling(FURNISHED, q)
    M = eq.mass_matrix(FURNISHED, q)
    assert M[0, 6] > by_κ[0] > 0
    assert M[2, 6] > by_κ[2] > 0


def test_remark_1_holds_in_appendix_b_too() -> None:
    vehicle = ca.load_vehicle("paper")
    q, at = np.zeros(8), np.zeros(8)
    at[6] = vehicle.arm.kappa_s
    assert eq.appendix_b(vehicle, q, 0.5) == eq.appendix_b(vehicle, at, 0.5)
    np.testing.assert_array_equal(
        eq.integrated_coupling(vehicle, q), eq.integrated_coupling(vehicle, at)
    )
