"""Recorded motions of an arm that tendons or bend moments drive on a base that does not move."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError
from continuair.files import printed, user_path
from continuair.flight.labels import columns_of_moments
from continuair.identification.bench import Bench, markers_of
from continuair.identification.clamped import Clamped
from continuair.identification.csv_rows import numbers_of, rows_of
from continuair.identification.releases import LONGER
from continuair.immutable import Immutable
from continuair.typing import Array
from continuair.vehicle.layout import numbered
from continuair.vehicle.vehicle import Vehicle

_BLOCKS = 10
"""Parts of a motion that count as independent if what is left over is correlated."""

_UNEVEN = 0.02
"""Difference of a time between rows from their mean that is no jitter."""

FEWEST_ROWS = 30
"""Rows that a motion needs."""


@dataclass(frozen=True, kw_only=True)
class DrivenMotion(Immutable):
    """Positions of markers on an arm that starts at rest and is driven on a fixed base.

    Parameters
    ----------
    name : str
        Where they come from, for messages.
    motion : ndarray, shape (samples, markers, 3)
        Positions in axes of the recording [m], NaN where a marker was not seen.
    bench : Bench
        Where the arm hung.
    rate : float
        Samples per second [Hz].
    kind : {"tension", "tendon_command", "bend_moment"}
        What drives the arm: tensions of its tendons [N], which include the pretension; commands of
        their motors, as in `Scenario` [N, m]; or bend moments [N m²].
    inputs : ndarray, shape (samples, inputs)
        Its values, each held until the next sample.
    payload : float, default 0.0
        Mass that the tip carried [kg].
    """

    name: str
    motion: Array
    bench: Bench
    rate: float
    kind: str
    inputs: Array
    payload: float = 0.0

    @property
    def _clamped(self) -> Clamped:
        """Return the motion on a base that does not move."""
        rows, rate = self.inputs, self.rate

        def held(t: float) -> Array:
            # A time may lie before its sample by a rounding error.
            return np.asarray(rows[min(int(t * rate + 1e-6), len(rows) - 1)])

        name = "tendon_command" if self.kind == "tension" else self.kind
        return Clamped((self.motion,), self.bench, rate, self.payload, True, {name: held})

    @property
    def groups(self) -> int:
        """Return the number of parts that count as independent."""
        return _BLOCKS

    def measured(self, vehicle: Vehicle) -> Array:
        """Return the motion in body axes, in ten parts, with NaN after its end.

        Parameters
        ----------
        vehicle : Vehicle
            The measured vehicle, of one arm.

        Returns
        -------
        ndarray, shape (10, samples, markers, 3)
            Positions [m].
        """
        return _parts(self._clamped.measured(vehicle))[0]

    def predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return the function that predicts the motion for vehicles like a given one.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle, of one arm, whose shape is fitted to the first samples.

        Returns
        -------
        callable
            From one vehicle, or a batch, to positions (runs, 10, samples, markers, 3) in body axes
            [m]; NaN after a flight has stopped.
        """
        found = self._clamped.predictor(self._of_inputs(vehicle))
        return lambda vehicles: _parts(found(self._of_inputs(vehicles)))

    def free_predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return a function as `predictor`, with the start that fits the whole motion best.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle, of one arm, to which others must be close.

        Returns
        -------
        callable
            As that of `predictor`.
        """
        found = self._clamped.free_predictor(self._of_inputs(vehicle))
        return lambda vehicles: _parts(found(self._of_inputs(vehicles)))

    def _of_inputs(self, vehicle: Vehicle) -> Vehicle:
        """Return the vehicle without the pretension that recorded tensions include.

        Raises InputError for one with other inputs than the recording.
        """
        wanted = vehicle.layout.bends if self.kind == "bend_moment" else vehicle.tendons
        if wanted != self.inputs.shape[1]:
            what = "coordinates" if self.kind == "bend_moment" else "tendons"
            raise InputError(
                self.kind,
                f"has {self.inputs.shape[1]} columns, but the vehicle has {wanted} {what}",
                "compare models that share the inputs, such as tensions of the same tendons",
            ).located(self.name)
        if self.kind != "tension":
            return vehicle
        path = f"arm.{vehicle.arms[0].name}" if vehicle.has_arm_list else "arm"
        tendons = vehicle.arms[0].tendon
        return vehicle.replace({f"{path}.tendon.{each.name}.pretension": 0.0 for each in tendons})


def _parts(motions: Array) -> Array:
    """Return motions (runs, 1, samples, ...), or one of them, as (runs, parts, samples, ...)."""
    flat = motions.reshape(-1, *motions.shape[-3:])
    each = -(-flat.shape[1] // _BLOCKS)
    found = np.full((len(flat), _BLOCKS * each, *flat.shape[2:]), np.nan)
    found[:, : flat.shape[1]] = flat
    return found.reshape(len(flat), _BLOCKS, each, *flat.shape[2:])


def load_driven(
    path: str | os.PathLike[str], vehicle: Vehicle, bench: Bench, *, payload: float = 0.0
) -> DrivenMotion:
    """Return the driven motion of a CSV file.

    Parameters
    ----------
    path : str or path-like
        A CSV file with the columns time [s], in equal steps; x1, y1, z1, x2, … of the markers from
        the arm's base out [m], empty where one was not seen; and tension_1, tension_2, … of all
        tendons [N], or tendon_command_1, … [N, m], or the bend moments of all sections, named as in
        recorded flights. The arm rests in the first row.
    vehicle : Vehicle
        The vehicle, of one arm.
    bench : Bench
        Where the arm hung.
    payload : float, default 0.0
        Mass that the tip carried [kg].

    Returns
    -------
    DrivenMotion
        The motion with its inputs.

    Raises
    ------
    InputError
        If the file cannot be read or used.
    """
    file = user_path("data", path)
    where = printed(file)
    payload = checks.number("payload", payload, least=0.0, otherwise=" [kg]")
    count = len(markers_of(vehicle, bench))
    headings, rows = rows_of("data", file)
    kind, names = _inputs_of(headings, vehicle, where)
    markers = [f"{axis}{marker + 1}" for marker in range(count) for axis in "xyz"]
    if f"x{count + 1}" in headings:
        raise InputError(
            "data",
            f"has more markers than the {count} of the bench",
            "name all distances in bench.markers, or remove the columns",
        ).located(where)
    table = numbers_of(where, headings, rows, ["time", *names, *markers])
    time, inputs = table[:, 0], table[:, 1 : 1 + len(names)]
    motion = table[:, 1 + len(names) :].reshape(-1, count, 3)
    problem = _problem(time, inputs, motion, bench, kind)
    if problem:
        raise InputError(*problem).located(where)
    rate = float((len(time) - 1) / (time[-1] - time[0]))
    return DrivenMotion(
        name=where,
        motion=motion,
        bench=bench,
        rate=rate,
        kind=kind,
        inputs=inputs,
        payload=payload,
    )


def _inputs_of(headings: list[str], vehicle: Vehicle, where: str) -> tuple[str, tuple[str, ...]]:
    """Return the kind of the inputs that a file has, and their columns."""
    count = vehicle.tendons
    kinds: dict[str, Any] = {
        "tension": numbered(["tension"], count) if count else (),
        "tendon_command": numbered(["tendon_command"], count) if count else (),
        "bend_moment": columns_of_moments(vehicle),
    }
    found = [kind for kind, names in kinds.items() if any(name in headings for name in names)]
    if len(found) != 1:
        wanted = " or ".join(names[0] for names in kinds.values() if names)
        raise InputError(
            "data",
            f"has columns of {' and '.join(found)}" if found else "has no column of inputs",
            f"give all columns of one kind, from {wanted} on",
        ).located(where)
    return found[0], kinds[found[0]]


def _problem(
    time: Array, inputs: Array, motion: Array, bench: Bench, kind: str
) -> tuple[str, str, str] | None:
    """Return field, problem and remedy of what cannot be used, or None."""
    if len(time) < FEWEST_ROWS:
        return "data", f"has {len(time)} rows", f"record {FEWEST_ROWS} or more"
    steps = np.diff(time)
    if not (np.abs(steps - steps.mean()) < _UNEVEN * steps.mean()).all():
        return "time", "has steps that differ, or a gap", "record at equal steps [s]"
    if not np.isfinite(inputs).all():
        return kind, "has gaps", "give every input in every row"
    if kind == "tension" and inputs.min() < 0.0:
        return kind, f"is {inputs.min():g} in a row", "give tensions of 0 or more [N]"
    if not np.isfinite(motion[0]).all():
        return "data", "has gaps in its first row", "begin where all markers are seen"
    away = np.linalg.norm(motion - np.asarray(bench.base), axis=-1)
    if (away > LONGER * np.asarray(bench.markers)).any():
        return (
            "data",
            "has a marker farther from the base than along the arm",
            "check the unit (m), the order of the markers, and base, up and markers of the bench",
        )
    return None
