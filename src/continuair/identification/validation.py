"""Releases that a vehicle predicts against those that were measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from continuair.errors import InputError
from continuair.identification.decay import Decay, decay_of
from continuair.identification.releases import Releases
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import warn


@dataclass(frozen=True)
class ReleaseValidation:
    """Frequency, damping and motion of releases, measured and predicted.

    Parameters
    ----------
    name : str
        The recording.
    payload : float
        Mass that the tip carried [kg].
    measured, predicted : tuple of Decay
        Damped sines of the outermost marker, for each release.
    error : ndarray, shape (releases,)
        Root mean square of the distance of all markers from their predicted places [m].
    """

    name: str
    payload: float
    measured: tuple[Decay, ...]
    predicted: tuple[Decay, ...]
    error: Array

    def describe(self) -> dict[str, object]:
        """Return means over the releases, for JSON.

        Returns
        -------
        dict
            `frequency_hz`, `damping_ratio` and `rms_mm` (motion of the outermost marker about its
            rest), each with measured, predicted and the standard error of the measured mean;
            `error_mm`, the root mean square distance of the markers from their predicted places.
        """
        return {
            "study": "validate-release",
            "recording": self.name,
            "payload_kg": self.payload,
            "releases": len(self.measured),
            "frequency_hz": self._row("frequency", 1.0),
            "damping_ratio": self._row("damping_ratio", 1.0),
            "rms_mm": self._row("rms", 1e3),
            "error_mm": 1e3 * float(np.sqrt(np.mean(self.error**2))),
        }

    def _row(self, name: str, unit: float) -> dict[str, float | None]:
        measured, predicted = (
            unit * np.array([getattr(each, name) for each in decays])
            for decays in (self.measured, self.predicted)
        )
        many = len(measured) > 1
        return {
            "measured": float(measured.mean()),
            "standard_error": float(measured.std(ddof=1) / len(measured) ** 0.5) if many else None,
            "predicted": float(predicted.mean()),
        }


def validate_releases(vehicle: Vehicle, releases: Releases) -> ReleaseValidation:
    """Compare recorded releases with those of a vehicle.

    Every release starts from its measured shape and its rate at the onset of motion; frequency and
    damping of both motions are found by the same estimator, `decay_of`.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, of one arm.
    releases : Releases
        The recording.

    Returns
    -------
    ReleaseValidation
        Measured and predicted values.

    Raises
    ------
    InputError
        If the vehicle's simulation stops before the recording ends.

    Warns
    -----
    UserWarning
        If markers are farther from their predicted places than the tip moves.
    """
    measured = releases.measured(vehicle)
    predicted = releases.predictor(vehicle)(vehicle)[0]
    missing = np.isfinite(measured) & ~np.isfinite(predicted)
    if missing.any():
        raise InputError(
            "vehicle",
            "stops before the recording ends when its arm is let go as measured",
            "check markers, base and up of the bench, and the arm's stiffness and damping",
        ).located(releases.name)
    apart = np.sum((predicted - measured) ** 2, axis=-1)
    found = ReleaseValidation(
        name=releases.name,
        payload=releases.payload,
        measured=_decays(measured, releases),
        predicted=_decays(predicted, releases),
        error=np.sqrt(np.nanmean(apart, axis=(1, 2))),
    )
    _tell_if_unlike(found)
    return found


def _tell_if_unlike(found: ReleaseValidation) -> None:
    """Warn if an arm that does not move at all would be predicted better."""
    off, moved = (
        1e3 * float(np.sqrt(np.mean(np.square(each))))
        for each in (found.error, [decay.rms for decay in found.measured])
    )
    if off > moved:
        warn(
            f"{found.name}: markers are {off:.0f} mm from their predicted places, more than the "
            f"tip's motion of {moved:.0f} mm; check base and up of the bench, rate and payload.",
            3,
        )


def _decays(motions: Array, of: Releases) -> tuple[Decay, ...]:
    """Return the decays of the outermost marker of motions (releases, samples, markers, 3)."""
    each = zip(motions, of.motions, strict=True)
    return tuple(decay_of(motion[: len(own), -1], of.rate) for motion, own in each)
