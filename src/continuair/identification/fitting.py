"""Least squares of a vehicle's parameters on a recorded flight, every Jacobian one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.errors import InputError
from continuair.identification.aliasing import of_fast_swings
from continuair.identification.confidence import confidence
from continuair.identification.fields import fitted_fields
from continuair.identification.leftover import of_what_is_left
from continuair.identification.problem import GROUPS, Problem, lasts
from continuair.identification.recording import Recording
from continuair.identification.replay import Replay
from continuair.progress import Progress
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


@dataclass(frozen=True)
class Fit:
    """A fitted vehicle.

    fields: what was fitted. values, errors (fields,): estimates and standard errors, in the unit of
    the field; an error is inf where the data determine nothing. deviations: GROUPS -> standard
    deviation of what is left over. condition: of the Jacobian, its columns scaled to norm 1, start
    included; doubts: sentences about what the data cannot determine, or the steps do not follow.
    rows, converged.
    """

    vehicle: Vehicle
    fields: tuple[str, ...]
    start: Array
    values: Array
    errors: Array
    deviations: dict[str, float]
    condition: float
    doubts: tuple[str, ...]
    rows: int
    converged: bool

    def describe(self) -> dict[str, Any]:
        """As JSON can hold it, errors that are not finite as None."""
        rows = zip(self.fields, self.start, self.values, self.errors, strict=True)
        return {
            "study": "identify",
            "estimates": {
                field: {
                    "start": float(start),
                    "value": float(value),
                    "standard_error": float(error) if np.isfinite(error) else None,
                }
                for field, start, value, error in rows
            },
            "deviations": self.deviations,
            "condition": self.condition if np.isfinite(self.condition) else None,
            "doubts": list(self.doubts),
            "rows": self.rows,
            "converged": self.converged,
            "vehicle": self.vehicle.describe(),
        }


def fit(
    vehicle: Vehicle,
    recording: Recording,
    fields: Sequence[str] | None = None,
    *,
    test: str | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Fit fields of a vehicle, by dotted name, to a recorded flight of the coupled model.

    fields: as in its file, parts of lists by name or index ("arm.left.section.1.damping_ratio");
    by default every section's stiffness, and its damping if it has any. test: letter of the
    open-loop test that was flown, from its start at rest; without, the inputs are those of the
    recording and the state at its first row is estimated too. Groups of measurements are weighted
    by what is left over of them. Raises InputError.
    """
    chosen = fitted_fields(vehicle, fields)
    replay = Replay(vehicle, recording, test)
    problem = Problem(chosen, replay, progress or (lambda done, total, what: None))
    where, deviations, converged = problem.settle()
    found, resolved = problem.vehicle(where), replay.resolves(problem.vehicle(where))
    left = problem.left_over(where)
    if not lasts(left):
        raise InputError(
            f"{recording.name}: no flight of the vehicle lasts as long as the recording; check its "
            "inputs and units, or start from a vehicle nearer to it."
        )
    errors, condition, doubts = confidence(problem, where, deviations, left)
    doubts += (*of_what_is_left(left, recording), *replay.cut_off(found))
    doubts += of_fast_swings(vehicle, found, recording.time)
    if not converged:
        doubts += (
            "the fit has not converged, so that its estimates are no best ones and may be off by "
            "more than their standard errors; start nearer, or fit fewer.",
        )
    if not resolved:
        doubts += (
            f"the fitted vehicle moves faster than the fit's steps of {replay.step:.2g} s follow; "
            "start nearer to it.",
        )
    values = problem.values(where)
    return Fit(
        vehicle=found,
        fields=chosen.names,
        start=chosen.start,
        values=values,
        errors=errors * chosen.slopes(values),
        deviations={
            name: deviation
            for name, deviation in zip(GROUPS, deviations.tolist(), strict=True)
            if name != "bend_per_m" or vehicle.arms
        },
        condition=condition,
        doubts=doubts,
        rows=len(recording.time),
        converged=converged and resolved,
    )
