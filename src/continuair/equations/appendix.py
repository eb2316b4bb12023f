"""Appendix B: the coupling of the UAV's translation and the arm in the mass matrix."""

from __future__ import annotations

import numpy as np

from continuair.equations.kinematics import Array, bend_of, rotation
from continuair.vehicle.vehicle import Vehicle


def appendix_b(vehicle: Vehicle, q: Array, s: float) -> tuple[float, float]:
    """Return M₁₇ and M₁₈ of Appendix B exactly as printed: the integrand at arc length s.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with one arm of one section.
    q : array (8,)
        The paper's coordinates [m, rad, 1/m].
    s : float
        Arc length from the base [m].

    Returns
    -------
    M17 : float
        Integrand conjugate to the total bend angle.
    M18 : float
        Integrand conjugate to ψa.

    Notes
    -----
    Appendix B, Amiri et al. (2026). The paper calls them elements of M, but they have yet to be
    integrated over s (`integrated_coupling`). The printed κ is the total bend angle; κ l is
    inserted for it. M₁₇ is conjugate to that angle, so that M₁₇ l is the integrand conjugate to κ
    in 1/m.
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
    """Return Appendix B integrated over the backbone, for κ in 1/m.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with one arm of one section.
    q : array (8,)
        The paper's coordinates [m, rad, 1/m].

    Returns
    -------
    by_kappa : array (3,)
        Elements M₁₋₃,₇ in world axes, without the arm's disks.
    by_psi : array (3,)
        Elements M₁₋₃,₈, likewise.

    Notes
    -----
    ρA R [a cos ψa, a sin ψa, b] and ρA R [-c sin ψa, c cos ψa, 0] with x = κ l, a = (2 sin x - x -
    x cos x)/κ³, b = (2 - 2 cos x - x sin x)/κ³, c = (x - sin x)/κ². Appendix B of Amiri et al.
    (2026) prints the first component only, of the integrand only, with κ l for κ.
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
