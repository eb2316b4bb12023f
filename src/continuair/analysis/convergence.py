"""How much of a difference between models is an error of the integration."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair import checks
from continuair.analysis.metrics import differences, geodesic_angle, samples
from continuair.kernels.dynamics import MODELS, REFERENCE

Array = NDArray[np.float64]
Flown = dict[str, xr.Dataset]
"""Trajectories of one scenario by model; the reference is among them."""

Entries = dict[str, dict[str, Any]]
"""Metrics of one run by model against the reference, and what share of them is an error."""

SAMPLE = 1e-3
"""Time between samples, as the paper's metric sums over them [s]."""

RTOL = 1e-6
"""Tolerance of flights that are compared. 1e-4 leaves 7e-3 arm lengths in Test C, whose arm passes
straight; this leaves 1e-7."""

CONVERGED = 0.01
"""Largest relative error that counts as converged."""


def compared_models(models: Iterable[str]) -> list[str]:
    """Return models and the reference in the order of MODELS, or raise InputError."""
    given = [models] if isinstance(models, str) else models
    chosen = checks.choices("model", [REFERENCE, *given], MODELS)
    return [model for model in MODELS if model in chosen]


def entries_of(flown: Flown, reach: float) -> Entries:
    """Metrics of every model in one run, with its error estimate and what share of them that is.

    reach: length of the arm [m].
    """
    entries = {}
    for model, data in flown.items():
        # The entry has its own word for a run that ended early.
        metrics = differences(flown[REFERENCE], data)
        error, status = _relative_error(model, flown, metrics, reach), int(data["status"])
        entries[model] = metrics | {
            "error_estimate": float(data["error_estimate"]),
            "relative_error": error,
            "status": status,
            "converged": status == 0 and error <= CONVERGED,
        }
    return entries


def _relative_error(model: str, flown: Flown, metrics: dict[str, Any], reach: float) -> float:
    """Errors of this model and the reference, as a share of their difference in position or in
    attitude, of which an arm length counts as 1 rad.

    metrics: of the model against the reference. That of the reference itself is a share of the
    largest distance of its tip from free fall and from its first attitude.
    """
    error = sum(float(flown[name]["error_estimate"]) for name in {REFERENCE, model})
    moved, turned = metrics["rmse_t_m"], metrics["angle_rad"]
    if model == REFERENCE:
        moved, turned = _extent(flown[model])
    return max(_share(error, moved / reach), _share(error, turned))


def _extent(dataset: xr.Dataset) -> tuple[float, float]:
    """Largest distance of the tip from free fall [m], and from its first attitude [rad]."""
    tip = samples(dataset, "tip_position", "axis")
    time = dataset["time"].to_numpy()
    gravity = float(dataset.attrs["gravity"])
    falling = tip[0] - 0.5 * gravity * time[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    attitude = samples(dataset, "tip_attitude", "quaternion")
    turned = geodesic_angle(attitude, attitude[:1])
    return float(np.max(np.linalg.norm(tip - falling, axis=-1))), float(np.max(turned))


def _share(error: float, scale: float) -> float:
    """Error over scale; a run that holds numbers that are not finite has an infinite error."""
    if error == 0:
        return 0.0
    share = error / scale if scale else np.inf
    return float(share) if np.isfinite(share) else float(np.inf)
