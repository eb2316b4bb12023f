"""The tip's oscillation about the centre of mass, and how far two flights' are apart."""

from __future__ import annotations

import numpy as np
import xarray as xr

from continuair.analysis.mass import centre_of_mass, mass_distribution
from continuair.analysis.metrics import samples
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


def swing(vehicle: Vehicle, flights: xr.Dataset) -> Array:
    """Horizontal place of the tip from the centre of mass, x + i y (runs, time) [m]."""
    com, _ = mass_distribution(vehicle, samples(flights, "bend", "bend_axis"))
    off = samples(flights, "tip_position", "axis") - centre_of_mass(flights, com)
    place: Array = off[..., 0] + 1j * off[..., 1]
    return place


def differences(coupled: Array, other: Array) -> dict[str, float]:
    """How far one oscillation (time,) is off: frequency and amplitude [shares], phase [rad].

    Frequency: mean of the spectrum. Amplitude: RMS. Phase: RMS of the angle between the two, each
    instant weighted by the square of the coupled amplitude.
    """
    weight = np.abs(coupled) ** 2
    angle = np.angle(other * coupled.conj())
    return {
        "frequency": abs(mean_frequency(other) / mean_frequency(coupled) - 1.0),
        "amplitude": abs(_rms(other) / _rms(coupled) - 1.0),
        "phase": float(np.sqrt(np.sum(weight * angle**2) / np.sum(weight))),
    }


def mean_frequency(place: Array) -> float:
    """Mean of |f| over the power of a spectrum, in cycles per sample."""
    power = np.abs(np.fft.fft(place * np.hanning(len(place)))) ** 2
    return float(np.sum(np.abs(np.fft.fftfreq(len(place))) * power) / np.sum(power))


def _rms(place: Array) -> float:
    return float(np.sqrt(np.mean(np.abs(place) ** 2)))
