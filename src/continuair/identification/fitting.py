"""Least-squares fit of a vehicle's parameters to a recorded flight; every Jacobian is one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from continuair.errors import InputError
from continuair.identification.aliasing import of_fast_swings
from continuair.identification.confidence import confidence
from continuair.identification.fields import fitted_fields
from continuair.identification.leftover import of_what_is_left
from continuair.identification.measurements import of_large_biases
from continuair.identification.problem import Problem, lasts
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
    correlation : ndarray, shape (fields, fields)
        Correlation of the estimates, for independent rows; that of an undetermined field has no
        meaning.
    deviations : dict of str to float
        Standard deviations of the residuals of what was measured: position_m, attitude_rad,
        bend_per_m, velocity_m_s, gyro_rad_s, accelerometer_m_s2.
    condition : float
        Condition number of the Jacobian, initial state included, with columns of norm 1.
    doubts : tuple of str
        Warnings of fields that the data do not determine, and of unresolved motion.
    rows : int
        Rows of the recording.
    converged : bool
        Whether the least squares converged, with steps short enough for the fitted vehicle.
    biases : dict of str to list of float
        Constant biases of the sensors along x, y and z of the body, measured minus true:
        gyro_rad_s, accelerometer_m_s2.
    """

    vehicle: Vehicle
    fields: tuple[str, ...]
    start: Array
    values: Array
    errors: Array
    correlation: Array
    deviations: dict[str, float]
    condition: float
    doubts: tuple[str, ...]
    rows: int
    converged: bool
    biases: dict[str, list[float]] = field(default_factory=dict)

    @property
    def uncertainty(self) -> dict[str, object]:
        """Return the `[uncertainty]` of a vehicle's file: fields and covariance; {} if unknown.

        The covariance is that of logarithms, or of places in metres, as in `UncertainVehicle`.
        """
        known = np.flatnonzero(np.isfinite(self.errors))
        if not len(known):
            return {}
        names = [self.fields[index] for index in known]
        linear = fitted_fields(self.vehicle, names).linear
        scale = self.errors[known] / np.where(linear, 1.0, self.values[known])
        covariance = self.correlation[np.ix_(known, known)] * np.outer(scale, scale)
        return {"fields": names, "covariance": covariance.tolist()}

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
            "biases": self.biases,
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
    Every measured quantity is weighted by the standard deviation of its residuals. Constant biases
    of gyro and accelerometer are estimated along with the fields, so their means tell nothing.
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
    errors, correlation, condition, doubts = confidence(problem, where, deviations, left)
    biases = problem.biases(where)
    doubts += (*of_what_is_left(left, recording), *of_large_biases(biases))
    doubts += replay.cut_off(found)
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
        correlation=correlation,
        deviations={
            group.key: deviation
            for group, deviation in zip(replay.measured.groups, deviations.tolist(), strict=True)
        },
        condition=condition,
        doubts=doubts,
        rows=len(recording.time),
        converged=converged and resolved,
        biases=biases,
    )
