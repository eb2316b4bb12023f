"""An arc of constant curvature in the axes of its base, from which it hangs: Eqs. (2) to (5).

κ [1/m] and ψ [rad] are its bend, κ not 0; arc lengths s [m] may be arrays (...).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.equations.turns import Array, about_y, about_z
from continuair.errors import InputError, shown

TIP_FRAMES = ("untwisted", "frenet")


def arc_position(κ: Any, ψ: Any, s: Any) -> Array:
    """F(s, κ, ψ), Eq. (2): points (..., 3) from the base [m].

    The paper prints z = +sin(κs)/κ; the arm hangs, and Appendix A is the derivative of -sin(κs)/κ.
    """
    s = np.asarray(s)
    # 1 - cos x as 2 sin² x/2, which keeps its digits near straight.
    out = 2.0 * np.sin(0.5 * (s * κ)) ** 2 / κ
    return np.stack([out * np.cos(ψ), out * np.sin(ψ), -np.sin(s * κ) / κ], axis=-1)


def arc_tangent(κ: Any, ψ: Any, s: Any) -> Array:
    """Unit tangents (..., 3), away from the base: the slope of F by s."""
    sine = np.sin(κ * s)
    return np.stack([sine * np.cos(ψ), sine * np.sin(ψ), -np.cos(κ * s)], axis=-1)


def arc_rotation(κ: Any, ψ: Any, s: Any, tip_frame: str = "untwisted") -> Array:
    """Hanging axes (..., 3, 3) at s, whose -z is the tangent; those at s = 0 are the base's.

    "untwisted": Rz(ψ) Ry(-κs) Rz(-ψ), what a tendon-driven arm does, and what the next section
    hangs from. "frenet": without Rz(-ψ), the frame of the paper's Eq. (5), which spins with ψ.
    Raises InputError for any other frame.
    """
    _check_frame(tip_frame)
    bent = about_z(ψ) @ about_y(-κ * np.asarray(s))
    return bent @ about_z(-ψ) if tip_frame == "untwisted" else bent


def arc_jacobian(κ: Any, ψ: Any, s: Any, tip_frame: str = "untwisted") -> tuple[Array, Array]:
    """J_pa (Appendix A) and J_oa (Eq. (5)), each (..., 3, 2): from (κ̇, ψ̇) to velocity and spin.

    Appendix A is used as printed. The paper's second column of J_oa, [0 0 1], is that of the Frenet
    frame; the untwisted one is [sin κs cos ψ, sin κs sin ψ, 1 - cos κs]. Its first column,
    [-s sin ψ, s cos ψ, 0], is that of an arm that points up, as Eq. (2) is printed; the hanging arm
    of Appendix A turns the other way. Eq. (4) puts the rate of R_s into so(3), where it is the rate
    times the transpose of R_s that belongs there.
    """
    _check_frame(tip_frame)
    s = np.asarray(s)
    sine, cosine, sψ, cψ = np.sin(κ * s), np.cos(κ * s), np.sin(ψ), np.cos(ψ)
    nil = 0.0 * sine
    # cos x - 1 as -2 sin² x/2, which keeps its digits near straight.
    drop = -2.0 * np.sin(0.5 * (κ * s)) ** 2
    radial = drop / κ**2 + s * sine / κ
    by_κ = [cψ * radial, sψ * radial, sine / κ**2 - s * cosine / κ]
    by_ψ = [sψ * drop / κ, -cψ * drop / κ, nil]
    spin_κ = [s * sψ + nil, -s * cψ + nil, nil]
    spin_ψ = [nil, nil, nil + 1.0]
    if tip_frame == "untwisted":
        spin_ψ = [sine * cψ, sine * sψ, -drop]
    return _columns(by_κ, by_ψ), _columns(spin_κ, spin_ψ)


def _check_frame(tip_frame: str) -> None:
    if tip_frame not in TIP_FRAMES:
        raise InputError(f"tip_frame is {shown(tip_frame)}; use 'untwisted' or 'frenet'.")


def _columns(first: list[Any], second: list[Any]) -> Array:
    return np.stack([np.stack(first, -1), np.stack(second, -1)], -1)
