"""Kinematics exactly as printed, where `continuair.equations` uses other forms.

Near straight, `equations` evaluates Appendix A in a form that keeps more digits. Appendix B is
there as printed. All functions but `regularised` accept complex numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray


def position(offset: Any, s: float, κ: Any, ψa: Any) -> Array:
    """Return P_s (3,) of Eqs. (1) and (2) [m]: the arm points along +z of the base frame."""
    out = (1.0 - np.cos(s * κ)) / κ
    return np.asarray(offset) + np.array(
        [out * np.cos(ψa), out * np.sin(ψa), np.sin(s * κ) / κ + 0.0 * out]
    )


def appendix_a(s: float, κ: Any, ψa: Any) -> Array:
    """Return J_pa (3, 2) of Appendix A: from the rates of κ and ψa to the velocity at s."""
    sine, cosine = np.sin(κ * s), np.cos(κ * s)
    sψ, cψ = np.sin(ψa), np.cos(ψa)
    return np.array(
        [
            [cψ * (cosine - 1.0) / κ**2 + s * sine * cψ / κ, sψ * (cosine - 1.0) / κ],
            [sψ * (cosine - 1.0) / κ**2 + s * sine * sψ / κ, -cψ * (cosine - 1.0) / κ],
            [sine / κ**2 - s * cosine / κ, 0.0 * sine],
        ]
    )


def rotational_columns(s: float, ψa: Any) -> Array:
    """Return J_oa (3, 2) of Eq. (5)."""
    return np.array([[-s * np.sin(ψa), 0.0], [s * np.cos(ψa), 0.0], [0.0, 1.0]])


def regularised(κ: float, κ_s: float) -> float:
    """Return the κ of Eq. (6): κ_s where |κ| <= κ_s."""
    return κ_s if abs(κ) <= κ_s else κ
