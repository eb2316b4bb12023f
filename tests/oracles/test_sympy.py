"""The paper's appendices, as printed, against SymPy; and the code against both."""

from importlib.metadata import version
from typing import Any

import numpy as np
import sympy as sp

import continuair as ca
from continuair import equations as eq
from tests.oracles.conftest import Claim

SOURCE = f"SymPy {version('sympy')}"
VEHICLE = ca.load_vehicle("paper").replace({"arm.length": 1.3, "arm.kappa_s": 0.0})
DIGITS = 40

s, κ, l_a, μ = sp.symbols("s kappa l mu", positive=True)
φ, θ, ψ, ψa = sp.symbols("phi theta psi psi_a", real=True)


def body_to_world() -> Any:
    return sp.rot_ccw_axis3(ψ) * sp.rot_ccw_axis2(θ) * sp.rot_ccw_axis1(φ)


def backbone() -> Any:
    """The integral of the tangent of a hanging arc, from its base to s."""
    x = sp.symbols("x", positive=True)
    tangent = sp.Matrix([sp.sin(κ * x) * sp.cos(ψa), sp.sin(κ * x) * sp.sin(ψa), -sp.cos(κ * x)])
    return tangent.applyfunc(lambda f: sp.integrate(f, (x, 0, s)))


def appendix_a() -> Any:
    """J_p of Appendix A, letter by letter."""
    first = (sp.cos(κ * s) - 1) / κ**2
    return sp.Matrix(
        [
            [
                sp.cos(ψa) * first + s * sp.sin(κ * s) * sp.cos(ψa) / κ,
                sp.sin(ψa) * (sp.cos(κ * s) - 1) / κ,
            ],
            [
                sp.sin(ψa) * first + s * sp.sin(κ * s) * sp.sin(ψa) / κ,
                -sp.cos(ψa) * (sp.cos(κ * s) - 1) / κ,
            ],
            [sp.sin(κ * s) / κ**2 - s * sp.cos(κ * s) / κ, 0],
        ]
    )


def appendix_b(angle: Any) -> Any:
    """M₁₇ and M₁₈ of Appendix B, letter by letter, `angle` standing where it prints κ; μ = ρπr²."""
    sine, cosine = sp.sin(angle * s / l_a), sp.cos(angle * s / l_a)
    radial = l_a * cosine - l_a + angle * s * sine
    side = sp.cos(φ) * sp.sin(ψ) - sp.cos(ψ) * sp.sin(φ) * sp.sin(θ)
    M17 = (l_a * sine - angle * s * cosine) * (
        sp.sin(φ) * sp.sin(ψ) + sp.cos(φ) * sp.cos(ψ) * sp.sin(θ)
    )
    M17 += -sp.sin(ψa) * side * radial + sp.cos(ψa) * sp.cos(ψ) * sp.cos(θ) * radial
    M18 = sp.cos(φ) * sp.cos(ψa) * sp.sin(ψ) + sp.cos(ψ) * sp.cos(θ) * sp.sin(ψa)
    M18 -= sp.cos(ψa) * sp.cos(ψ) * sp.sin(φ) * sp.sin(θ)
    return sp.Matrix([[μ / angle**2 * M17, l_a * μ / angle * (cosine - 1) * M18]])


def not_zero(difference: Any) -> int:
    """How many entries SymPy does not reduce to 0."""
    return sum(sp.simplify(sp.expand(entry)) != 0 for entry in difference)


def configurations(count: int) -> np.ndarray:
    """Paper coordinates with bends from 0.05 to 4 1/m: below, polar float64 loses digits."""
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.2, 1.2, (count, 8))
    q[:, 6] = np.geomspace(0.05, 4.0, count)
    q[:, 7] = rng.uniform(-np.pi, np.pi, count)
    return q


def evaluated(expression: Any, q: np.ndarray, at: float) -> np.ndarray:
    """An expression in `DIGITS` digits at q, arc length `at`, of the vehicle's length and mass."""
    values = dict(zip((φ, θ, ψ, κ, ψa), q[3:], strict=True))
    values |= {s: at, l_a: VEHICLE.arm.length, μ: VEHICLE.arm.mass_per_length}
    exact = {symbol: sp.Float(float(value), DIGITS) for symbol, value in values.items()}
    return np.array(expression.subs(exact).evalf(DIGITS).tolist(), float)


def test_appendix_a(claim: Claim) -> None:
    slopes = backbone().jacobian([κ, ψa])
    claim(
        "Appendix A as printed is the Jacobian of the hanging arc: entries that differ, "
        "symbolically",
        SOURCE,
        0,
        not_zero(appendix_a() - slopes),
    )
    worst = max(
        np.abs(eq.arm_jacobian(VEHICLE, q, 0.9)[0] - evaluated(slopes, q, 0.9)).max()
        for q in configurations(12)
    )
    claim(
        f"Appendix A in the readable form against {DIGITS} digits, bends of 0.05 to 4 1/m",
        SOURCE,
        1e-12,
        worst,
        unit="m²",
        note="1/κ² multiplies roundings by up to 400",
    )


def test_appendix_b(claim: Claim) -> None:
    slopes = body_to_world() * backbone().jacobian([κ, ψa])
    integrand = sp.Matrix([[μ * slopes[0, 0] / l_a, μ * slopes[0, 1]]])
    claim(
        "Appendix B as printed is the integrand of M₁₇ and M₁₈, its κ being the bend angle κ l: "
        "elements that differ, symbolically",
        SOURCE,
        0,
        not_zero(appendix_b(κ * l_a) - integrand),
    )
    total = slopes.applyfunc(lambda f: μ * sp.integrate(sp.expand(f), (s, 0, l_a)))
    worst = 0.0
    for q in configurations(12):
        M = eq.mass_matrix(VEHICLE, q, nodes=32)[:3, 6:]
        worst = max(worst, float(np.abs(M - evaluated(total, q, 0.0)).max()))
    claim(
        "the integrated coupling against the readable form's mass matrix, rows 1-3, columns 7, 8",
        SOURCE,
        1e-12,
        worst,
    )


def test_tip_of_the_kernels(claim: Claim) -> None:
    q = configurations(12)
    q[:6, 6] = np.geomspace(1e-8, 0.04, 6)
    place = ca.Scenario("place", q, duration=1e-3)
    tips = ca.simulate(VEHICLE, place, sample=1e-3, variables=["tip_position"])
    ours = tips.tip_position.values[:, 0]
    expected = body_to_world() * backbone().subs(s, l_a)
    off = [ours[i] - q[i, :3] - evaluated(expected, q[i], 0.0).ravel() for i in range(len(q))]
    claim(
        f"tip position in the kernels against {DIGITS} digits, bends of 1e-8 to 4 1/m",
        SOURCE,
        1e-14,
        float(np.abs(off).max()),
        unit="m",
    )
