"""How fast a target may move before decoupling shows in the image, for one vehicle."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.analysis.determinacy import fly_twice
from continuair.analysis.limits import find_limits
from continuair.analysis.metrics import TRANSIENT, feature_rms, norm_difference
from continuair.controllers.controller import Controller
from continuair.controllers.gain_files import Gains
from continuair.kernels.dynamics import REFERENCE
from continuair.scenario import paths
from continuair.scenario.tracking_task import LETTER_HEIGHT, SETTINGS, damping_notes, equipped, task
from continuair.typing import Model
from continuair.vehicle.vehicle import Vehicle

SLOWEST, FASTEST = 50.0, 5.0
"""Durations of a letter that are tried [s]."""

SCANNED, REFINED = 10, 6
"""Durations in the scan, and in the round that halves in on the limit."""


def tracking_limit(
    vehicle: Vehicle,
    letter: str,
    gains: Gains | Controller,
    models: tuple[Model, ...],
    pixels: float,
) -> dict[str, Any]:
    """Return the target speed up to which each model stays within `pixels` of the coupled one.

    The camera has no noise. Returns by model: ds_max_px at the slowest letter, limit_m_s (NaN: none
    of those tried, inf: all), and the scan: speeds [m/s] and the largest |DS| [px] after the
    transient. |DS| is NaN where a run ended early, or rounding dominates it. rms_px: of the coupled
    plant. gains: of the paper's law, or a controller. Raises InputError.
    """
    # Of one draw of noise, limits would be that draw's.
    flown = equipped(vehicle, SETTINGS["nominal"]).replace({"camera.noise": 0.0})
    own = isinstance(gains, Controller)
    law = gains if isinstance(gains, Controller) else gains.controller(flown)

    def fly(durations: np.ndarray, *models: Model) -> dict[str, np.ndarray]:
        return _fly(flown, letter, law, durations, models)

    def finer(durations: np.ndarray, name: str) -> np.ndarray:
        (model,) = (each for each in models if each == name)
        return fly(durations, model)[name]

    durations = np.geomspace(SLOWEST, FASTEST, SCANNED)
    found = fly(durations, *models)
    rms = found.pop("rms")
    limits = find_limits(durations, found, pixels, finer, REFINED)
    lost = np.isnan(rms)
    return {
        "letter": letter,
        "gains": "" if own else gains.name,
        "controller": law.name,
        "models": {
            model: {
                "ds_max_px": float(limit.errors[0]),
                "limit_m_s": _speed(letter, limit.last) if np.isfinite(limit.last) else limit.last,
                "speed_m_s": [_speed(letter, each) for each in limit.places],
                "ds_px": limit.errors.tolist(),
            }
            for model, limit in limits.items()
        },
        "rms_px": float(rms[0]),
        "lost_from_m_s": _speed(letter, durations[np.argmax(lost)]) if lost.any() else np.inf,
    }


def tracking_notes(vehicle: Vehicle) -> list[str]:
    """Return sentences on differences between the vehicle and its simulation in tracking."""
    if not (noise := vehicle.camera.noise):
        return damping_notes(vehicle)
    return [
        *damping_notes(vehicle),
        f"Tracking is flown without the camera's noise of {noise:g} px, which is that of no model "
        "and no speed.",
    ]


def _fly(
    vehicle: Vehicle, letter: str, law: Any, durations: np.ndarray, models: tuple[Model, ...]
) -> dict[str, np.ndarray]:
    """Return the RMS error of the coupled plant, and |DS| of each model, by duration."""
    letters = [letter] * len(durations)
    # No initial error: its transient, long for a slow law, does not depend on the target's speed.
    scenario = task(vehicle, letters, law, durations.tolist(), off=False)
    flights = {}
    for model in (REFERENCE, *models):
        flight, held = fly_twice(vehicle, scenario, model=model, sample=2e-2)
        flights[model] = flight.where(held)
    found = {name: np.empty(len(durations)) for name in ("rms", *models)}
    for run, end in enumerate(durations):
        coupled, *others = (
            each.isel(run=run).sel(time=slice(TRANSIENT, end)) for each in flights.values()
        )
        found["rms"][run] = feature_rms(coupled)
        for model, other in zip(models, others, strict=True):
            found[model][run] = np.abs(norm_difference(coupled, other)).max()
    return found


def _speed(letter: str, duration: float) -> float:
    """Return the largest speed of the letter's centroid [m/s]."""
    velocity = paths.letter(letter, LETTER_HEIGHT, duration)(np.linspace(0.0, duration, 2001))[1]
    return float(np.linalg.norm(velocity, axis=1).max())
