"""Warnings of a flight's accuracy and limits: errors, saturation, undetermined Euler angles."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
from numpy.typing import NDArray

from continuair.typing import Array, ArrayLike
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold, warn

RESOLVED = 1e-3
"""Largest error_estimate of a flight that counts as resolved [arm lengths]."""

_UNHEARD = 1e-4
"""Largest saturation that is ignored: kinks of commands, located to 0.25 µs, cause less."""

_OVERSTATED = 3.0
"""Ratio of Euler angle difference to the angle between tips above which it is no rotation."""

_ALIKE = 1e-6
"""Difference of Euler angles that counts as zero, also in float32 [rad]."""


def is_beyond_limits(largest: ArrayLike) -> NDArray[np.bool_]:
    """Return whether rotor commands exceed their limits by more than numerical ripple.

    Parameters
    ----------
    largest : array_like
        Largest saturation, in parts of the rotors' range.

    Returns
    -------
    ndarray of bool
        Whether it exceeds the ripple.
    """
    return np.asarray(largest) > _UNHEARD


def unresolved(errors: Array) -> NDArray[np.intp]:
    """Return which runs are not resolved.

    Parameters
    ----------
    errors : ndarray, shape (runs,) or (runs, models)
        Error estimates of `simulate` or `run_pairs` [arm lengths].

    Returns
    -------
    ndarray of int
        Indices of runs with an error above `RESOLVED`.
    """
    coarse = errors.reshape(len(errors), -1) > RESOLVED
    return np.flatnonzero(coarse.any(axis=1))


def in_runs(some: int, runs: int) -> str:
    """Return the number of affected runs as warnings print it; empty for a single run."""
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
    """Warn if float32 rounds positions (..., 3) [m] by more than RESOLVED of the reaches (...)."""
    rounding = 0.5 * np.finfo(np.float32).eps * np.abs(places).max(axis=-1)
    if (rounding > RESOLVED * reach).any():
        warn(
            f"dtype is 'float32', which rounds positions by up to {rounding.max():.2g} m, so far "
            "from the origin; start closer to it, or give dtype='float64'.",
            stacklevel=stacklevel,
        )


_LIMITS = {"rotors": "thrust_limits", "tendons": "limits or stroke"}
"""Fields of the limits of actuators."""


def warn_of_saturation(vehicle: Vehicle, largest: Array, stacklevel: int) -> None:
    """Warn if commands exceed the limits of rotors or tendons, by the saturation (runs,) or (runs,
    models)."""
    wrong = is_beyond_limits(largest.reshape(len(largest), -1).max(axis=1))
    if wrong.any():
        who, limits = vehicle.limited, [_LIMITS[name] for name in vehicle.limited]
        warn(
            f"{' or '.join(who)} saturate{in_runs(wrong.sum(), len(wrong))}: commands exceed their "
            f"range by up to {100.0 * np.nanmax(largest):.3g} %; see largest_saturation, or widen "
            f"{' or '.join(limits)}.",
            stacklevel=stacklevel,
        )


def warn_of_lost_angles(lost: NDArray[np.bool_], sample: float, stacklevel: int) -> None:
    """Warn of runs (...) whose Euler angles samples [s] do not determine, which are NaN."""
    runs, count = np.size(lost), int(np.count_nonzero(lost))
    if count:
        of = in_runs(count, runs)
        warn(
            f"nrmse_r and rmse_r_rad are NaN{of}: samples of {sample:.3g} s do not resolve the "
            "tip's Euler angles; give a finer sample, or use angle_rad.",
            stacklevel=stacklevel,
        )


def overstated(rmse_r_rad: ArrayLike, angle_rad: ArrayLike) -> NDArray[np.bool_]:
    """Return where Euler angles of two tips differ by much more than their attitudes.

    Parameters
    ----------
    rmse_r_rad : array_like
        RMSE of the Euler angles [rad].
    angle_rad : array_like
        RMS angle between the attitudes [rad].

    Returns
    -------
    ndarray of bool
        True where Euler angles overstate the rotation.

    Notes
    -----
    Near a pitch of ±π/2, roll and yaw change by π, with opposite signs on its two sides. Tips that
    pass it on different sides, or at different times, differ by multiples of π.
    """
    euler, angle = np.asarray(rmse_r_rad, float), np.asarray(angle_rad, float)
    larger = (euler > _OVERSTATED * angle) & (euler > _ALIKE)
    # Two attitudes differ by π at most.
    return np.asarray(larger | (euler > np.pi))


def tells_rotation(rmse_r_rad: ArrayLike, angle_rad: ArrayLike) -> NDArray[np.bool_]:
    """Return where Euler angles of two tips are determined, and measure their rotation.

    Parameters
    ----------
    rmse_r_rad : array_like
        RMSE of the Euler angles [rad], NaN if undetermined.
    angle_rad : array_like
        RMS angle between the attitudes [rad].

    Returns
    -------
    ndarray of bool
        True where the Euler angles are valid.
    """
    return np.asarray(np.isfinite(rmse_r_rad) & ~overstated(rmse_r_rad, angle_rad))


def warn_of_overstated_angles(rmse_r_rad: ArrayLike, angle_rad: ArrayLike, stacklevel: int) -> None:
    """Warn of runs (runs,) or (runs, models) whose Euler angles overstate the rotation."""
    euler, angle = np.atleast_1d(rmse_r_rad), np.atleast_1d(angle_rad)
    found = np.atleast_1d(overstated(euler, angle))
    if found.any():
        runs = np.asarray(found.reshape(found.shape[0], -1).any(axis=1))
        times = np.max(euler[found] / np.maximum(angle[found], _ALIKE))
        of = in_runs(int(runs.sum()), runs.size)
        warn(
            f"nrmse_r and rmse_r_rad overstate the rotation{of}, up to {times:.2g} times, as Euler "
            "angles wrap, or jump near a pitch of ±π/2; use angle_rad.",
            stacklevel=stacklevel,
        )


def angles_unread() -> AbstractContextManager[None]:
    """Suppress warnings of Euler angles, for a study that does not use them.

    Returns
    -------
    context manager
        Within it, the warnings are not shown.
    """
    return untold("nrmse_r and rmse_r_rad")
