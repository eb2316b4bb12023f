"""Least squares of a vehicle's parameters on a recorded flight, every Jacobian one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import qmc

from continuair.identification.fields import Fitted, fitted_fields
from continuair.identification.recording import Recording
from continuair.identification.replay import Replay
from continuair.progress import Progress
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

GROUPS = ("position_m", "attitude_rad", "bend_per_m")
"""What is measured, in groups of one unit; each has one standard deviation."""

_OF_GROUP = (slice(0, 3), slice(3, 6), slice(6, None))

SCAN = 64
"""Vehicles tried before the least squares, which may otherwise settle a cycle off."""

SCAN_FACTOR = 2.0
"""They are within this factor of the start."""

_DIFFERENCE = 1e-4
_LEAST_DEVIATION = 1e-10
_FAR = 1e4
_MOST = 60
_MOST_REFINED = 4


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
    problem = _Problem(chosen, replay, progress or (lambda done, total, what: None))
    where, deviations, converged = problem.settle()
    found, resolved = problem.vehicle(where), replay.resolves(problem.vehicle(where))
    errors, condition, doubts = _confidence(problem, where, deviations)
    doubts += (*_of_what_is_left(problem, where, recording), *replay.cut_off(found))
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
        deviations=dict(zip(GROUPS, deviations.tolist(), strict=True)),
        condition=condition,
        doubts=doubts,
        rows=len(recording.time),
        converged=converged and resolved,
    )


class _Problem:
    """Residuals over the unknowns: fields on their scales, then the start unless it is given."""

    def __init__(self, chosen: Fitted, replay: Replay, tell: Progress) -> None:
        self.chosen, self.replay, self._tell = chosen, replay, tell
        self.fields = len(chosen.names)
        self.unknowns = self.fields + len(replay.first)
        self.measured = replay.layout.coordinates
        self._calls = 0

    def residuals(self, rows: Array, deviations: Array) -> Array:
        """Weighted residuals (runs, samples * measured) of rows of unknowns (runs, unknowns)."""
        vehicle, valid = self.chosen.vehicle(rows[:, : self.fields])
        moved = None if self.replay.test else self.replay.first + rows[:, self.fields :]
        found = self.replay.residuals(vehicle, moved, len(rows))
        found[~valid] = np.nan
        for group, deviation in zip(_OF_GROUP, deviations, strict=True):
            found[..., group] /= deviation
        flat: Array = np.nan_to_num(found.reshape(len(rows), -1), nan=_FAR, posinf=_FAR)
        return flat

    def scan(self) -> Array:
        """The best of the start and of SCAN vehicles around it, the flight starting as measured."""
        self._tell(0, _MOST, "flights around the start")
        rows = np.zeros((SCAN, self.unknowns))
        spread = 2.0 * qmc.Sobol(self.fields, seed=0).random(SCAN) - 1.0
        rows[1:, : self.fields] = spread[1:] * self.chosen.reach(SCAN_FACTOR)
        cost = (self.residuals(rows, np.array([0.1, 0.1, 0.1])) ** 2).sum(1)
        best: Array = rows[np.argmin(cost)]
        return best

    def values(self, row: Array) -> Array:
        """Values of the fields (fields,) of a row of unknowns."""
        return self.chosen.values(row[None, : self.fields])[0]

    def vehicle(self, row: Array) -> Vehicle:
        """The plain vehicle of a row of unknowns."""
        return self.chosen.vehicle_of(self.values(row))

    def settle(self) -> tuple[Array, Array, bool]:
        """The best row, the deviations that are left, and whether it converged.

        Its vehicle may move faster than the one whose steps were taken: then on with its own steps.
        """
        length = float(self.chosen.of.reach)
        found = self._best_near(self.scan(), np.array([0.01, 0.01, 0.01 / length]))
        for _ in range(_MOST_REFINED):
            if not self.replay.refine(self.vehicle(found[0])):
                break
            found = self._best_near(*found[:2])
        return found

    def _best_near(self, where: Array, deviations: Array) -> tuple[Array, Array, bool]:
        for _ in range(2):
            solution = self.solve(where, deviations)
            where = solution.x
            left = self.residuals(where[None], np.ones(3))[0].reshape(-1, self.measured)
            deviations = _deviations(left, len(where))
        return where, deviations, bool(solution.status > 0)

    def solve(self, start: Array, deviations: Array) -> Any:
        def at(row: Array) -> Array:
            self._calls += 1
            self._tell(min(self._calls, _MOST), _MOST, "least squares")
            values: Array = self.residuals(row[None], deviations)[0]
            return values

        return least_squares(
            at,
            start,
            jac=lambda row: self.jacobian(row, deviations),
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-13,
            gtol=1e-14,
            max_nfev=_MOST,
        )

    def jacobian(self, row: Array, deviations: Array) -> Array:
        """Differences (residuals, unknowns), flown as one batch: central, or to the one side where
        the other holds no vehicle."""
        fore, back, at = self._around(row, deviations)
        ahead, behind = (~_failed(rows) for rows in (fore, back))
        fore, back = np.where(ahead[:, None], fore, at), np.where(behind[:, None], back, at)
        widths = _DIFFERENCE * np.maximum(ahead.astype(float) + behind, 1.0)
        slopes: Array = ((fore - back) / widths[:, None]).T
        return slopes

    def at_edge(self, row: Array) -> Array:
        """Which unknowns (unknowns,) have a neighbour that is no vehicle, or does not fly."""
        fore, back, _ = self._around(row, np.ones(len(GROUPS)))
        return _failed(fore) | _failed(back)

    def _around(self, row: Array, deviations: Array) -> tuple[Array, Array, Array]:
        """Residuals with each unknown a little larger, a little smaller, and as it is."""
        ahead = _DIFFERENCE * np.eye(len(row))
        rows = self.residuals(np.vstack([row + ahead, row - ahead, row]), deviations)
        return rows[: len(row)], rows[len(row) : -1], rows[-1]


def _failed(rows: Array) -> Array:
    """Which rows of residuals are of what did not fly at all."""
    return np.asarray((rows == _FAR).all(axis=1))


def _deviations(left: Array, unknowns: int) -> Array:
    """Standard deviation of every group of residuals (samples, measured)."""
    freedom = max(1.0 - unknowns / left.size, 1e-3)
    found = [np.sqrt(np.mean(left[:, group] ** 2) / freedom) for group in _OF_GROUP]
    return np.maximum(found, _LEAST_DEVIATION)


NULL = 1e-6
"""Singular values below this share of the largest count as 0: differences do not resolve them."""

SILENT = 1e-8
"""A field that moves no measurement by this [m, rad, 1/m] per factor e has no effect."""

_EXPLAINED = 0.01
"""Share of the recorded motion that may be left over without a word, as models are never all true.
"""

_SMOOTH = 0.5
"""Mean square of steps from row to row over that of what is left: 2 of noise, less is no noise."""

VAGUE = 0.3
"""A standard error above this share of a value is warned about."""


def _confidence(
    problem: _Problem, where: Array, deviations: Array
) -> tuple[Array, float, tuple[str, ...]]:
    """Standard errors (fields,) on the fields' scales, condition, and what is in doubt."""
    J, edge = problem.jacobian(where, np.ones(len(GROUPS))), problem.at_edge(where)
    silent = np.abs(J).max(0) < SILENT
    scale = np.repeat(deviations, [3, 3, problem.measured - 6])
    J = J / np.tile(scale, len(J) // problem.measured)[:, None]
    size = np.linalg.norm(J, axis=0)
    J = J / np.where(silent, 1.0, size)
    _, singular, V = np.linalg.svd(J, full_matrices=False)
    null = singular < NULL * singular[0]
    variance = np.sum(np.where(null[:, None], 0.0, V / singular[:, None].clip(1e-300)) ** 2, 0)
    lost = silent | (np.sum(V[null] ** 2, 0) > 1e-4)
    errors = np.where(lost, np.inf, np.sqrt(variance) / np.where(silent, 1.0, size))
    names, count = problem.chosen.names, problem.fields
    doubts = [
        f"the flight does not depend on {name} near the fit; leave it out of --fit."
        for name in np.array(names)[silent[:count]]
    ]
    doubts += [
        f"{name} lies at the edge of what a vehicle can have, or can fly with, which may have held "
        "it there: read it and its standard error with care, or leave it out of --fit."
        for name in np.array(names)[edge[:count]]
    ]
    mixed = [name for name, gone, quiet in zip(names, lost, silent, strict=False)
             if gone and not quiet]  # fmt: skip
    if mixed:
        doubts.append(
            f"the data cannot tell {' and '.join(mixed)} apart: another combination of them flies "
            "the same; fit fewer of them and measure the others."
        )
    shares = errors[:count] * problem.chosen.relative(where[:count])
    for name, share in zip(names, shares, strict=True):
        if VAGUE < share < np.inf:
            doubts.append(
                f"the data hardly determine {name}: its standard error is {_percent(share)} of it; "
                "leave it out of --fit, or record a flight that excites it."
            )
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    return errors[:count], np.inf if silent.any() else condition, tuple(doubts)


def _of_what_is_left(problem: _Problem, where: Array, recording: Recording) -> tuple[str, ...]:
    """A sentence where a part of the recorded motion is left over and goes on smoothly."""
    left = problem.residuals(where[None], np.ones(len(GROUPS)))[0].reshape(-1, problem.measured)
    turns = Rotation.from_quat(recording.attitude)
    parts = {
        "position": (left[:, :3], recording.position),
        "attitude": (left[:, 3:6], (turns.mean().inv() * turns).as_rotvec()),
        "bends": (left[:, 6:], recording.bend),
    }
    doubts = []
    for name, (rest, measured) in parts.items():
        size, moved = np.sqrt(np.mean(rest**2)), np.sqrt(np.mean(measured.var(axis=0)))
        # Of noise, from row to row anew, this is 2.
        smooth = np.mean(np.diff(rest, axis=0) ** 2) < _SMOOTH * size**2
        if smooth and size > _EXPLAINED * moved:
            doubts.append(
                f"the fitted flight misses {_percent(size / moved)} of the recorded motion of the "
                f"{name}, and not by noise, which standard errors take it for: look for inputs "
                "that are missing, another test, or fields that should be fitted too."
            )
    return tuple(doubts)


def _percent(share: float) -> str:
    return f"{share:.0%}" if share < 10.0 else "more than 1000%"
