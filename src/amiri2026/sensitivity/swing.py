"""The tip's oscillation about the centre of mass, and how far two models' are apart."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from continuair import Vehicle
from continuair.analysis import centre_of_mass, mass_distribution, samples

Array = np.ndarray

FREQUENCY_OFF, AMPLITUDE_OFF, PHASE_OFF = (
    "oscillation_frequency_off",
    "oscillation_amplitude_off",
    "oscillation_phase_off_rad",
)
"""Keys of `differences`: shares of the coupled model's, and an angle."""


def swings_apart(
    vehicle: Vehicle, flown: Mapping[str, xr.Dataset], reference: str
) -> dict[str, list[dict[str, float]]]:
    """Return `differences` of each model to the reference, by model and run.

    vehicle: plain, or batched alike. flown: flights by model, over (run, time).
    """
    places = {model: swing(vehicle, flights) for model, flights in flown.items()}
    return {
        model: [
            differences(first, other)
            for first, other in zip(places[reference], places[model], strict=True)
        ]
        for model in flown
        if model != reference
    }


def swing(vehicle: Vehicle, flights: xr.Dataset) -> Array:
    """Return the horizontal place of the tip from the centre of mass, x + i y (runs, time) [m]."""
    com, _ = mass_distribution(vehicle, samples(flights, "bend", "bend_axis"))
    off = samples(flights, "tip_position", "axis") - centre_of_mass(flights, com)
    place: Array = off[..., 0] + 1j * off[..., 1]
    return place


def differences(coupled: Array, other: Array) -> dict[str, float]:
    """Return how far one oscillation (time,) is off: shares, and the phase in rad.

    Frequency: mean of the spectrum. Amplitude: RMS. Phase: RMS of the angle between the two, each
    instant weighted by the square of the coupled amplitude. NaN of flights that stop early.
    """
    weight = np.abs(coupled) ** 2
    angle = np.angle(other * coupled.conj())
    return {
        FREQUENCY_OFF: abs(mean_frequency(other) / mean_frequency(coupled) - 1.0),
        AMPLITUDE_OFF: abs(_rms(other) / _rms(coupled) - 1.0),
        PHASE_OFF: float(np.sqrt(np.sum(weight * angle**2) / np.sum(weight))),
    }


def mean_frequency(place: Array) -> float:
    """Return the mean of |f| over the power of a spectrum, in cycles per sample."""
    power = np.abs(np.fft.fft(place * np.hanning(len(place)))) ** 2
    return float(np.sum(np.abs(np.fft.fftfreq(len(place))) * power) / np.sum(power))


def _rms(place: Array) -> float:
    return float(np.sqrt(np.mean(np.abs(place) ** 2)))
