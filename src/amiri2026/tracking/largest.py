"""The largest errors of a flight after its start, as tables and figures of tracking give them.

Each function names its norm and its window. A flight that ended early has NaN, as its largest error
is not known.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis import TRANSIENT, feature_norm, norm_difference, samples

Array = NDArray[np.float64]


def largest_since(flight: xr.Dataset, values: Array, since: float) -> float:
    """Return the largest of values (time,) from `since` [s] on, NaN if one of them is NaN."""
    late = values[flight["time"].to_numpy() >= since]
    return float(late.max()) if late.size else float("nan")


def largest_norm(flight: xr.Dataset, since: float) -> float:
    """Return the largest ‖e‖ from `since` [s] on [px], the norm over all feature points."""
    return largest_since(flight, feature_norm(flight), since)


def largest_coordinate(flight: xr.Dataset, since: float) -> float:
    """Return the largest error of one coordinate of one point from `since` [s] on [px]."""
    error = np.abs(samples(flight, "feature_error", "pixel")).max(axis=-1)
    return largest_since(flight, error, since)


def largest_of_a_point(flight: xr.Dataset, since: float) -> float:
    """Return the largest distance of one point from its place from `since` [s] on [px]."""
    error = samples(flight, "feature_error", "pixel")
    points = error.reshape(*error.shape[:-1], -1, 2)
    return largest_since(flight, np.linalg.norm(points, axis=-1).max(axis=-1), since)


def off_target(flight: xr.Dataset) -> Array:
    """Return the camera's horizontal distance from above the target's centroid (time,) [m]."""
    camera, target = (samples(flight, f"{of}_position", "axis") for of in ("camera", "target"))
    distance: Array = np.linalg.norm((camera - target)[:, :2], axis=1)
    return distance


def largest_off_target(flight: xr.Dataset, since: float) -> float:
    """Return the largest horizontal distance from the target from `since` [s] on [m]."""
    return largest_since(flight, off_target(flight), since)


def largest_servo_error(flight: xr.Dataset, since: float) -> float:
    """Return the largest ‖e_a‖ from `since` [s] on, without unit."""
    return largest_since(flight, flight["servo_error"].to_numpy(), since)


def in_transient(flight: xr.Dataset) -> NDArray[np.bool_]:
    """Return which samples (time,) are of the transient, before TRANSIENT."""
    early: NDArray[np.bool_] = flight["time"].to_numpy() < TRANSIENT
    return early


def ds_extremes(coupled: xr.Dataset, other: xr.Dataset) -> tuple[float, float]:
    """Return the largest |DS| before TRANSIENT, and from it on [px]."""
    size = np.abs(norm_difference(coupled, other))
    early = in_transient(coupled)
    return float(size[early].max()), float(size[~early].max())
