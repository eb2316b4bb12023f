"""Recorded releases of an arm: bent, let go, swinging freely below a base that does not move."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError
from continuair.files import printed, user_path
from continuair.identification.bench import Bench
from continuair.identification.clamped import Clamped
from continuair.identification.csv_rows import numbers_of, rows_of
from continuair.identification.decay import FEWEST, onset
from continuair.immutable import Immutable
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import warn

LONGER = 1.05
"""Distance of a marker from the base, over its distance along the arm, that is no measurement."""

_SHORT = f"has fewer than {FEWEST} samples"

_OUT_OF_ORDER = 2.0
"""Squares of second differences over those of steps: below 2 for a motion with four samples or more
in a period, 3 for rows in random order."""

_JUMP = 5.0
"""Longest step of a marker between two samples, over the 95th percentile of its steps."""


@dataclass(frozen=True, kw_only=True)
class Releases(Immutable):
    """Positions of markers on an arm that was let go, each release from the onset of its motion on.

    Parameters
    ----------
    name : str
        Where they come from, for messages.
    motions : tuple of ndarray, each of shape (samples, markers, 3)
        Positions in axes of the recording [m], releases of their own length.
    bench : Bench
        Where the arm hung.
    payload : float, default 0.0
        Mass that the tip carried [kg].
    rate : float, default 100.0
        Samples per second [Hz].
    names : tuple of str, default ()
        Name of each release. Default: numbers.
    """

    name: str
    motions: tuple[Array, ...]
    bench: Bench
    payload: float = 0.0
    rate: float = 100.0
    names: tuple[str, ...] = ()

    @property
    def samples(self) -> int:
        """Return the number of samples of the longest release."""
        return self._clamped.samples

    @property
    def _clamped(self) -> Clamped:
        """Return the motions on a base that does not move."""
        return Clamped(self.motions, self.bench, self.rate, self.payload, False, {})

    @property
    def groups(self) -> int:
        """Return the number of releases."""
        return len(self.motions)

    def measured(self, vehicle: Vehicle) -> Array:
        """Return all motions in body axes, with NaN after the end of each.

        Parameters
        ----------
        vehicle : Vehicle
            The measured vehicle, of one arm.

        Returns
        -------
        ndarray, shape (releases, samples, markers, 3)
            Positions [m].
        """
        return self._clamped.measured(vehicle)

    def starts(self, vehicle: Vehicle) -> tuple[Array, Array]:
        """Return the arm's coordinates at the onset of motion and their rates.

        By least squares over the first four samples, in which the arm swings as the vehicle's does.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle, of one arm.

        Returns
        -------
        coordinates : ndarray, shape (releases, coordinates)
            Bend vectors of arcs [1/m], and the coordinates of other sections.
        rates : ndarray, shape (releases, coordinates)
            Their rates [per s].
        """
        coordinates, rates = np.split(self._clamped.starts(vehicle), 2, axis=1)
        return coordinates, rates

    def predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return the function that predicts the motions for vehicles like a given one.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle, of one arm, whose motion is fitted to the onset of each release.

        Returns
        -------
        callable
            From one vehicle, or a batch, of arms as long as the given one's, to positions of the
            markers in body axes (runs, releases, samples, markers, 3) [m]: its arm let go on a base
            that does not move; NaN after a flight has stopped.
        """
        return self._clamped.predictor(vehicle)

    def free_predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return a function as `predictor`, with starts that fit each whole release best.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle, of one arm. Each start is fitted along the slopes of its motion, which
            holds for vehicles close to it.

        Returns
        -------
        callable
            As that of `predictor`.
        """
        return self._clamped.free_predictor(vehicle)


def load_releases(
    path: str | os.PathLike[str], bench: Bench, *, payload: float = 0.0, rate: float = 100.0
) -> Releases:
    """Return the releases of a CSV file.

    Parameters
    ----------
    path : str or path-like
        A CSV file with the columns ID, a number of the release, and x1, y1, z1, x2, … of the
        markers from the arm's base out [m]; rows of a release follow each other at equal times.
    bench : Bench
        Where the arm hung.
    payload : float, default 0.0
        Mass that the tip carried [kg].
    rate : float, default 100.0
        Samples per second [Hz].

    Returns
    -------
    Releases
        All releases in which every marker was seen, from the onset of motion on. A warning names
        those left out: with gaps, with markers that jump, or farther from the base than along the
        arm.

    Raises
    ------
    InputError
        If the file cannot be read, or fewer than half of its releases can be used.
    """
    file = user_path("data", path)
    where = printed(file)
    payload = checks.number("payload", payload, least=0.0, otherwise=" [kg]")
    rate = checks.positive("rate", rate, " [Hz]")
    count = len(np.asarray(bench.markers))
    names = [f"{axis}{marker + 1}" for marker in range(count) for axis in "xyz"]
    headings, rows = rows_of("data", file)
    table = numbers_of(where, headings, rows, ["ID", *names])
    if not np.isfinite(table[:, 0]).all():
        row = int(np.argmin(np.isfinite(table[:, 0]))) + 1
        raise InputError(
            "ID", f"is missing in row {row}", "give the number of the release in every row"
        ).located(where)
    if f"x{count + 1}" in headings:
        raise InputError(
            "data",
            f"has more markers than the {count} of the bench",
            "name all distances in bench.markers, or remove the columns",
        ).located(where)
    motions: dict[str, Array] = {}
    left_out: dict[str, str] = {}
    for release in dict.fromkeys(table[:, 0].tolist()):
        motion = table[table[:, 0] == release, 1:].reshape(-1, count, 3)
        problem = _problem(motion, bench)
        if not problem:
            motion = motion[onset(motion[:, -1], rate) :]
            problem = _SHORT if len(motion) < FEWEST else ""
        if problem:
            left_out[f"{release:g}"] = problem
        else:
            motions[f"{release:g}"] = motion
    _tell(where, motions, left_out)
    return Releases(
        name=where,
        motions=tuple(motions.values()),
        bench=bench,
        payload=payload,
        rate=rate,
        names=tuple(motions),
    )


def _problem(motion: Array, bench: Bench) -> str:
    """Return why a release (samples, markers, 3) cannot be used, or nothing."""
    if len(motion) < FEWEST:
        return _SHORT
    if not np.isfinite(motion).all():
        return "has gaps"
    away = np.linalg.norm(motion - np.asarray(bench.base), axis=-1)
    if (away > LONGER * np.asarray(bench.markers)).any():
        return "has a marker farther from the base than along the arm"
    steps = np.linalg.norm(np.diff(motion, axis=0), axis=-1)
    if not steps[:, -1].any():
        return "does not move"
    if np.sum(np.diff(motion[:, -1], 2, axis=0) ** 2) > _OUT_OF_ORDER * np.sum(steps[:, -1] ** 2):
        return "has rows out of order"
    if (steps.max(axis=0) > _JUMP * np.percentile(steps, 95, axis=0)).any():
        return "has a marker that jumps"
    return ""


def _tell(where: str, kept: dict[str, Any], left_out: dict[str, str]) -> None:
    """Warn of releases that were left out; raise InputError if these are most of them."""
    if not left_out and kept:
        return
    if not left_out:
        raise InputError("data", "has no rows", "give rows below the headings").located(where)
    why = ", ".join(f"{name} {problem}" for name, problem in list(left_out.items())[:3])
    if len(left_out) >= len(kept):
        raise InputError(
            "data",
            f"has {len(left_out)} releases that cannot be used ({why})",
            "check the unit (m), the order of the markers, and base, up and markers of the bench",
        ).located(where)
    warn(f"{where}: leaves out {len(left_out)} releases ({why}).", stacklevel=3)
