"""At which frequency a sampled motion goes to and fro."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_PADDING = 16
"""Points of a spectrum per point that the samples alone would give: a peak is found between."""

CLEAR = 0.5
"""Least share of the power about a peak with which a motion counts as one of that frequency."""

STILL = 1e-6
"""Largest range of a motion that counts as none, in its unit."""


class Peak(NamedTuple):
    """The highest peak of a spectrum: frequency [Hz], and the share of all power about it."""

    hz: float
    share: float


def spectrum(time: ArrayLike, values: ArrayLike) -> tuple[Array, Array]:
    """Return frequencies (n,) [Hz] and amplitudes (n,), in the unit of the values.

    time: (samples,) [s], evenly spaced. values: (samples, components); their mean is left out, and
    the amplitudes are of all components together. A sine of amplitude a has a peak of height a.
    """
    time, values = np.asarray(time, float), np.asarray(values, float)
    window = np.hanning(len(time))[:, None]
    size = _PADDING * len(time)
    parts = np.fft.rfft((values - values.mean(axis=0)) * window, size, axis=0)
    amplitudes: Array = 2.0 / window.sum() * np.linalg.norm(parts, axis=1)
    return np.fft.rfftfreq(size, time[1] - time[0]), amplitudes


def dominant(time: ArrayLike, values: ArrayLike) -> Peak | None:
    """Return the peak of a motion that mostly goes to and fro at one frequency, or None.

    time, values: as in `spectrum`. None if the motion is smaller than STILL, not finite, slower
    than two cycles in the time given, or spread over frequencies (CLEAR).
    """
    time, values = np.asarray(time, float), np.asarray(values, float)
    if not np.isfinite(values).all() or np.ptp(values, axis=0).max() < STILL:
        return None
    hz, amplitudes = spectrum(time, values)
    highest = float(hz[np.argmax(amplitudes)])
    duration = float(time[-1] - time[0])
    # The main lobe of the window of Hann reaches two lines of the spectrum to either side.
    about = np.abs(hz - highest) <= 2.0 / duration
    share = float(np.sum(amplitudes[about] ** 2) / np.sum(amplitudes**2))
    return Peak(highest, share) if highest * duration >= 2.0 and share >= CLEAR else None
