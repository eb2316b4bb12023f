"""How much of a difference between models is an error of the integration step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
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
"""Metrics of one run by model against the reference, and what share of them is the step's."""

SAMPLE = 1e-3
"""Time between samples, as the paper's metric sums over them [s]."""

CONVERGED = 0.01
"""Largest step-halving error, as a share of what is concluded from, that counts as converged."""

MAX_HALVINGS = 4
"""Steps tried at most in search of a converged one; the last of 1 ms is 0.125 ms."""

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


def halve(
    fly: Callable[[Any], Flown], settles: Callable[[Sequence[float]], bool]
) -> tuple[Flown, list[list[Entries]]]:
    """Halve the step until every flight has converged or ended early, MAX_HALVINGS times at most.

    fly: flies all models with a step [s] or one per run, None for the automatic one. settles: tells
    of successive step-halving errors whether they can be used, as `settled`. Returns the flights at
    the last step whose error is known, and the entries of all steps from the coarsest, per step and
    run.
    """
    coarse, levels = _at_one_step(fly), list[list[Entries]]()
    while True:
        fine = fly(step_of(coarse[REFERENCE]) / 2)
        levels.append([_entries(*pair) for pair in zip(_runs(coarse), _runs(fine), strict=True)])
        for run, entries in enumerate(levels[-1]):
            for model, entry in entries.items():
                errors = [level[run][model]["step_halving_error"] for level in levels]
                entry["converged"] = entry["status"] == 0 and settles(errors)
        every = [entry for entries in levels[-1] for entry in entries.values()]
        done = all(entry["converged"] or entry["status"] for entry in every)
        if done or len(levels) == MAX_HALVINGS:
            return coarse, levels
        coarse = fine


def _at_one_step(fly: Callable[[Any], Flown]) -> Flown:
    """Flights at the automatic step, all models at the least of theirs: one that is not resolved
    is flown at shorter ones."""
    flown = fly(None)
    steps = np.array([step_of(each) for each in flown.values()])
    least = steps.min(axis=0)
    return flown if (steps == least).all() else fly(least)


def _runs(flown: Flown) -> list[Flown]:
    """The flights of each run by itself."""
    runs = flown[REFERENCE].sizes.get("run")
    if runs is None:
        return [flown]
    return [{model: data.isel(run=run) for model, data in flown.items()} for run in range(runs)]


def _entries(coarse: Flown, fine: Flown) -> Entries:
    """Metrics of every model in one run at the coarse step, and what halving it changes."""
    entries = {}
    for model, data in coarse.items():
        # The entry has its own word for a run that ended early.
        metrics = differences(coarse[REFERENCE], data)
        error_t, error_r = step_errors(model, coarse, fine, metrics)
        entries[model] = metrics | {
            "step_s": float(step_of(data)),
            "step_error": float(data["step_error"]),
            "step_halving_error_t": error_t,
            "step_halving_error_r": error_r,
            "step_halving_error": max(error_t, error_r),
            "status": int(data["status"]),
        }
    return entries


def step_of(dataset: xr.Dataset) -> Any:
    """Return the integration step [s], or one per run: whole within a sample, at most as asked."""
    asked = dataset["step"].to_numpy() if "step" in dataset else dataset.attrs["step"]
    return SAMPLE / np.maximum(np.ceil(SAMPLE / asked * (1 - 1e-12)), 1)


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
        tip = samples(flown[model], "tip_position", "axis")
        return (
            tip if model == REFERENCE else tip - samples(flown[REFERENCE], "tip_position", "axis")
        )

    return float(np.max(np.linalg.norm(path(fine) - path(coarse), axis=-1)))


def _turn(model: str, coarse: Flown, fine: Flown) -> float:
    """Largest geodesic angle between h and h/2, of this model and the reference together [rad]."""
    total = 0.0
    for name in dict.fromkeys((REFERENCE, model)):
        attitudes = [samples(flown[name], "tip_attitude", "quaternion") for flown in (coarse, fine)]
        total += float(np.max(geodesic_angle(*attitudes)))
    return total


def _extent(dataset: xr.Dataset) -> tuple[float, float]:
    """Largest distance of the tip from free fall [m], and from its first attitude [rad]."""
    tip = samples(dataset, "tip_position", "axis")
    time = dataset["time"].to_numpy()
    gravity = float(dataset.attrs["gravity"])
    falling = tip[0] - 0.5 * gravity * time[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    attitude = samples(dataset, "tip_attitude", "quaternion")
    turned = geodesic_angle(attitude, attitude[:1])
    return float(np.max(np.linalg.norm(tip - falling, axis=-1))), float(np.max(turned))


def _share(change: float, scale: float) -> float:
    """Change over scale; a run that holds numbers that are not finite has an infinite error."""
    if change == 0:
        return 0.0
    share = change / scale if scale else np.inf
    return float(share) if np.isfinite(share) else float(np.inf)
