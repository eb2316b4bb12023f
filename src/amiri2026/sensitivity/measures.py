"""Measures of flights for the paper's prose on sensitivity.

Flights are batches: Datasets over (run, time).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair import Vehicle
from continuair.analysis import SAMPLE, centre_of_mass, mass_distribution, samples

Array = NDArray[np.float64]

VARIABLES = ("position", "attitude", "bend", "tip_position", "tip_attitude")
"""Variables that the measures need."""

MEASURES = {
    "displacement_m": "largest horizontal distance of the tip from its start",
    "oscillation_m": "RMS horizontal distance of the tip from the centre of mass",
    "largest_bend_1_m": "largest bend",
    "com_travel_m": "how far the centre of mass moves in body axes",
    "inertia_change": "largest change of the inertia about the centre of mass, as a share of it",
}
"""Measures of a flight of the coupled model, by name."""


def measures(vehicle: Vehicle, flown: xr.Dataset) -> dict[str, Array]:
    """Return the measures of every run, each (runs,). vehicle: plain, or batched alike."""
    tip = samples(flown, "tip_position", "axis")
    com, inertia = mass_distribution(vehicle, samples(flown, "bend", "bend_axis"))
    swing = (tip - centre_of_mass(flown, com))[..., :2]
    moved = (tip - tip[:, :1])[..., :2]
    bend = np.linalg.norm(samples(flown, "bend", "bend_axis"), axis=-1)
    changed = np.linalg.norm(inertia - inertia[:, :1], axis=(-2, -1))
    return {
        "displacement_m": np.linalg.norm(moved, axis=-1).max(-1),
        "oscillation_m": np.sqrt(np.mean(np.sum(swing**2, axis=-1), axis=-1)),
        "largest_bend_1_m": bend.max(-1),
        "com_travel_m": np.linalg.norm(com - com[:, :1], axis=-1).max(-1),
        "inertia_change": changed.max(-1) / np.linalg.norm(inertia[:, 0], axis=(-2, -1)),
    }


def apart(coupled: xr.Dataset, other: xr.Dataset) -> Array:
    """Return the distance of the tips in xy, the plane of the paper's figure, (runs, time) [m]."""
    tips = [samples(flown, "tip_position", "axis")[..., :2] for flown in (coupled, other)]
    distance: Array = np.linalg.norm(tips[0] - tips[1], axis=-1)
    return distance


def range_of(flown: xr.Dataset) -> float:
    """Return how far the tip of a single run moves along x and y, as one length [m]."""
    tip = samples(flown, "tip_position", "axis")[0, :, :2]
    return float(np.linalg.norm(np.ptp(tip, axis=0)))


def rms(distance: Array) -> float:
    """Return the root mean square over samples (time,)."""
    return float(np.sqrt(np.mean(distance**2)))


def by_second(distance: Array) -> list[float]:
    """Return the root mean square within each second of samples (time,), SAMPLE apart."""
    per_second = round(1 / SAMPLE)
    return [
        rms(distance[first : first + per_second + 1])
        for first in range(0, len(distance) - 1, per_second)
    ]
