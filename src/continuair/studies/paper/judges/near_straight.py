"""Judges of Remark 1 in III-A: the kinematics near a straight arm, and a threshold on κ."""

from __future__ import annotations

import numpy as np

from continuair import equations
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges.agreement import AGREES
from continuair.studies.verdicts import Judgement, judged
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

KAPPA_S = (1e-6, 1e-3, 1e-1)
"""Thresholds that are tried [1/m]."""


def singularity_and_threshold(evidence: Evidence) -> Judgement:
    """III-A.11: is the kinematics singular at κ = 0, and not with the threshold?"""
    vehicle, s = evidence.vehicle, evidence.vehicle.arm.length
    bare, guarded = _unguarded(vehicle), vehicle.replace({"arm.kappa_s": KAPPA_S[1]})
    has_value = np.isfinite(_point_and_columns(bare, s, 0.0)).all()
    ladder = [rank_share(bare, s, κ / s) for κ in (1e-2, 1e-4)]
    bends = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 315)[1:-1] / s
    finite = all(np.isfinite(_point_and_columns(guarded, s, κ)).all() for κ in bends)
    least = min(rank_share(guarded, s, κ) for κ in bends)
    return judged(
        (not has_value or ladder[1] < 0.1 * ladder[0]) and finite and least > AGREES,
        f"at κ = 0 Eq. (2) and Appendix A divide by 0, and towards it the column of ψa vanishes "
        f"({ladder[0]:.0e} of the other at κl = 0.01, {ladder[1]:.0e} at 0.0001). With κ_s = "
        f"{KAPPA_S[1]:g} 1/m (ours; none is printed) both have values, and the columns stay "
        "independent, for |κ| l below 2π, where the arm closes to a circle",
        share_of_the_column_of_psi_at_0_01=ladder[0],
        share_of_the_column_of_psi_at_0_0001=ladder[1],
    )


def rank_share(vehicle: Vehicle, s: float, κ: float) -> float:
    """The smaller singular value of Appendix A over the larger; 0 without full rank or value."""
    columns = _point_and_columns(vehicle, s, κ)[3:].reshape(2, 3)
    if not np.isfinite(columns).all():
        return 0.0
    values = np.linalg.svd(columns, compute_uv=False)
    return float(values[1] / values[0])


def stability_near_straight(evidence: Evidence) -> Judgement:
    """III-A.13: do values, rounding and jumps stay small with some threshold?"""
    arm = evidence.vehicle.arm
    rounding, jump = {}, {}
    for κ_s in KAPPA_S:
        vehicle = evidence.vehicle.replace({"arm.kappa_s": κ_s})
        rounding[κ_s] = max(rounding_error(vehicle, κ) for κ in κ_s * np.linspace(0.0, 5.0, 101))
        below, inside = (_in_arm_lengths(vehicle, -κ_s * share) for share in (1 + 1e-9, 1 - 1e-9))
        jump[κ_s] = float(np.abs(below - inside).max())
    good = [κ_s for κ_s in KAPPA_S if rounding[κ_s] < 1e-6 and jump[κ_s] < 0.01]
    unguarded = np.isfinite(_point_and_columns(_unguarded(evidence.vehicle), arm.length, 0.0)).all()
    told = "; ".join(
        f"{max(rounding[κ_s], AGREES):.0e} and {jump[κ_s]:.0e} for {κ_s:g} 1/m" for κ_s in KAPPA_S
    )
    return judged(
        bool(good),
        "rounding error, and jump at −κ_s where the bend changes its sign, in arm lengths, by κ_s: "
        f"{told} (Eq. (5) does not hold κ). The paper prints no κ_s; without one the value at "
        f"κ = 0 is {'finite' if unguarded else 'not a number'}",
        **{f"jump at kappa_s {κ_s:g} 1/m [arm lengths]": jump[κ_s] for κ_s in KAPPA_S[1:]},
    )


def rounding_error(vehicle: Vehicle, κ: float) -> float:
    """Largest rounding error of Eq. (2) and Appendix A at a bend, in arm lengths."""
    κ, length = max(abs(κ), vehicle.arm.kappa_s), vehicle.arm.length
    x = κ * length
    half, full = np.sinc(x / (2 * np.pi)), np.sinc(x / np.pi)
    # (sin x - x cos x)/x², by its series where the difference would lose digits.
    small = x / 3 - x**3 / 30 + x**5 / 840
    axial = small if x < 0.1 else (np.sin(x) - x * np.cos(x)) / x**2
    right = [0.5 * x * half**2, 0.0, full, full - 0.5 * half**2, 0.0, axial, 0.0,
             0.5 * x * half**2, 0.0]  # fmt: skip
    return float(np.abs(_in_arm_lengths(vehicle, κ) - right).max())


def _in_arm_lengths(vehicle: Vehicle, κ: float) -> Array:
    """Tip of Eq. (2) and columns of Appendix A (9,), bent towards x, as multiples of the length."""
    length = vehicle.arm.length
    scales = np.repeat([length, length**2, length], 3)
    return _point_and_columns(vehicle, length, κ) / scales


def _point_and_columns(vehicle: Vehicle, s: float, κ: float) -> Array:
    """Tip of Eq. (2) and columns of Appendix A, with the vehicle's threshold, bent towards x."""
    q = _bent(κ)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = equations.arm_position(vehicle, q, s) * [1.0, 1.0, -1.0]
        columns, _ = equations.arm_jacobian(vehicle, q, s)
    return np.concatenate([point, columns[:, 0], columns[:, 1]])


def _unguarded(vehicle: Vehicle) -> Vehicle:
    """The vehicle without Remark 1."""
    return vehicle.replace({"arm.kappa_s": 0.0})


def _bent(κ: float) -> Array:
    """Coordinates with a bend towards x and nothing else."""
    return np.array([0.0] * 6 + [κ, 0.0])


JUDGES = {
    "III-A.11": singularity_and_threshold,
    "III-A.13": stability_near_straight,
}
"""Judge of every sentence of Remark 1, by its id."""
