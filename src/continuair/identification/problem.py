"""Residuals of a fit to a recorded flight as functions of its unknowns, and their least squares."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc

from continuair.identification.fields import Fitted
from continuair.identification.replay import Replay
from continuair.progress import Progress
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

SILENT = 1e-8
"""Change of measurements [their units] per unit of an unknown below which it has no effect."""

SCAN = 64
"""Vehicles tried before the least squares, which could otherwise converge a whole period off."""

SCAN_FACTOR = 2.0
"""Their largest factor from the start."""

_DIFFERENCE = 1e-4
_FINE = 3e-5
_LEAST_DEVIATION = 1e-10
_FAR = 1e4
_MOST = 60
_MOST_REFINED = 4


class Problem:
    """Residuals over the unknowns: scaled fields, then the initial state unless it is given."""

    def __init__(self, chosen: Fitted, replay: Replay, progress: Progress) -> None:
        self.chosen, self.replay, self._progress = chosen, replay, progress
        self.fields = len(chosen.names)
        self.unknowns = self.fields + len(replay.first)
        self.measured = replay.measured
        self._calls = 0

    def residuals(self, rows: Array, deviations: Array) -> Array:
        """Return weighted residuals (runs, samples * width) of unknowns (runs, unknowns)."""
        vehicle, valid = self.chosen.vehicle(rows[:, : self.fields])
        found = self.replay.residuals(vehicle, self._starts(rows), len(rows))
        found[~valid] = np.nan
        found /= self.measured.of_columns(deviations)
        flat: Array = np.nan_to_num(found.reshape(len(rows), -1), nan=_FAR, posinf=_FAR)
        return flat

    def _starts(self, rows: Array) -> Array | None:
        """Return the initial states (runs, states) of rows of unknowns; None: that of the test."""
        return None if self.replay.test else self.replay.first + rows[:, self.fields :]

    @property
    def plain(self) -> Array:
        """Deviations (groups,) of residuals in their own units."""
        return np.ones(len(self.measured.groups))

    def left_over(self, row: Array) -> Array:
        """Return simulated minus measured values (samples, width), less biases, of a row of
        unknowns."""
        plain = self.residuals(row[None], self.plain)[0]
        return plain.reshape(-1, self.measured.width)

    def biases(self, row: Array) -> dict[str, list[float]]:
        """Return the biases of the sensors for a row of unknowns."""
        if not self.measured.biases:
            return {}
        vehicle, _ = self.chosen.vehicle(row[None, : self.fields])
        found = self.replay.differences(vehicle, self._starts(row[None]), 1)[0]
        return self.measured.biases_of(found)

    @property
    def estimated(self) -> int:
        """Number of all estimates: fields, initial state and biases."""
        return self.unknowns + self.measured.biases

    def scan(self) -> Array:
        """Return the best of the start and of SCAN vehicles around it, from the measured initial
        state."""
        self._progress(0, _MOST, "flights around the start")
        rows = np.zeros((SCAN, self.unknowns))
        spread = 2.0 * qmc.Sobol(self.fields, seed=0).random(SCAN) - 1.0
        rows[1:, : self.fields] = spread[1:] * self.chosen.reach(SCAN_FACTOR)
        cost = (self.residuals(rows, self.measured.scan()) ** 2).sum(1)
        best: Array = rows[np.argmin(cost)]
        return best

    def values(self, row: Array) -> Array:
        """Return the values of the fields (fields,) of a row of unknowns."""
        return self.chosen.values(row[None, : self.fields])[0]

    def vehicle(self, row: Array) -> Vehicle:
        """Return the single vehicle of a row of unknowns."""
        return self.chosen.vehicle_of(self.values(row))

    def settle(self) -> tuple[Array, Array, bool]:
        """Return the best row, the deviations of its residuals, and whether it converged.

        If its vehicle needs shorter steps than the first one, the fit continues with these.
        """
        first = self.measured.first(float(self.chosen.of.reach))
        found = self._best_near(self.scan(), first)
        for _ in range(_MOST_REFINED):
            if not self.replay.refine(self.vehicle(found[0])):
                break
            found = self._best_near(*found[:2])
        return found

    def _best_near(self, where: Array, deviations: Array) -> tuple[Array, Array, bool]:
        """Return row, deviations and convergence of two fits; the first weights the second."""
        for _ in range(2):
            solution = self.solve(where, deviations)
            where = solution.x
            deviations = self._deviations(self.left_over(where))
        return where, deviations, bool(solution.status > 0)

    def _deviations(self, left: Array) -> Array:
        """Return the standard deviation of every group of residuals (samples, width)."""
        freedom = max(1.0 - self.estimated / left.size, 1e-3)
        squares = [np.mean(left[:, where] ** 2) for where in self.measured.of.values()]
        return np.maximum(np.sqrt(np.array(squares) / freedom), _LEAST_DEVIATION)

    def solve(self, start: Array, deviations: Array) -> Any:
        """Return the least-squares solution from a row of unknowns, as SciPy does."""

        def at(row: Array) -> Array:
            """Return the residuals, and report progress."""
            self._calls += 1
            self._progress(min(self._calls, _MOST), _MOST, "least squares")
            values: Array = self.residuals(row[None], deviations)[0]
            return values

        return least_squares(
            at,
            start,
            jac=lambda row: self._slopes(row, deviations),
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-13,
            gtol=1e-14,
            max_nfev=_MOST,
        )

    def _slopes(self, row: Array, deviations: Array) -> Array:
        """Return the Jacobian without the rounding of unknowns that have no effect.

        Scaled to norm 1, it would let the least squares move them without limit.
        """
        J = self.jacobian(row, deviations)
        J[:, self.silent(J, deviations)] = 0.0
        return J

    def silent(self, J: Array, deviations: Array) -> NDArray[np.bool_]:
        """Return which unknowns (unknowns,) have no effect, by a Jacobian."""
        scale = self.measured.of_columns(deviations)
        plain = np.abs(J).reshape(-1, len(scale), J.shape[1]).max(axis=0)
        return np.asarray((plain * scale[:, None]).max(axis=0) < SILENT)

    def fine_jacobian(self, row: Array, deviations: Array) -> Array:
        """Return the Jacobian to fourth order.

        The error of second order grows with the square of the motion of the arms, and would make
        dependent fields look independent.
        """
        near, far = (self.jacobian(row, deviations, times * _FINE) for times in (1.0, 2.0))
        slopes: Array = (4.0 * near - far) / 3.0
        return slopes

    def jacobian(self, row: Array, deviations: Array, width: float = _DIFFERENCE) -> Array:
        """Return differences (residuals, unknowns), simulated as one batch.

        Central, or one-sided where the other side is no valid vehicle.
        """
        fore, back, at = self._around(row, deviations, width)
        ahead, behind = (~_failed(rows) for rows in (fore, back))
        fore, back = np.where(ahead[:, None], fore, at), np.where(behind[:, None], back, at)
        widths = width * np.maximum(ahead.astype(float) + behind, 1.0)
        slopes: Array = ((fore - back) / widths[:, None]).T
        return slopes

    def at_edge(self, row: Array) -> NDArray[np.bool_]:
        """Return which unknowns (unknowns,) have an invalid neighbour, or one that fails."""
        fore, back, _ = self._around(row, self.plain, _DIFFERENCE)
        return _failed(fore) | _failed(back)

    def _around(self, row: Array, deviations: Array, width: float) -> tuple[Array, Array, Array]:
        """Return residuals with each unknown slightly larger, slightly smaller, and unchanged."""
        ahead = width * np.eye(len(row))
        rows = self.residuals(np.vstack([row + ahead, row - ahead, row]), deviations)
        return rows[: len(row)], rows[len(row) : -1], rows[-1]


def _failed(rows: Array) -> NDArray[np.bool_]:
    """Return which rows of residuals are of failed runs."""
    return np.asarray((rows == _FAR).all(axis=1))


def lasts(left: Array) -> bool:
    """Return whether the flight with these residuals (samples, width) lasted to its end."""
    return bool((np.abs(left) < _FAR).all())
