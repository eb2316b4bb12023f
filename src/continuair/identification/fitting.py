"""Least-squares fit of a vehicle's parameters to a recorded flight; every Jacobian is one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Fit:
    """A fitted vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        The fitted vehicle.
    fields : tuple of str
        Dotted names of the fitted fields.
    start, values, errors : ndarray, shape (fields,)
        Initial values, estimates and standard errors, in the units of the fields. An error is inf
        if the data do not determine the field.
    deviations : dict of str to float
        Standard deviations of the residuals: position_m, attitude_rad, bend_per_m.
    condition : float
        Condition number of the Jacobian, initial state included, with columns of norm 1.
    doubts : tuple of str
        Warnings of fields that the data do not determine, and of unresolved motion.
    rows : int
        Rows of the recording.
    converged : bool
        Whether the least squares converged, with steps short enough for the fitted vehicle.
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

    def describe(self) -> dict[str, object]:
        """Return the fit for JSON.

        Returns
        -------
        dict
            Estimates by field, and the other fields; None for numbers that are not finite.
        """
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
    """Fit fields of a vehicle to a recorded flight of the coupled model.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle with initial values.
    recording : Recording
        The flight.
    fields : sequence of str, optional
        Dotted names as in the vehicle's file, parts of lists by name or index
        ("arm.left.section.1.damping_ratio"). Default: every section's stiffness, and its damping if
        it has any.
    test : str, optional
        Letter of the open-loop test that was flown, from its start at rest. Default: the inputs are
        those of the recording, and the initial state is estimated as well.
    progress : callable, optional
        Called with (done, total, description).

    Returns
    -------
    Fit
        Estimates with standard errors and warnings.

    Raises
    ------
    InputError
        If an argument cannot be used, or no simulation lasts as long as the recording.

    Notes
    -----
    Position, attitude and bend are weighted by the standard deviations of their residuals.
    """
    chosen = fitted_fields(vehicle, fields)
    replay = Replay(vehicle, recording, test)
    problem = Problem(chosen, replay, progress or (lambda done, total, what: None))
    where, deviations, converged = problem.settle()
    found, resolved = problem.vehicle(where), replay.resolves(problem.vehicle(where))
    left = problem.left_over(where)
    if not lasts(left):
        raise InputError(
            "simulations",
            "stop before the recording ends",
            "check inputs and units, or start from a closer vehicle",
        ).located(recording.name)
    errors, condition, doubts = confidence(problem, where, deviations, left)
    doubts += (*of_what_is_left(left, recording), *replay.cut_off(found))
    doubts += of_fast_swings(vehicle, found, recording.time)
    if not converged:
        doubts += (
            "the fit has not converged: errors of estimates may exceed their standard errors; "
            "start from closer values, or fit fewer fields.",
        )
    if not resolved:
        doubts += (
            f"the fitted vehicle moves faster than the fit's steps of {replay.step:.2g} s resolve; "
            "start from closer values.",
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
