"""Fit of a vehicle to several recordings of its arm at once, by robust least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc

from continuair.errors import InputError, shown
from continuair.identification import robust
from continuair.identification.fields import Fitted, fitted_fields
from continuair.progress import Progress
from continuair.typing import Array
from continuair.vehicle.runs import pick
from continuair.vehicle.vehicle import Vehicle

SCAN = 64
"""Vehicles tried around the start before the least squares."""

SCAN_FACTOR = 4.0
"""Their largest factor from the start."""

_FAR = 1e3
_DIFFERENCE = 1e-4
_MOST = 60
_ROUNDS = 3
_ROUGH, _EXACT = 1e-4, 1e-8
_LEAST_SCALE = 1e-9

# Median of the absolute value of a normal variable, over its standard deviation.
_MEDIAN = 0.6745

# Singular values of the Jacobian, over the largest, below which a combination is undetermined.
_NULL = 1e-6


class Measurement(Protocol):
    """A recording that a vehicle can be fitted to."""

    # Replaces the signature (*args, **kwargs) of a Protocol, which would have to be documented.
    def __init__(self) -> None: ...

    @property
    def name(self) -> str:
        """Return where it comes from, for messages."""
        ...

    @property
    def groups(self) -> int:
        """Return how many independent groups it has, such as releases."""
        ...

    def measured(self, vehicle: Vehicle) -> Array:
        """Return what was measured.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle.

        Returns
        -------
        ndarray, shape (groups, ...)
            Values [m], NaN where nothing was measured.
        """
        ...

    def predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return the function that predicts what was measured.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle.

        Returns
        -------
        callable
            From vehicles like this one to values (runs, groups, ...) [m].
        """
        ...


@runtime_checkable
class FreeStarts(Protocol):
    """A recording whose motions start at a state that is not known exactly."""

    def free_predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return a function as `Measurement.predictor`, with the starts that fit best."""
        ...


def check_recordings(name: str, given: object) -> None:
    """Raise InputError unless an argument is a list of one recording or more."""
    if (
        not isinstance(given, list | tuple)
        or not given
        or not all(hasattr(each, "predictor") for each in given)
    ):
        raise InputError(
            name, f"is {shown(given)}", "give a list of Releases, DrivenMotion or StaticPoses"
        )


@dataclass(frozen=True)
class JointFit:
    """A vehicle fitted to recordings of its arm.

    Parameters
    ----------
    vehicle : Vehicle
        The fitted vehicle; fields of their own have the values of the first recording.
    fields : tuple of str
        Fields of all recordings, then each recording's own ones as "FIELD of RECORDING".
    values, errors : ndarray, shape (fields,)
        Estimates and standard errors in the units of the fields; an error is inf if the recordings
        do not determine the field.
    covariance : ndarray, shape (fields, fields)
        Of the logarithms of the fields, or of places in metres; NaN where undetermined.
    degrees_of_freedom : float
        Of Student's t for the difference from the truth over the standard error.
    rms : dict of str to float
        Root mean square of what is left over of each recording, per coordinate [m].
    free : tuple of dict
        Combinations of fields that the recordings leave free: field to share, of length 1.
    converged : bool
        Whether the least squares converged.
    """

    vehicle: Vehicle
    fields: tuple[str, ...]
    values: Array
    errors: Array
    covariance: Array
    degrees_of_freedom: float
    rms: dict[str, float]
    free: tuple[dict[str, float], ...]
    converged: bool

    @property
    def uncertainty(self) -> dict[str, object]:
        """Return the `[uncertainty]` of a vehicle's file; {} if nothing is known.

        Draws of it are normal, with the variance of Student's t. The model's error is the distance
        of markers, of which `rms` is that of one coordinate. Fields of their own are those of the
        first recording, as in the vehicle.
        """
        names = [name.partition(" of ")[0] for name in self.fields]
        known = [
            index
            for index, name in enumerate(names)
            if name not in names[:index] and np.isfinite(self.covariance[index, index])
        ]
        if not known or not self.degrees_of_freedom > 2.0:
            return {}
        wider = self.degrees_of_freedom / (self.degrees_of_freedom - 2.0)
        return {
            "fields": [names[index] for index in known],
            "covariance": (wider * self.covariance[np.ix_(known, known)]).tolist(),
            "model_error": float(np.sqrt(3.0)) * max(self.rms.values()),
        }


def fit_jointly(
    vehicle: Vehicle,
    measurements: Sequence[Measurement],
    fields: Sequence[str],
    *,
    own: Sequence[str] = (),
    progress: Progress | None = None,
) -> JointFit:
    """Fit fields of a vehicle to several recordings of its arm.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle with initial values.
    measurements : sequence of Measurement
        `Releases`, `DrivenMotion`, `StaticPoses`, or objects with their `name`, `groups`,
        `measured` and `predictor`.
    fields : sequence of str
        Dotted names of the fields that all recordings share.
    own : sequence of str, default ()
        Fields of which each recording has its own value.
    progress : callable, optional
        Called with (done, total, description).

    Returns
    -------
    JointFit
        Estimates with their covariance.

    Raises
    ------
    InputError
        If an argument cannot be used, or no simulated vehicle lasts as long as the recordings.

    Notes
    -----
    Residuals are weighted by their spread in each recording, found from the median, with a loss
    that grows linearly beyond twice the spread. The starts of motions are fitted with the fields:
    at first to the onset of each, then to the whole of it, along the slopes of its motion.

    If neighbours in what is left over, samples or markers, are uncorrelated at a level of 0.5 %,
    the covariance is that of independent residuals. Else releases or poses are taken as independent
    and what is left over within one as arbitrarily dependent: the covariance is that of a jackknife
    that leaves each out in turn, with one degree of freedom less than there are.
    """
    problem = _Problem(vehicle, measurements, tuple(fields), tuple(own), progress)
    row, converged = problem.settle()
    covariance, freedom, free = problem.covariance(row)
    values = problem.values(row)
    with np.errstate(invalid="ignore"):
        errors = np.sqrt(np.diag(covariance)) * problem.slopes(values)
    left = zip(measurements, problem.left(row), strict=True)
    return JointFit(
        vehicle=problem.vehicle(row),
        fields=problem.names,
        values=values,
        errors=np.where(np.isfinite(errors), errors, np.inf),
        covariance=covariance,
        degrees_of_freedom=freedom,
        rms={of.name: float(np.sqrt(np.nanmean(rest**2))) for of, rest in left},
        free=free,
        converged=converged,
    )


class _Problem:
    """Residuals over rows of unknowns: shared fields, then each recording's own ones."""

    def __init__(
        self,
        vehicle: Vehicle,
        measurements: Sequence[Measurement],
        fields: tuple[str, ...],
        own: tuple[str, ...],
        progress: Progress | None,
    ) -> None:
        check_recordings("measurements", measurements)
        names = [each.name for each in measurements]
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise InputError(
                "measurements",
                f"has {shown(twice[0])} twice",
                "give every recording once, under a name of its own",
            )
        self.of: Fitted = fitted_fields(vehicle, [*fields, *own])
        self.shared, self.own = len(fields), len(own)
        self.measured = [each.measured(vehicle) for each in measurements]
        self._measurements = measurements
        self._predict = [each.predictor(vehicle) for each in measurements]
        shared, several = self.of.names[: self.shared], len(measurements) > 1
        self.names = shared + tuple(
            f"{name} of {each.name}" if several else name
            for each in measurements
            for name in self.of.names[self.shared :]
        )
        self._of_fields = list(range(self.shared)) + len(measurements) * list(
            range(self.shared, self.shared + self.own)
        )
        self.scales = [self._first_scale(vehicle)] * len(measurements)
        self._progress, self._calls = progress or (lambda done, total, what: None), 0

    def _first_scale(self, vehicle: Vehicle) -> float:
        """Return a spread of residuals [m] to start with, a tenth of the arm."""
        return 0.1 * float(np.max(vehicle.reach))

    def _rows_of(self, index: int, rows: Array) -> Array:
        """Return the unknowns (runs, fields) of one recording."""
        first = self.shared + index * self.own
        return np.hstack([rows[:, : self.shared], rows[:, first : first + self.own]])

    def left(self, row: Array) -> list[Array]:
        """Return predicted minus measured (groups, ...) [m] of each recording."""
        return [each[0] for each in self._differences(row[None])]

    def _differences(self, rows: Array) -> list[Array]:
        """Return predicted minus measured (runs, groups, n) [m] of each recording.

        What was not measured is 0; what was, but not predicted, is NaN.
        """
        found = []
        for index, measured in enumerate(self.measured):
            vehicles, valid = self.of.vehicle(self._rows_of(index, rows))
            there = np.isfinite(measured)
            each = np.where(there, self._predicted(index, vehicles) - measured, 0.0)
            each[~valid] = np.nan
            found.append(each.reshape(len(rows), len(measured), -1))
        return found

    def _predicted(self, index: int, vehicles: Vehicle) -> Array:
        """Return what vehicles predict of a recording, NaN for one that cannot start.

        Raises InputError if none can start, for instance as all tendons are slack.
        """
        predict, runs = self._predict[index], vehicles.runs or 1
        try:
            return predict(vehicles)
        except InputError as error:
            found = np.full((runs, *self.measured[index].shape), np.nan)
            for run in range(runs):
                with suppress(InputError):
                    found[run] = predict(pick(vehicles, run))[0]
            if np.isnan(found).all():
                raise error from None
            return found

    def residuals(self, rows: Array) -> Array:
        """Return weighted residuals (runs, n), large ones where a vehicle fails."""
        parts = [
            each.reshape(len(rows), -1) / scale
            for each, scale in zip(self._differences(rows), self.scales, strict=True)
        ]
        flat: Array = np.nan_to_num(np.hstack(parts), nan=_FAR, posinf=_FAR, neginf=-_FAR)
        return flat

    def settle(self) -> tuple[Array, bool]:
        """Return the best row of unknowns, and whether the least squares converged."""
        row, converged = self._scan(), False
        for attempt in range(_ROUNDS):
            if attempt:
                self._free_starts(row)
            found = self._solve(row, _ROUGH if attempt < _ROUNDS - 1 else _EXACT)
            row, converged = found.x, bool(found.status > 0)
            rest = self.left(row)
            if not all(np.isfinite(each).all() for each in rest):
                raise InputError(
                    "simulations",
                    "stop before the recordings end",
                    "check units and axes, or start from a closer vehicle",
                )
            self.scales = [self._spread(*each) for each in zip(rest, self.measured, strict=True)]
        return row, converged

    def _free_starts(self, row: Array) -> None:
        """Predict with the starts that fit best, for vehicles close to that of a row."""
        for index, of in enumerate(self._measurements):
            if isinstance(of, FreeStarts):
                values = self.of.values(self._rows_of(index, row[None]))[0]
                self._predict[index] = of.free_predictor(self.of.vehicle_of(values))

    @staticmethod
    def _spread(rest: Array, measured: Array) -> float:
        """Return the spread of what is left over [m], from the median of what was measured."""
        there = np.isfinite(measured).reshape(rest.shape)
        return max(float(np.median(np.abs(rest[there]))) / _MEDIAN, _LEAST_SCALE)

    def _scan(self) -> Array:
        """Return the best of the start and of SCAN vehicles around it."""
        self._progress(0, _MOST, "vehicles around the start")
        unknowns = len(self.names)
        rows = np.zeros((SCAN, unknowns))
        reach = self.of.reach(SCAN_FACTOR)[self._of_fields]
        rows[1:] = (2.0 * qmc.Sobol(unknowns, seed=0).random(SCAN)[1:] - 1.0) * reach
        best: Array = rows[np.argmin(robust.loss(self.residuals(rows)).sum(axis=1))]
        return best

    def _solve(self, row: Array, precision: float) -> Any:
        """Return the least-squares solution from a row, as SciPy does."""

        slopes: dict[bytes, Array] = {}

        def at(unknowns: Array) -> Array:
            self._calls += 1
            self._progress(min(self._calls, _MOST), _MOST, "least squares")
            values, slopes[unknowns.tobytes()] = self.linearised(unknowns)
            return values

        return least_squares(
            at,
            row,
            jac=lambda unknowns: slopes[unknowns.tobytes()],
            x_scale="jac",
            loss="soft_l1",
            f_scale=robust.LINEAR,
            max_nfev=_MOST,
            ftol=precision,
        )

    def linearised(self, row: Array) -> tuple[Array, Array]:
        """Return residuals (n,) and central differences (n, unknowns), simulated as one batch."""
        ahead = _DIFFERENCE * np.eye(len(row))
        found = self.residuals(np.vstack([row, row + ahead, row - ahead]))
        fore, back = np.split(found[1:], 2)
        return found[0], ((fore - back) / (2.0 * _DIFFERENCE)).T

    def values(self, row: Array) -> Array:
        """Return the values (unknowns,) of the fields of a row."""
        parts = [self.of.values(self._rows_of(0, row[None]))[0]]
        for index in range(1, len(self.measured)):
            parts.append(self.of.values(self._rows_of(index, row[None]))[0, self.shared :])
        return np.concatenate(parts)

    def slopes(self, values: Array) -> Array:
        """Return the change of every value per change of its logarithm, 1 for places."""
        return np.where(self.of.linear[self._of_fields], 1.0, values)

    def vehicle(self, row: Array) -> Vehicle:
        """Return the vehicle of a row, with the first recording's own fields."""
        return self.of.vehicle_of(self.of.values(self._rows_of(0, row[None]))[0])

    def covariance(self, row: Array) -> tuple[Array, float, tuple[dict[str, float], ...]]:
        """Return the covariance of the unknowns, its degrees of freedom, and free combinations."""
        r, J = self.linearised(row)
        size = np.linalg.norm(J, axis=0)
        size[size == 0.0] = 1.0
        _, singular, V = np.linalg.svd(J / size, full_matrices=False)
        null = singular < _NULL * singular[0]
        each = zip(self.left(row), self.measured, strict=True)
        independent = all(
            robust.are_independent(rest.reshape(measured.shape), measured)
            for rest, measured in each
        )
        found, freedom = robust.covariance(r, J / size, self._groups(), independent)
        lost = (V[null] ** 2).sum(axis=0) > 1e-4
        found[lost] = found[:, lost] = np.nan
        places = np.where(self.of.linear[self._of_fields], 0.01, 1.0) / size
        free = tuple(self._combination(v / size) for v in V[null])
        return found * np.outer(places, places), freedom, free

    def _groups(self) -> NDArray[np.intp]:
        """Return the group of each residual, numbered through all recordings."""
        parts, first = [], 0
        for measured in self.measured:
            groups = len(measured)
            each = measured.reshape(groups, -1).shape[1]
            parts.append(np.repeat(np.arange(first, first + groups), each))
            first += groups
        return np.concatenate(parts)

    def _combination(self, v: Array) -> dict[str, float]:
        """Return a direction of unknowns by name, of length 1, small parts left out."""
        v = v / np.linalg.norm(v)
        named = zip(self.names, v.tolist(), strict=True)
        return {name: share for name, share in named if abs(share) > 0.1}
