"""Equations of the paper as printed, where continuair.equations holds corrected ones.

Right as printed, and taken from there: Appendix A (`arm_jacobian`), Appendix B (`appendix_b`) and
Remark 1. All accept complex numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray


def position(offset: Any, s: float, κ: Any, ψa: Any) -> Array:
    """P_s (3,) of Eqs. (1) and (2): the arm points along +z of the base frame."""
    out = (1.0 - np.cos(s * κ)) / κ
    return np.asarray(offset) + np.array(
        [out * np.cos(ψa), out * np.sin(ψa), np.sin(s * κ) / κ + 0.0 * out]
    )


def rotational_columns(s: float, ψa: Any) -> Array:
    """J_oa (3, 2) of Eq. (5)."""
    return np.array([[-s * np.sin(ψa), 0.0], [s * np.cos(ψa), 0.0], [0.0, 1.0]])
