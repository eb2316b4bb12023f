"""How fast a target may move before decoupling shows in the image, for one vehicle."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.controllers.gain_files import Gains
from continuair.flight.simulate import simulate
from continuair.scenario import paths
from continuair.studies.tracking.task import LETTER_HEIGHT, SETTINGS, equipped, task
from continuair.vehicle.vehicle import Vehicle

SLOWEST, FASTEST = 50.0, 5.0
"""Durations of a letter that are tried [s]."""

SCANNED, REFINED = 10, 6
"""Durations in the scan, and in the round that halves in on the limit."""

TRANSIENT = 2.0
"""DS counts from this time on [s]."""


def tracking_limit(
    vehicle: Vehicle, letter: str, gains: Gains, models: tuple[str, ...], pixels: float
) -> dict[str, Any]:
    """Target speed up to which each model's plant stays within `pixels` of the coupled one.

    Returns by model: ds_max_px at the slowest letter, limit_m_s (NaN: none of those tried, inf:
    all), and the scan: speeds [m/s] and the largest |DS| [px] after the transient (NaN where a run
    ended early); and rms_px of the coupled plant. Raises InputError.
    """
    flown = equipped(vehicle, SETTINGS["nominal"])
    law = gains.controller(flown)
    durations = np.geomspace(SLOWEST, FASTEST, SCANNED)
    found = _fly(flown, letter, law, durations, models)
    results: dict[str, Any] = {"letter": letter, "gains": gains.name, "models": {}}
    for model in models:
        scan = {key: values.copy() for key, values in found.items()}
        within = scan[model] <= pixels
        if within[0] and not within.all():
            first = int(np.argmin(within))
            between = np.geomspace(durations[first - 1], durations[first], REFINED + 2)[1:-1]
            more = _fly(flown, letter, law, between, (model,))
            scan = {key: np.append(scan[key], values) for key, values in more.items()}
            order = np.argsort(scan["speed"])
            scan = {key: values[order] for key, values in scan.items()}
        within = scan[model] <= pixels
        last = len(within) if within.all() else int(np.argmin(within))
        limit = np.inf if within.all() else (scan["speed"][last - 1] if last else np.nan)
        results["models"][model] = {
            "ds_max_px": float(found[model][0]),
            "limit_m_s": float(limit),
            "speed_m_s": scan["speed"].tolist(),
            "ds_px": scan[model].tolist(),
        }
    results["rms_px"] = float(found["rms"][0])
    results["lost_from_m_s"] = float(
        found["speed"][np.argmax(np.isnan(found["rms"]))]
        if np.isnan(found["rms"]).any()
        else np.inf
    )
    return results


def _fly(
    vehicle: Vehicle, letter: str, law: Any, durations: np.ndarray, models: tuple[str, ...]
) -> dict[str, np.ndarray]:
    """Speeds of the target, RMS error of the coupled plant and |DS| of each model, by duration."""
    scenario = task(vehicle, [letter] * len(durations), law, durations.tolist())
    norms = {}
    for model in ("coupled", *models):
        data = simulate(vehicle, scenario, model=model, sample=2e-2, variables=["feature_error"])
        error = data["feature_error"].transpose("run", "time", "pixel").to_numpy()
        norms[model] = np.linalg.norm(error, axis=2)
    time, pixels = data["time"].to_numpy(), error.shape[2]
    counts = [(time >= TRANSIENT) & (time <= end) for end in durations]
    found = {
        "speed": np.array([_speed(letter, float(end)) for end in durations]),
        "rms": np.array(
            [np.sqrt(np.mean(norms["coupled"][i][at] ** 2) / pixels) for i, at in enumerate(counts)]
        ),
    }
    for model in models:
        ds = np.abs(norms["coupled"] - norms[model])
        found[model] = np.array([ds[i][at].max() for i, at in enumerate(counts)])
    return found


def _speed(letter: str, duration: float) -> float:
    """Largest speed of the letter's centroid [m/s]."""
    velocity = paths.letter(letter, LETTER_HEIGHT, duration)(np.linspace(0.0, duration, 2001))[1]
    return float(np.linalg.norm(velocity, axis=1).max())
