"""The readings of Table I: choices that need flights of their own, and those of the metric."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, get_args

import numpy as np

from amiri2026.table.metrics import Tips, error, euler_angles, geodesic
from amiri2026.table.reading import Angles, Axes, Damping, Decoupled, Kappa, Reading

Array = np.ndarray

DECOUPLED: tuple[str, ...] = get_args(Decoupled)
FORCE_SIGNS = (-1, 1)

OTHERS: Mapping[str, Sequence[Any]] = {
    "remark1": (True, False),
    "kappa": get_args(Kappa),
    "damping": get_args(Damping),
    "rotary_inertia": (False, True),
}
"""Choices of the flights beside `decoupled` and `force_sign`; the first is that of Table I."""

_NORMS = (
    ("per axis", "coupled"),
    ("per axis", "joint"),
    ("pooled", "coupled"),
    ("pooled", "joint"),
    # Nothing is divided by a range.
    ("rmse", "coupled"),
)
_AXES, _ANGLES = get_args(Axes), get_args(Angles)

METRICS: tuple[Mapping[str, Any], ...] = tuple(
    {"metric": metric, "range": span, "axes": axes, "angles": angles}
    for (metric, span), axes, angles in product(_NORMS, _AXES, _ANGLES)
)
"""Choices of the metric, which need no flights."""

READINGS = len(DECOUPLED) * len(FORCE_SIGNS) * len(METRICS)
READINGS *= int(np.prod([len(choices) for choices in OTHERS.values()]))
"""How many readings there are."""


def others_drawn(rng: np.random.Generator) -> Reading:
    """Return a reading whose choices in OTHERS are drawn uniformly."""
    picked = {name: choices[int(rng.integers(len(choices)))] for name, choices in OTHERS.items()}
    return Reading(**picked)


def numbers(coupled: Tips, other: Tips) -> Array:
    """Return errors (metrics, 2) of translation and rotation of one test, in the order of METRICS.

    They equal `table_errors` under each reading; what readings share is computed once.
    """
    angle = geodesic(coupled, other)
    pairs = {
        name: (euler_angles(coupled, name), euler_angles(other, name))
        for name in _ANGLES
        if name != "geodesic"
    }
    moved, turned = {}, {}
    for metric, span in _NORMS:
        for axes in _AXES:
            columns = ["xyz".index(name) for name in axes]
            first, second = coupled.position[:, columns], other.position[:, columns]
            moved[metric, span, axes] = error(first, second, metric, span)
        for name, pair in pairs.items():
            turned[metric, span, name] = error(*pair, metric, span)
        turned[metric, span, "geodesic"] = angle
    return np.array(
        [
            (
                moved[m["metric"], m["range"], m["axes"]],
                turned[m["metric"], m["range"], m["angles"]],
            )
            for m in METRICS
        ]
    )
