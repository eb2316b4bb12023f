"""Integration error in the differences between models."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.metrics import differences, geodesic_angle, samples
from continuair.kernels.dynamics import MODELS, REFERENCE
from continuair.typing import Model

Flown = dict[str, xr.Dataset]
"""Trajectories of one scenario by model, the reference among them."""

Entries = dict[str, dict[str, Any]]
"""Metrics of one run by model against the reference, with the relative integration error."""

SAMPLE = 1e-3
"""Time between samples, as the paper's metric sums over them [s]."""

RTOL = 1e-6
"""Tolerance of flights that are compared. In Test C, whose arm passes through straight, 1e-4 leaves
an error of 7e-3 arm lengths, and 1e-6 one of 1e-7."""

CONVERGED = 0.01
"""Largest relative error that counts as converged."""


def compared_models(models: Iterable[str]) -> list[Model]:
    """Return models and the reference, in the order of `MODELS`.

    Parameters
    ----------
    models : iterable of str, or str
        Names of models.

    Returns
    -------
    list of str
        The models and the reference, once each.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    given = [models] if isinstance(models, str) else models
    chosen = checks.choices("model", [REFERENCE, *given], MODELS)
    return [model for model in MODELS if model in chosen]


def entries_of(flown: Flown, reach: float) -> Entries:
    """Return the metrics of every model in one run, with their integration error.

    Parameters
    ----------
    flown : dict of str to xarray.Dataset
        Trajectories by model, the reference among them, simulated with ``check=True``.
    reach : float
        Length of the arm [m].

    Returns
    -------
    dict
        By model: the metrics of `compare`, `error_estimate` in arm lengths, `relative_error` (that
        error over the difference from the reference), `status`, and `converged`.
    """
    entries = {}
    for model, data in flown.items():
        # `status` of the entry reports a run that stopped early.
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
    """Return the integration error of a model and the reference over their difference.

    The difference is that in position or attitude, where an arm length counts as 1 rad; metrics: of
    the model against the reference. For the reference itself, the largest distances of its tip from
    free fall and from its first attitude are used.
    """
    error = sum(float(flown[name]["error_estimate"]) for name in {REFERENCE, model})
    moved, turned = metrics["rmse_t_m"], metrics["angle_rad"]
    if model == REFERENCE:
        moved, turned = _extent(flown[model])
    return max(_share(error, moved / reach), _share(error, turned))


def _extent(dataset: xr.Dataset) -> tuple[float, float]:
    """Return the largest distances of the tip from free fall [m] and its first attitude [rad]."""
    tip = samples(dataset, "tip_position", "axis")
    time = dataset["time"].to_numpy()
    gravity = float(dataset.attrs["gravity"])
    falling = tip[0] - 0.5 * gravity * time[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    attitude = samples(dataset, "tip_attitude", "quaternion")
    turned = geodesic_angle(attitude, attitude[:1])
    return float(np.max(np.linalg.norm(tip - falling, axis=-1))), float(np.max(turned))


def _share(error: float, scale: float) -> float:
    """Return error over scale; infinite for a run whose numbers are not finite."""
    if error == 0:
        return 0.0
    share = error / scale if scale else np.inf
    return float(share) if np.isfinite(share) else float(np.inf)
