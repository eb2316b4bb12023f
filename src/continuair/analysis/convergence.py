"""How much of a difference between models is an error of the integration step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair import checks
from continuair.analysis.metrics import geodesic_angle
from continuair.flight.simulate import MODELS

Array = NDArray[np.float64]
Flown = dict[str, xr.Dataset]
"""Trajectories of one scenario by model; the reference is among them."""

REFERENCE = "coupled"
"""The model that the others are compared with."""

SAMPLE = 1e-3
"""Time between samples, as the paper's metric sums over them [s]."""

CONVERGED = 0.01
"""Largest step-halving error, as a share of what is concluded from, that counts as converged."""

FALL = 2.0
"""Least ratio of successive step-halving errors that shows convergence; RK4 alone has 16."""


def compared_models(models: Iterable[str]) -> list[str]:
    """Return models and the reference in the order of MODELS, or raise InputError."""
    given = [models] if isinstance(models, str) else models
    chosen = checks.choices("model", [REFERENCE, *given], MODELS)
    return [model for model in MODELS if model in chosen]


def settled(errors: Sequence[float], singular: bool) -> bool:
    """Tell whether the last of the step-halving errors, each at half the step before, can be used.

    The first is believed if it is small and nothing singular acts. Later ones must be small twice
    in a row and fall: near a singularity a change may be small by chance, and grow again.
    """
    if errors[-1] > CONVERGED:
        return False
    if len(errors) == 1:
        return not singular
    return errors[-2] <= CONVERGED and errors[-1] <= errors[-2] / FALL


def step_of(dataset: xr.Dataset) -> float:
    """Return the integration step [s]: at most the one asked for, and whole within a sample."""
    pieces = np.ceil(SAMPLE / float(dataset.attrs["step"]) * (1 - 1e-12))
    return float(SAMPLE / max(pieces, 1))


def step_errors(
    model: str, coarse: Flown, fine: Flown, metrics: dict[str, Any]
) -> tuple[float, float]:
    """Return what halving the step changes, as a share, for tip position and tip attitude.

    coarse, fine: flights with steps h and h/2. metrics: of the model at h against the reference.
    For a simpler model: the largest change of its tip's difference from the reference, over the
    RMS of that difference. For the reference: the largest change of its tip, over the largest
    distance of the tip from free fall (position) or from its start (attitude).
    """
    scales = (metrics["rmse_t_m"], metrics["angle_rad"])
    if model == REFERENCE:
        scales = _extent(coarse[model])
    changes = (_shift(model, coarse, fine), _turn(model, coarse, fine))
    error_t, error_r = (_share(c, s) for c, s in zip(changes, scales, strict=True))
    return error_t, error_r


def _shift(model: str, coarse: Flown, fine: Flown) -> float:
    """Largest change of the tip's path, or of its difference from the reference [m]."""

    def path(flown: Flown) -> Array:
        tip = _values(flown[model], "tip_position", "axis")
        return (
            tip if model == REFERENCE else tip - _values(flown[REFERENCE], "tip_position", "axis")
        )

    return float(np.max(np.linalg.norm(path(fine) - path(coarse), axis=-1)))


def _turn(model: str, coarse: Flown, fine: Flown) -> float:
    """Largest geodesic angle between h and h/2, of this model and the reference together [rad]."""
    total = 0.0
    for name in dict.fromkeys((REFERENCE, model)):
        attitudes = [_values(flown[name], "tip_attitude", "quaternion") for flown in (coarse, fine)]
        total += float(np.max(geodesic_angle(*attitudes)))
    return total


def _extent(dataset: xr.Dataset) -> tuple[float, float]:
    """Largest distance of the tip from free fall [m], and from its first attitude [rad]."""
    tip = _values(dataset, "tip_position", "axis")
    time = dataset["time"].to_numpy()
    gravity = float(dataset.attrs["gravity"])
    falling = tip[0] - 0.5 * gravity * time[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    attitude = _values(dataset, "tip_attitude", "quaternion")
    turned = geodesic_angle(attitude, attitude[:1])
    return float(np.max(np.linalg.norm(tip - falling, axis=-1))), float(np.max(turned))


def _values(dataset: xr.Dataset, name: str, component: str) -> Array:
    values: Array = dataset[name].transpose("time", component).to_numpy()
    return values


def _share(change: float, scale: float) -> float:
    """Change over scale; a run that holds numbers that are not finite has an infinite error."""
    if change == 0:
        return 0.0
    share = change / scale if scale else np.inf
    return float(share) if np.isfinite(share) else float(np.inf)
