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


def closed_forms() -> tuple[Any, Any, Any]:
    """a, b, c of the integrated coupling."""
    x = κ * l_a
    return (
        (2 * sp.sin(x) - x - x * sp.cos(x)) / κ**3,
        (2 - 2 * sp.cos(x) - x * sp.sin(x)) / κ**3,
        (x - sp.sin(x)) / κ**2,
    )


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


def test_printed_elements_are_integrands_by_the_bend_angle() -> None:
    """μ (R ∂r/∂(κl))₁ and μ (R ∂r/∂ψa)₁ at one s, if the printed κ is the bend angle κ l."""
    M17, M18 = printed(κ * l_a)
    rows = body_to_world() * backbone().jacobian([κ, ψa])
    assert sp.simplify(sp.expand(M17 - μ * rows[0, 0] / l_a)) == 0
    assert sp.simplify(sp.expand(M18 - μ * rows[0, 1])) == 0


def test_closed_forms_are_the_integrals() -> None:
    a, b, c = closed_forms()
    slopes = backbone().jacobian([κ, ψa])
    total = slopes.applyfunc(lambda f: sp.integrate(sp.expand(f), (s, 0, l_a)))
    expected = sp.Matrix(
        [[a * sp.cos(ψa), -c * sp.sin(ψa)], [a * sp.sin(ψa), c * sp.cos(ψa)], [b, 0]]
    )
    assert sp.simplify(total - expected) == sp.zeros(3, 2)


def test_with_a_vanishing_bend_m17_tends_to_a_constant_and_m18_to_zero_in_proportion() -> None:
    a, b, c = closed_forms()
    assert sp.limit(a, κ, 0) == l_a**3 / 6
    assert sp.limit(b / κ, κ, 0) == l_a**4 / 12
    assert sp.limit(c / κ, κ, 0) == l_a**3 / 6


def test_near_the_base_both_integrands_vanish_as_the_square_of_arc_length() -> None:
    """The paper's "at least quadratically in s"; M₁₇ by its second and third components."""
    slopes = backbone().jacobian([κ, ψa])
    assert sp.limit(slopes[0, 0] / s**2, s, 0) == sp.cos(ψa) / 2
    assert sp.limit(slopes[0, 1] / s**2, s, 0) == -κ * sp.sin(ψa) / 2
    assert sp.limit(slopes[2, 0] / s**2, s, 0) == 0


def test_code_holds_what_is_printed() -> None:
    symbols = (φ, θ, ψ, κ, ψa, s, l_a, μ)
    exact = sp.lambdify(symbols, printed(κ))
    for q, _ in states(10, seed=11):
        arm = LONG.arm
        bend_angle = q[6] * arm.length
        expected = exact(*q[3:6], bend_angle, q[7], 0.6, arm.length, arm.mass_per_length)
        np.testing.assert_allclose(eq.appendix_b(LONG, q, 0.6), expected, rtol=1e-12)


def test_integrated_coupling_is_what_the_mass_matrix_holds() -> None:
    for q, _ in states(10, seed=12):
        by_κ, by_ψ = eq.integrated_coupling(LONG, q)
        M = eq.mass_matrix(LONG, q, nodes=32)
        # 1/κ³ at |κ| >= 0.2 multiplies roundings by a hundred.
        np.testing.assert_allclose(M[:3, 6], by_κ, atol=1e-13)
        np.testing.assert_allclose(M[:3, 7], by_ψ, atol=1e-13)


def test_printed_element_integrates_to_the_first_component() -> None:
    x, weight = np.polynomial.legendre.leggauss(32)
    arm = LONG.arm
    for q, _ in states(5, seed=13):
        integrand = [eq.appendix_b(LONG, q, 0.5 * arm.length * (1 + xi)) for xi in x]
        by_angle, by_ψ = 0.5 * arm.length * weight @ np.array(integrand)
        first, second = eq.integrated_coupling(LONG, q)
        assert arm.length * by_angle == pytest.approx(first[0], abs=1e-13)
        assert by_ψ == pytest.approx(second[0], abs=1e-13)


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
