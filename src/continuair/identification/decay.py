"""Frequency and damping of a free decay, from positions of one point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import least_squares

from continuair.errors import InputError
from continuair.typing import Array

MOVING = 0.3
"""Share of the largest speed above which a released arm counts as moving."""

FEWEST = 30
"""Samples from the onset of motion on that a decay needs."""

_LAST = 0.1
"""Share of the samples at the end that gives the rest position where the search starts."""

_PERIODS = (0.5, 1.0, 2.0, 4.0)
"""Periods in the recording from which the fit of the sine starts; the best end is kept."""

_MOST_DAMPED = 0.99


@dataclass(frozen=True)
class Decay:
    """A damped sine fitted to the motion of a point in its main direction.

    Parameters
    ----------
    frequency : float
        Undamped natural frequency [Hz].
    damping_ratio : float
        Damping ratio.
    rms : float
        Root mean square of the motion about its rest, in all directions [m].
    misfit : float
        Root mean square of what the sine leaves [m].
    """

    frequency: float
    damping_ratio: float
    rms: float
    misfit: float


def onset(path: Array, rate: float) -> int:
    """Return the sample at which a released point starts to move.

    It is the first one whose speed exceeds `MOVING` of the largest. Speeds are those of a running
    median over 5 samples, which a single false sample does not change.

    Parameters
    ----------
    path : ndarray, shape (samples, 3)
        Positions [m].
    rate : float
        Samples per second [Hz].

    Returns
    -------
    int
        Index of the sample.

    Raises
    ------
    InputError
        If there are fewer than two samples.
    """
    if len(path) < 2:
        raise InputError("path", f"has {len(path)} samples", f"record {FEWEST} or more")
    calm = median_filter(path, size=(5, 1), mode="nearest")
    speed = np.linalg.norm(np.gradient(calm, 1.0 / rate, axis=0), axis=1)
    return int(np.argmax(speed > MOVING * speed.max()))


def decay_of(path: Array, rate: float) -> Decay:
    """Fit a damped sine to a free decay, along the main direction of its motion.

    Parameters
    ----------
    path : ndarray, shape (samples, 3)
        Positions from the onset of motion on [m]. The first one is displaced.
    rate : float
        Samples per second [Hz].

    Returns
    -------
    Decay
        Frequency, damping ratio, and what the sine leaves.

    Raises
    ------
    InputError
        If there are too few samples, or the point does not move.

    Notes
    -----
    x(t) = c + exp(-ζωt) (a cos ω_d t + b sin ω_d t), ω_d = ω √(1 - ζ²), by least squares with a
    loss that grows linearly beyond a tenth of the motion's root mean square.
    """
    if len(path) < FEWEST:
        raise InputError(
            "recording",
            f"has {len(path)} samples after the onset of motion",
            f"record {FEWEST} or more",
        )
    moved = path - path[-max(int(_LAST * len(path)), 1) :].mean(axis=0)
    size = float(np.sqrt(np.mean(np.sum(moved**2, axis=1))))
    if not size > 0.0:
        raise InputError("recording", "has a marker that does not move", "record a release")
    direction = np.linalg.svd(moved, full_matrices=False)[2][0]
    x = moved @ direction / size
    t = np.arange(len(x)) / rate

    def left(unknowns: Array) -> Array:
        ω, ζ, a, b, c = unknowns
        phase = ω * np.sqrt(1.0 - ζ**2) * t
        modelled = c + np.exp(-ζ * ω * t) * (a * np.cos(phase) + b * np.sin(phase))
        return np.asarray(modelled - x)

    fastest = np.pi * rate
    bounds = [0.0, 0.0, *3 * [-np.inf]], [fastest, _MOST_DAMPED, *3 * [np.inf]]
    starts = [2.0 * np.pi * periods / t[-1] for periods in _PERIODS]
    fits = [
        least_squares(left, [ω, 0.3, x[0], 0.0, 0.0], bounds=bounds, loss="soft_l1", f_scale=0.1)
        for ω in starts
        if ω < fastest
    ]
    best = min(fits, key=lambda fit: fit.cost)
    misfit = float(np.sqrt(np.mean(left(best.x) ** 2)) * size)
    return Decay(float(best.x[0] / (2.0 * np.pi)), float(best.x[1]), size, misfit)
