"""Warnings of a flight's accuracy and limits: errors, saturation, lost angles."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
from numpy.typing import ArrayLike

from continuair.warning import untold, warn

Array = np.ndarray

RESOLVED = 1e-3
"""Largest error_estimate of a flight that counts as resolved [arm lengths]."""

_UNHEARD = 1e-4
"""Largest saturation that is ignored: kinks of commands, located to 0.25 µs, cause less."""

_OVERSTATED = 3.0
"""Times the angle between tips from which on a difference of Euler angles is no rotation."""

_ALIKE = 1e-6
"""Difference of Euler angles that is none, in float32, too [rad]."""


def is_beyond_limits(largest: Array | float) -> Array:
    """Whether rotors were asked for more than ripple beyond their limits, by the saturation."""
    return np.asarray(largest) > _UNHEARD


def unresolved(errors: Array) -> Array:
    """Which runs (runs,) are not resolved, by the error_estimate (runs,) or (runs, models)."""
    coarse = errors.reshape(len(errors), -1) > RESOLVED
    return np.flatnonzero(coarse.any(axis=1))


def in_runs(some: int, runs: int) -> str:
    """In how many runs something is, as warnings say it; nothing of a single one."""
    return "" if runs == 1 else f" in {some} of {runs} runs"


def warn_of_errors(errors: Array, stacklevel: int) -> None:
    """Warn of runs that are not resolved, by the error_estimate (runs,) or (runs, models)."""
    coarse = unresolved(errors)
    if len(coarse):
        warn(
            f"error_estimate reaches {np.nanmax(errors):.2g} arm lengths"
            f"{in_runs(len(coarse), len(errors))}; give a smaller rtol or step, or a shorter "
            "flight if it is chaotic.",
            stacklevel=stacklevel,
        )


def warn_of_rounded_places(places: Array, reach: Array, stacklevel: int) -> None:
    """Warn if float32 rounds places (..., 3) [m] of runs by more than RESOLVED of reaches (...)."""
    rounding = 0.5 * np.finfo(np.float32).eps * np.abs(places).max(axis=-1)
    if (rounding > RESOLVED * reach).any():
        warn(
            f"dtype is 'float32', which rounds places here by up to {rounding.max():.2g} m, so far "
            "from the origin; start nearer to it, or give dtype = 'float64'.",
            stacklevel=stacklevel,
        )


def warn_of_saturation(largest: Array, stacklevel: int) -> None:
    """Warn if rotors were asked for thrusts beyond their limits, (runs,) or (runs, models)."""
    wrong = is_beyond_limits(largest.reshape(len(largest), -1).max(axis=1))
    if wrong.any():
        warn(
            f"rotors saturate{in_runs(wrong.sum(), len(wrong))}: they are asked for up to "
            f"{100.0 * np.nanmax(largest):.3g} % of their range beyond it; see the result's "
            "largest_saturation, or give thrust_limits that leave room.",
            stacklevel=stacklevel,
        )


def warn_of_lost_angles(lost: Array, sample: float, stacklevel: int) -> None:
    """Warn of runs (...) whose Euler angles samples [s] do not follow, which are NaN."""
    runs, count = np.size(lost), int(np.count_nonzero(lost))
    if count:
        of = in_runs(count, runs)
        warn(
            f"nrmse_r and rmse_r_rad are NaN{of}: samples of {sample:.3g} s do not follow roll, "
            "pitch and yaw of the tip; give a finer sample, or use angle_rad, which always holds.",
            stacklevel=stacklevel,
        )


def overstated(rmse_r_rad: ArrayLike, angle_rad: ArrayLike) -> Array:
    """Where (...) Euler angles of two tips differ by much more than their attitudes do [rad].

    Beside a pitch of ±π/2 roll and yaw swing by half a turn, on its two sides either way: tips that
    pass it apart, or one after the other, are counted half turns and whole ones apart.
    """
    euler, angle = np.asarray(rmse_r_rad, float), np.asarray(angle_rad, float)
    larger = (euler > _OVERSTATED * angle) & (euler > _ALIKE)
    # No two attitudes are more than half a turn apart.
    return np.asarray(larger | (euler > np.pi))


def tells_rotation(rmse_r_rad: ArrayLike, angle_rad: ArrayLike) -> Array:
    """Where (...) Euler angles of two tips are followed, and tell of their rotation [rad]."""
    return np.asarray(np.isfinite(rmse_r_rad) & ~overstated(rmse_r_rad, angle_rad))


def warn_of_overstated_angles(rmse_r_rad: ArrayLike, angle_rad: ArrayLike, stacklevel: int) -> None:
    """Warn of runs (runs,) or (runs, models) whose differences of Euler angles are no rotation."""
    euler, angle = np.atleast_1d(rmse_r_rad), np.atleast_1d(angle_rad)
    found = np.atleast_1d(overstated(euler, angle))
    if found.any():
        runs = np.asarray(found.reshape(found.shape[0], -1).any(axis=1))
        times = np.max(euler[found] / np.maximum(angle[found], _ALIKE))
        of = in_runs(int(runs.sum()), runs.size)
        warn(
            f"nrmse_r and rmse_r_rad overstate the rotation{of}, up to {times:.2g} times: Euler "
            "angles count whole turns, and half turns of roll and yaw where a tip passes beside a "
            "pitch of ±π/2; use angle_rad.",
            stacklevel=stacklevel,
        )


def angles_unread() -> AbstractContextManager[None]:
    """For a study that reads no Euler angles: no warnings of those that samples do not follow."""
    return untold("nrmse_r and rmse_r_rad")
