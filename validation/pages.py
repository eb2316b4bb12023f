"""Functions of several validation scripts: fits to static poses, errors, and tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from continuair.identification import StaticPoses
from continuair.identification.joint import Measurement
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "validation" / "results"

_STEP = 1e-4
"""Step of the differences, over the start of an unknown."""

_MISSING = 0.2
"""Residual that stands for a pose without an equilibrium [m]."""


@dataclass(frozen=True)
class Unknown:
    """An unknown of a fit: its start, and its range."""

    name: str
    start: float
    least: float
    most: float


def fitted(
    vehicle_of: Callable[[Array], Vehicle],
    recordings_of: Callable[[Array], Sequence[Measurement]],
    unknowns: Sequence[Unknown],
) -> Array:
    """Return the unknowns (n,) of the least squares of what is left over of recordings.

    vehicle_of: the batch of values (runs, n); recordings_of: the recordings for values (n,).
    """
    start = np.array([each.start for each in unknowns])
    size = np.array([abs(each.start) or 1.0 for each in unknowns])
    low, high = (np.array([getattr(each, end) for each in unknowns]) for end in ("least", "most"))
    inward = np.where(start + _STEP * size < high, 1.0, -1.0)

    def residuals(x: Array) -> Array:
        vehicle, found = vehicle_of(np.atleast_2d(x * size)), []
        for each in recordings_of(x * size):
            measured = each.measured(vehicle)
            off = each.predictor(vehicle)(vehicle)[0] - measured
            found.append(off[np.isfinite(measured)])
        return np.nan_to_num(np.concatenate(found), nan=_MISSING)

    def slopes(x: Array) -> Array:
        own, rows = residuals(x), []
        for index, side in enumerate(inward):
            aside = x.copy()
            aside[index] += side * _STEP
            rows.append((residuals(aside) - own) / (side * _STEP))
        return np.stack(rows, axis=1)

    found = least_squares(
        residuals, start / size, slopes, bounds=(low / size, high / size), xtol=1e-7, ftol=1e-9
    )
    return np.asarray(found.x * size)


def errors(poses: StaticPoses, vehicle: Vehicle) -> Array:
    """Return the distance (poses, markers) of predicted and measured markers [m]."""
    return np.asarray(np.linalg.norm(poses.predict(vehicle)[0] - poses.points, axis=-1))


def rms(values: Array) -> float:
    """Return the root of the mean square; nan where a pose has no equilibrium."""
    return float(np.sqrt(np.mean(np.square(values))))


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def save_results(name: str, results: dict[str, Any]) -> Path:
    """Write results as JSON."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return path
