"""Accelerations of the bend near the straight arm: with the paper's threshold, and without."""

from __future__ import annotations

import numpy as np

from amiri2026.extremes import least
from amiri2026.verdicts import Case, judged
from continuair import Vehicle, equations, forward_dynamics
from continuair.analysis import percent

Array = np.ndarray

THRESHOLDS = (1e-2, 1e-3, 1e-4, 1e-5)
"""Values of κ_s that are tried [1/m]; the paper prints none."""

_SIZES = np.geomspace(1e-6, 1e-2, 9)

CURVATURES = np.concatenate([-_SIZES[::-1], [0.0], _SIZES])
"""Values of κ in both signs [1/m]."""

RIGHT = 0.01
"""Share of the largest acceleration up to which accelerations count as right."""

_NEXT_TO_STRAIGHT = 1e-9
"""κ that stands for 0 where a direction is needed [1/m]."""

# An attitude, a direction of the bend, rates and forces of everyday size, none of them special.
_Q = (0.0, 0.0, 5.0, 0.1, 0.2, 0.3, 0.0, 0.4)
_RATES = (0.1, 0.2, 0.3, 0.5, -0.3, 0.2, 0.1, 1.0)
_TAU = (10.0, 5.0, 30.0, 0.2, 0.1, 0.05, 0.0, 0.0)


def as_cases(vehicle: Vehicle) -> list[Case]:
    """Return whether accelerations are right with κ_s for κ in M and C, and with κ_s before C."""
    true = without_singularity(vehicle)
    errors = {value: error(with_threshold(vehicle, value), true) for value in THRESHOLDS}
    listed = ", ".join(f"{percent(errors[value])} for {value:g}" for value in errors)
    sloped = error(with_threshold(vehicle, 1e-3, differentiated=True), true)
    derived = judged(
        least(errors.values()) <= RIGHT,
        f"those of the bend are off by up to {listed} 1/m as κ_s, for |κ| up to 0.01 1/m in both "
        "signs",
        # Smaller thresholds lose digits, differently on every machine.
        **{f"error for κ_s of {value:g} 1/m, share": errors[value] for value in (1e-2, 1e-3)},
    )
    before = judged(
        sloped <= RIGHT,
        "C lacks its slopes by κ, and with 0.001 1/m as κ_s those of the bend are off by "
        f"{sloped:.2g} times the largest",
    )
    reading = "accelerations at ψ̇a = 1 rad/s, κ_s for κ"
    return [
        Case(vehicle.name, f"{reading} in the derived M and C", derived),
        Case(vehicle.name, f"{reading} before C is derived", before),
    ]


def with_threshold(vehicle: Vehicle, threshold: float, *, differentiated: bool = False) -> Array:
    """Return bend accelerations (CURVATURES, 2) of Eq. (10) with Remark 1, along and across.

    Up to κ_s, κ_s replaces κ in the terms of Eq. (10), but not in the spring; across the bend, also
    in κ ψ̈a + 2 κ̇ ψ̇a. differentiated: replace κ in the kinematics before C is derived instead. C
    then lacks all derivatives with respect to κ.
    """
    plain, thresholded = (vehicle.replace({"arm.kappa_s": κ_s}) for κ_s in (0.0, threshold))
    spring = vehicle.arm.bending_stiffness * vehicle.arm.length

    def at(κ: float) -> Array:
        used = threshold if abs(κ) <= threshold else κ
        q, qd = _state(κ if differentiated else used)
        tau = np.array(_TAU)
        if not differentiated:
            tau[6] += spring * (used - κ)
        flown = thresholded if differentiated else plain
        return _components(equations.forward_dynamics(flown, q, qd, tau), qd, used)

    return np.array([at(κ) for κ in CURVATURES])


def without_singularity(vehicle: Vehicle) -> Array:
    """Return the same from the components of the bend vector, which are singular nowhere."""
    plain = vehicle.replace({"arm.kappa_s": 0.0})

    def at(κ: float) -> Array:
        q, qd = _state(κ or _NEXT_TO_STRAIGHT)
        return _components(forward_dynamics(plain, q, qd, np.array(_TAU)), qd, q[6])

    return np.array([at(κ) for κ in CURVATURES])


def error(found: Array, true: Array) -> float:
    """Return largest error, as a share of the largest acceleration along the bend, or across it."""
    off = np.abs(found - true).max(axis=0) / np.abs(true).max(axis=0)
    return float(off.max()) if np.isfinite(found).all() else float("inf")


def _state(κ: float) -> tuple[Array, Array]:
    q = np.array(_Q)
    q[6] = κ
    return q, np.array(_RATES)


def _components(qdd: Array, qd: Array, κ: float) -> Array:
    return np.array([qdd[6] - κ * qd[7] ** 2, κ * qdd[7] + 2.0 * qd[6] * qd[7]])
