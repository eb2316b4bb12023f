"""An arc of constant curvature in the axes of its base, below which it hangs: Eqs. (2) to (5).

κ [1/m] and ψ [rad] are its curvature and bend direction, κ not 0; arc lengths s [m] may be arrays.
"""

from __future__ import annotations

import numpy as np

from continuair.equations.turns import Angle, Array, TipFrame, about_y, about_z
from continuair.errors import InputError, shown
from continuair.typing import ArrayLike

TIP_FRAMES = ("untwisted", "frenet")


def arc_position(κ: Angle, ψ: Angle, s: ArrayLike) -> Array:
    """Return points of an arc in the axes of its base.

    Parameters
    ----------
    κ : float or complex
        Curvature [1/m], not 0.
    ψ : float or complex
        Bend direction [rad].
    s : array_like (...)
        Arc lengths from the base [m].

    Returns
    -------
    array (..., 3)
        Points from the base [m].

    Notes
    -----
    F(s, κ, ψ), Eq. (2) of Amiri et al. (2026). The paper prints z = +sin(κs)/κ. The arm hangs, and
    Appendix A is the derivative of -sin(κs)/κ, which is used here.
    """
    s = np.asarray(s)
    # 1 - cos x as 2 sin² x/2, which keeps its digits near straight.
    out = 2.0 * np.sin(0.5 * (s * κ)) ** 2 / κ
    return np.stack([out * np.cos(ψ), out * np.sin(ψ), -np.sin(s * κ) / κ], axis=-1)


def arc_tangent(κ: Angle, ψ: Angle, s: Angle) -> Array:
    """Return unit tangents (..., 3), away from the base: the derivative of F with respect to s."""
    sine = np.sin(κ * s)
    return np.stack([sine * np.cos(ψ), sine * np.sin(ψ), -np.cos(κ * s)], axis=-1)


def arc_rotation(κ: Angle, ψ: Angle, s: ArrayLike, tip_frame: TipFrame = "untwisted") -> Array:
    """Return the axes of an arc's cross sections in the axes of its base.

    Parameters
    ----------
    κ : float or complex
        Curvature [1/m], not 0.
    ψ : float or complex
        Bend direction [rad].
    s : array_like (...)
        Arc lengths from the base [m].
    tip_frame : {"untwisted", "frenet"}, default "untwisted"
        Convention of the frame, see Notes.

    Returns
    -------
    array (..., 3, 3)
        Hanging axes at s, whose -z is the tangent; at s = 0 those of the base for "untwisted".

    Raises
    ------
    InputError
        If `tip_frame` is another name.

    Notes
    -----
    "untwisted" is Rz(ψ) Ry(-κs) Rz(-ψ): the frame of a tendon-driven arm, and the base of the next
    section. "frenet" omits Rz(-ψ): the frame of Eq. (5) of Amiri et al. (2026), which turns with ψ.
    """
    _check_frame(tip_frame)
    bent = about_z(ψ) @ about_y(-κ * np.asarray(s))
    return bent @ about_z(-ψ) if tip_frame == "untwisted" else bent


def arc_jacobian(
    κ: Angle, ψ: Angle, s: ArrayLike, tip_frame: TipFrame = "untwisted"
) -> tuple[Array, Array]:
    """Return the Jacobians of an arc from (κ̇, ψ̇) to linear and angular velocity.

    Parameters
    ----------
    κ : float or complex
        Curvature [1/m], not 0.
    ψ : float or complex
        Bend direction [rad].
    s : array_like (...)
        Arc lengths from the base [m].
    tip_frame : {"untwisted", "frenet"}, default "untwisted"
        Convention of the frame, as in `arc_rotation`.

    Returns
    -------
    J_pa : array (..., 3, 2)
        Linear Jacobian in the axes of the base.
    J_oa : array (..., 3, 2)
        Angular Jacobian, likewise.

    Raises
    ------
    InputError
        If `tip_frame` is another name.

    Notes
    -----
    J_pa is Appendix A of Amiri et al. (2026) as printed; J_oa belongs to Eq. (5). The printed
    second column of J_oa, [0 0 1], is that of the Frenet frame. The untwisted one is [sin κs cos ψ,
    sin κs sin ψ, 1 - cos κs]. The first column here, [-s sin ψ, s cos ψ, 0] as printed, is that of
    an arm that points up, as Eq. (2) is printed; the hanging arm of Appendix A turns the other way.
    Eq. (4) puts the rate of R_s into so(3), where the rate times the transpose of R_s belongs.
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
        raise InputError("tip_frame", f"is {shown(tip_frame)}", "use 'untwisted' or 'frenet'")


def _columns(first: list[Array], second: list[Array]) -> Array:
    return np.stack([np.stack(first, -1), np.stack(second, -1)], -1)
