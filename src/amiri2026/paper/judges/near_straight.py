"""Judges of Remark 1 in III-A: the kinematics near a straight arm, and a threshold on κ.

Eq. (2) and Appendix A are evaluated as printed, to measure their rounding errors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import as_printed, regularised
from amiri2026.paper.judges.agreement import AGREES, as_formula
from amiri2026.verdicts import Judgement, judged

Array = np.ndarray

ANGLES = (1e-6, 1e-3, 1e-1)
"""Thresholds that are tried, as bend angles κ_s l [rad]."""

FLOWN_KAPPA_S = 1e-3
"""Threshold with which tests are flown [1/m]: of those the one that suits the kinematics."""

DYNAMICS = "A threshold in the dynamics can change a flight in which ψa moves near straight"


def singularity_and_threshold(evidence: Evidence) -> Judgement:
    """Judge III-A.11: is the kinematics singular at κ = 0, and not with the threshold?"""
    s = evidence.vehicle.arm.length
    has_value = np.isfinite(_point_and_columns(s, 0.0)).all()
    ladder = [rank_share(s, κ / s) for κ in (1e-2, 1e-4)]
    bends = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 315)[1:-1] / s
    guarded = [as_printed.regularised(κ, ANGLES[1] / s) for κ in bends]
    finite = all(np.isfinite(_point_and_columns(s, κ)).all() for κ in guarded)
    least = min(rank_share(s, κ) for κ in guarded)
    return judged(
        (not has_value or ladder[1] < 0.1 * ladder[0]) and finite and least > AGREES,
        "Eq. (2) and Appendix A divide by 0 at κ = 0. Towards it the column of ψa vanishes: its "
        f"norm is {ladder[0]:.0e} of that of the κ column at κl = 0.01 rad, and {ladder[1]:.0e} at "
        f"0.0001 rad. With κ_s l = {ANGLES[1]:g} rad (ours; the paper prints no κ_s) both are "
        "finite, and the columns are independent up to |κ| l = 2π, where the arm closes to a "
        "circle",
        share_of_the_column_of_psi_at_0_01=ladder[0],
        share_of_the_column_of_psi_at_0_0001=ladder[1],
    )


def rank_share(s: float, κ: float) -> float:
    """Return the smaller singular value of Appendix A over the larger, with κ in arm lengths.

    s: the arm's length [m]. 0 without full rank or without a value.
    """
    columns = _in_arm_lengths(s, κ)[3:].reshape(2, 3)
    if not np.isfinite(columns).all():
        return 0.0
    values = np.linalg.svd(columns, compute_uv=False)
    return float(values[1] / values[0])


def stability_near_straight(evidence: Evidence) -> Judgement:
    """III-A.13: do values, rounding and jumps of the kinematics stay small with some threshold?"""
    length = evidence.vehicle.arm.length
    rounding, jump = {}, {}
    for angle in ANGLES:
        κ_s = angle / length
        bends = [as_printed.regularised(κ, κ_s) for κ in κ_s * np.linspace(0.0, 5.0, 101)]
        rounding[angle] = max(rounding_error(length, κ) for κ in bends)
        below, inside = (
            _in_arm_lengths(length, as_printed.regularised(-κ_s * share, κ_s))
            for share in (1 + 1e-9, 1 - 1e-9)
        )
        jump[angle] = float(np.abs(below - inside).max())
    good = [angle for angle in ANGLES if rounding[angle] < 1e-6 and jump[angle] < 0.01]
    listed = ", ".join(
        f"{max(rounding[angle], AGREES):.0e} and {jump[angle]:.0e} for {angle:g} rad"
        for angle in ANGLES
    )
    kinematics = judged(
        bool(good),
        "rounding error and jump of the kinematics at −κ_s are, in arm lengths, "
        f"{listed} as κ_s l; the paper prints no κ_s",
        **{
            f"jump at kappa_s l of {angle:g} rad [arm lengths]": jump[angle] for angle in ANGLES[1:]
        },
    )
    flights = [regularised.fly_with(evidence.vehicle, test, FLOWN_KAPPA_S) for test in "BC"]
    numbers = {name: value for each in flights for name, value in _numbers(each).items()}
    # The sentence is about kinematics: flights that stop early do not make it undecided.
    return replace(
        kinematics,
        evidence=". ".join([kinematics.evidence, DYNAMICS, *map(_told, flights)]),
        numbers={**kinematics.numbers, **numbers},
    )


def _told(flown: regularised.Flown) -> str:
    """Return the effect of a threshold on a flight, as a sentence."""
    name = f"For {flown.vehicle} in Test {flown.test}, κ_s = {flown.κ_s:.2g} 1/m in M, C and J_t"
    if flown.ended:
        return f"{name}: {flown.ended}"
    before, after = flown.errors
    return (
        f"{name}: RMSE_T of the decoupled model (UAV-arm blocks zero) is {after:.2g} m, without "
        f"κ_s {before:.2g} m, and the coupled centre of mass is off by up to {flown.drift:.2g} m "
        "although the external forces are the same"
    )


def _numbers(flown: regularised.Flown) -> dict[str, float]:
    if flown.ended:
        return {}
    of = f"{flown.vehicle}, Test {flown.test}"
    return {
        f"{of}: RMSE_T without kappa_s [m]": flown.errors[0],
        f"{of}: RMSE_T with kappa_s [m]": flown.errors[1],
        f"{of}: error of the centre of mass with kappa_s [m]": flown.drift,
    }


def rounding_error(length: float, κ: float) -> float:
    """Return the largest rounding error of Eq. (2) and Appendix A at a bend, in arm lengths.

    length [m]; κ [1/m], positive.
    """
    x = κ * length
    half, full = np.sinc(x / (2 * np.pi)), np.sinc(x / np.pi)
    # (sin x - x cos x)/x², by its series where the difference would lose digits.
    small = x / 3 - x**3 / 30 + x**5 / 840
    axial = small if x < 0.1 else (np.sin(x) - x * np.cos(x)) / x**2
    right = [0.5 * x * half**2, 0.0, full, full - 0.5 * half**2, 0.0, axial, 0.0,
             0.5 * x * half**2, 0.0]  # fmt: skip
    return float(np.abs(_in_arm_lengths(length, κ) - right).max())


def _in_arm_lengths(length: float, κ: float) -> Array:
    """Return the tip of Eq. (2) and columns of Appendix A (9,), bent towards x, in arm lengths."""
    return _point_and_columns(length, κ) / np.repeat([length, length**2, length], 3)


def _point_and_columns(s: float, κ: float) -> Array:
    """Return the tip of Eq. (2) and columns of Appendix A (9,), bent towards x, or NaN or inf."""
    with np.errstate(divide="ignore", invalid="ignore"):
        point = as_printed.position(np.zeros(3), s, κ, 0.0)
        columns = as_printed.appendix_a(s, κ, 0.0)
    return np.concatenate([point, columns[:, 0], columns[:, 1]])


JUDGES = {
    "III-A.11": as_formula(singularity_and_threshold),
    "III-A.13": as_formula(stability_near_straight),
}
"""Judge of every sentence of Remark 1, by its id."""
