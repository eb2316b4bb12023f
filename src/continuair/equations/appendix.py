"""Appendix B: the coupling of the UAV's translation and the arm in the mass matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.equations.kinematics import Array, bend_of, rotation
from continuair.vehicle.vehicle import Vehicle


def appendix_b(vehicle: Vehicle, q: Array, s: float) -> tuple[Any, Any]:
    """(M₁₇, M₁₈) of Appendix B exactly as printed: the integrand at arc length s [m].

    The paper calls them elements of M, but they are yet to be integrated over s
    (`integrated_coupling`). The printed κ is the total bend angle, and κ l is inserted for it; so
    M₁₇, which is conjugate to it, times l is the integrand conjugate to κ in 1/m.
    """
    length, r, ρ = vehicle.arm.length, vehicle.arm.radius, vehicle.arm.density
    φ, θ, ψ = q[3:6]
    curvature, ψa = bend_of(vehicle, q)
    κ = curvature * length
    sφ, cφ, sθ, cθ, sψ, cψ = np.sin(φ), np.cos(φ), np.sin(θ), np.cos(θ), np.sin(ψ), np.cos(ψ)
    sine, cosine = np.sin(κ * s / length), np.cos(κ * s / length)
    radial = length * cosine - length + κ * s * sine
    M17 = (
        r**2
        * ρ
        * np.pi
        / κ**2
        * (
            (length * sine - κ * s * cosine) * (sφ * sψ + cφ * cψ * sθ)
            - np.sin(ψa) * (cφ * sψ - cψ * sφ * sθ) * radial
            + np.cos(ψa) * cψ * cθ * radial
        )
    )
    M18 = (
        length
        * r**2
        * ρ
        * np.pi
        / κ
        * (cosine - 1.0)
        * (cφ * np.cos(ψa) * sψ + cψ * cθ * np.sin(ψa) - np.cos(ψa) * cψ * sφ * sθ)
    )
    return M17, M18


def integrated_coupling(vehicle: Vehicle, q: Array) -> tuple[Array, Array]:
    """M₁₋₃,₇ and M₁₋₃,₈, (3,) each: Appendix B integrated over the backbone, κ in 1/m.

    ρA R [a cos ψa, a sin ψa, b] and ρA R [-c sin ψa, c cos ψa, 0] with x = κ l,
    a = (2 sin x - x - x cos x)/κ³, b = (2 - 2 cos x - x sin x)/κ³, c = (x - sin x)/κ². The paper
    prints the first component only, of the integrand only, with κ l for κ. Disks are left out.
    """
    κ, ψ = bend_of(vehicle, q)
    x = κ * vehicle.arm.length
    density = vehicle.arm.mass_per_length
    a = (2.0 * np.sin(x) - x - x * np.cos(x)) / κ**3
    b = (2.0 - 2.0 * np.cos(x) - x * np.sin(x)) / κ**3
    c = (x - np.sin(x)) / κ**2
    R = rotation(q)
    by_κ = density * R @ np.array([a * np.cos(ψ), a * np.sin(ψ), b])
    by_ψ = density * R @ np.array([-c * np.sin(ψ), c * np.cos(ψ), 0.0])
    return by_κ, by_ψ
