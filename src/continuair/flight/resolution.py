"""How well steps resolve a flight: `step_error`, and what follows from one that is large."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
from numpy.typing import ArrayLike

from continuair.warning import untold, warn

Array = np.ndarray

RESOLVED = 1e-3
"""Largest step_error of a flight that counts as resolved [arm lengths]."""

_ROUNDING = 1e-9
"""Saturation that is none."""

_OVERSTATED = 3.0
"""Times the angle between tips from which on a difference of Euler angles is no rotation."""

_ALIKE = 1e-6
"""Difference of Euler angles that is none, in float32, too [rad]."""

UNSEEN = 1.0
"""Phase of a known input from which a step does not follow it [rad]: six steps a period."""

_GROWTH, _MOST_GROWTH = 0.004, 0.1
"""Exponents of what the swing multiplies errors by [1/rad²], as a rule and at the most."""

# By this a loop around a camera grows them at the least, where it is far from its target.
_LOOP = 50.0
# By this a loop without one may, and, by its bandwidths, by so many times what is bound to be.
_IN_LOOP, _SLOW = 100.0, 6.0
# By this a loop around a camera may, and by e per weight that it pushes with, by e^6 per radian
# that it turns its vehicle through, but by no more than e^8 in all.
_IN_SIGHT, _TURNING, _MOST_IN_SIGHT = 60.0, 6.0, 8.0
# Beyond this exponent nothing is left to tell.
_MOST = 50.0


_BROKEN = 1e6
"""step_error of what has no finite one: inf says that steps miss an input."""


def step_error(errors: Array, looking: bool = False) -> Array:
    """Estimated largest error of the tip (...) [arm lengths], from sums of a roll-out (..., SUMS).

    The errors of single steps add up, and grow while a large bend swings: by e per 250 rad² of the
    swing ∫|k||k̇| l² dt, a bound that 600 random flights of light vehicles and large bends gave.
    looking: under a law with a camera, which multiplies them, by hundreds where gains are high and
    the target is far; loops that hold their target stay below what the factor for it flags. What
    torques may have done the wrong way is added as it is. What steps break to pieces is 1e6.
    """
    # In extended precision, as NumPy's own exponentials differ in the last bit by processor.
    grown = np.exp(np.minimum(_GROWTH * errors[..., 1].astype(np.longdouble), _MOST)).astype(float)
    found = errors[..., 0] * grown * (_LOOP if looking else 1.0) + doubt(errors)
    return np.asarray(np.minimum(found, _BROKEN), float)


def may_multiply(errors: Array, in_loop: Array | float, chained: bool) -> Array:
    """Whether errors may have multiplied beyond RESOLVED (...), by sums of a roll-out: by a swing
    of several sections, chained, and by a loop, by in_loop (...) at the most.

    In 800 random flights of limp arms of two sections, free and under a flight controller, the
    swing multiplied those that came to more than 1e-3 by less than this in all.
    """
    swing = np.exp(np.minimum(_MOST_GROWTH * errors[..., 1], _MOST)) if chained else 1.0
    return np.asarray(errors[..., 0] * in_loop * swing > RESOLVED)


def most_in_loop(leaned: Array, lasting: Array) -> Array:
    """By which a loop without a camera multiplies errors at the most.

    leaned: how far a law lets an angle that it is off by move the vehicle, in arm lengths per rad;
    lasting: for how long it does, in times for which single steps count errors of velocities. A law
    at its limits answers all or nothing, whatever its bandwidths. Of 6,200 random flights of one
    section 374 came to more than 1e-2 with a step_error below 1e-3: this finds them all.
    """
    slow = np.maximum(leaned, 1.0) * np.maximum(lasting, 1.0)
    return np.asarray(np.maximum(_SLOW * slow, _IN_LOOP))


def most_in_sight(errors: Array) -> Array:
    """By which a loop around a camera multiplies errors at the most, by sums of a roll-out.

    One that holds its target turns its vehicle little, with little more than its weight; one that
    throws it about is chaotic. Of 18,000 random flights 264 came to the end with more than 1e-3
    and a step_error below: this finds them all, and 4 % of the others.
    """
    exponent = _TURNING * errors[..., 2] + errors[..., 4]
    return np.asarray(_IN_SIGHT * np.exp(np.minimum(exponent, _MOST_IN_SIGHT)))


def doubt(errors: Array) -> Array:
    """The most (...) that torques may have gone the wrong way [arm lengths], of such sums."""
    return errors[..., 3]


def turned_through(errors: Array) -> Array:
    """The angle (...) that the UAV has turned through in all [rad], of such sums."""
    return errors[..., 2]


def saturation(errors: Array) -> Array:
    """The most (...) that rotors were asked for beyond their limits, in parts of these."""
    return errors[..., -1]


def is_beyond_limits(largest: Array | float) -> Array:
    """Whether rotors were asked for more than rounding beyond their limits, by the saturation."""
    return np.asarray(largest) > _ROUNDING


def unresolved(errors: Array) -> Array:
    """Which runs (runs,) steps do not resolve, by the step_error (runs,) or (runs, models)."""
    coarse = errors.reshape(len(errors), -1) > RESOLVED
    return np.flatnonzero(coarse.any(axis=1))


def in_runs(some: int, runs: int) -> str:
    """In how many runs something is, as warnings say it; nothing of a single one."""
    return "" if runs == 1 else f" in {some} of {runs} runs"


def warn_of_coarse_steps(errors: Array, steps: Array, stacklevel: int) -> None:
    """Warn if steps (runs,) [s] left runs unresolved, by step_error (runs,) or (runs, models).

    Not of an inf: the inputs that steps miss are told of when they are prepared.
    """
    errors = np.where(np.isinf(errors), np.nan, errors)
    coarse = unresolved(errors)
    if not len(coarse):
        return
    of = in_runs(len(coarse), len(errors))
    warn(
        f"step_error reaches {np.nanmax(errors):.2g} arm lengths{of}: steps of "
        f"{steps[coarse].max():.3g} s do not resolve this flight to {RESOLVED:g}; give a shorter "
        "step, or a shorter flight if it is chaotic.",
        stacklevel=stacklevel,
    )


def warn_of_missed_inputs(errors: Array, steps: Array, stacklevel: int) -> None:
    """Warn if steps (runs,) [s] missed all of what happened, by step_error (runs, models)."""
    missed = np.isinf(errors).any(axis=1)
    if missed.any():
        warn(
            f"step_error is inf in {missed.sum()} of {len(errors)} runs: inputs change, or "
            f"a motion diverges, within steps of {steps[missed].min():.3g} s; give a shorter step, "
            "or step = 'auto'.",
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


def warn_of_lost_coordinates(sample: float, time: float, stacklevel: int) -> None:
    """Warn that samples [s] do not follow the Euler angles of q near a time [s]."""
    warn(
        f"q: roll, pitch and yaw are not followed by samples of {sample:.3g} s near t = "
        f"{time:.3g} s; give a finer sample, or use attitude.",
        stacklevel=stacklevel,
    )


def angles_unread() -> AbstractContextManager[None]:
    """For a study that reads no Euler angles: no warnings of those that samples do not follow."""
    return untold("nrmse_r and rmse_r_rad", "q: roll, pitch and yaw")
