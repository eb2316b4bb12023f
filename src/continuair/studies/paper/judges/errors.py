"""How far Tests A to D move and turn the decoupled tip from the coupled one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Any

from continuair.analysis.metrics import rotation_metric
from continuair.kernels.dynamics import REFERENCE
from continuair.studies.paper.evidence import Evidence

Errors = dict[str, float]
"""An error by test."""


def errors(evidence: Evidence, key: str = "rmse_t_m") -> Errors:
    """A metric of the decoupled model in Tests A to D, of position [m] by default."""
    tests: dict[str, Any] = evidence.open_loop.results["tests"]
    return {letter: float(entries["decoupled"][key]) for letter, entries in tests.items()}


def rotations(evidence: Evidence) -> tuple[Errors, str]:
    """RMSE of the Euler angles by test [rad], or where samples do not follow them all the angle
    between the tips; and what to say of that."""
    key = _of_rotation(evidence)
    return errors(evidence, key), " (as the angle between the tips)" if key == "angle_rad" else ""


def possible(evidence: Evidence, key: str = "rmse_t_m") -> Iterator[Errors]:
    """Yield all that `errors` may be: where flights have not converged, what any of the steps
    gives, and anything where one of them ends a flight early."""
    ours = errors(evidence, key)
    results = evidence.open_loop.results
    ranges = []
    for letter, entries in results["tests"].items():
        found = {ours[letter]}
        if not all(entries[model]["converged"] for model in (REFERENCE, "decoupled")):
            found |= {level["decoupled"][key] for level in results["coarser_steps"][letter]}
        if not math.isnan(ours[letter]) and any(map(math.isnan, found)):
            found = {ours[letter], 0.0, math.inf}
        ranges.append(found)
    for values in product(*ranges):
        yield dict(zip(ours, values, strict=True))


def possible_rotations(evidence: Evidence) -> Iterator[Errors]:
    """Yield all that `rotations` may be, as `possible`."""
    return possible(evidence, _of_rotation(evidence))


def _of_rotation(evidence: Evidence) -> str:
    tests = evidence.open_loop.results["tests"]
    return rotation_metric(entries["decoupled"] for entries in tests.values())
