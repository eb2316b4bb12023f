"""Errors of steps that grow with the flight: those of velocities drift, and unstable ones multiply.

`step_error` adds up what single steps err by, and counts errors of velocities for the time of the
fastest motion. In a flight without a controller they last, and where it is unstable they multiply:
where either could move the tip it is flown once more, at several times the step. Arms of several
sections that swing far multiply them most, a loop answers to them late, or at its limits, and one
around a camera that throws its vehicle about multiplies rounding itself: there half the step tells
what comes of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from continuair.flight.cohorts import Flight
from continuair.flight.halving import error_here
from continuair.flight.resolution import RESOLVED
from continuair.flight.time_grid import marks_at
from continuair.flight.unstable import multiplied
from continuair.kernels.integrators import INTEGRATORS
from continuair.vehicle.layout import FIELDS
from continuair.vehicle.runs import per_run

Array = np.ndarray

_COARSER, _OF_LONGEST = 4, 2
"""Steps of the other flight, at least: in those of the first, and in the longest that it allows."""

_SURE = 4.0
"""By which its errors were too small at most, as so long steps are of no full order."""

_ALIKE, _SLACK = 0.1, 10.0
"""Share of errors of velocities that may add up, and how far what may become of errors is above
what does, but under rotors, wind and polar torques, which turn with them: of 2,360 random flights
without a loop 121 came to more than 1e-3, where this was at least 0.08."""

_DOUBTED = 0.1
"""Share of RESOLVED from which half the step is asked, too, where the direction of torques may hang
on the step."""

_FAR = 0.15
"""Arm lengths apart from which the other flight has no order left: it went elsewhere."""

_TURNED = 0.5
"""Angle [rad] from which tips that are close have gone elsewhere."""


def count_growth(
    flight: Flight,
    models: tuple[str, ...],
    errors: Array,
    fly_coarser: Callable[[Flight, Array], tuple[Array, Array]],
    dtype: str = "float64",
) -> None:
    """Count errors that grow with the flight in step_error (runs, models), in place.

    fly_coarser(other, runs) flies runs of another Flight, by their indices, and returns how far
    its tips at the end are `parted` from the flight's (n, models) [m], and the ends in time
    (n, models) [s]. Errors that have multiplied beyond its order are told by half the step.
    """
    may_grow = _growing(flight, errors)
    runs = np.flatnonzero(may_grow.any(axis=1))
    if not len(runs):
        return
    told = np.full((len(runs), len(models)), np.nan)
    if len(calm := np.flatnonzero(~flight.sensitive[runs])):
        other = _coarser(flight)
        told[calm] = _grown(flight, other, runs[calm], *fly_coarser(other, runs[calm]))
    if flight.twists:
        # Torques whose direction hangs on the step leave no order to go by.
        told[told > _DOUBTED * RESOLVED] = np.nan
    told[~may_grow[runs]] = 0.0
    for column, model in enumerate(models):
        if (lost := np.isnan(told[:, column])).any():
            told[lost, column] = error_here(flight, model, runs[lost], dtype)
    errors[runs] = np.fmax(errors[runs], told)


def _growing(flight: Flight, errors: Array) -> Array:
    """Which errors, step_error (runs, models), may have grown beyond RESOLVED until the end: where
    the flight is sensitive, and, without a controller, as errors last or multiply.

    None at given steps, which may bear no longer ones.
    """
    if not flight.automatic:
        return np.zeros(errors.shape, bool)
    may_grow = flight.sensitive[:, None]
    if flight.scenario.controller is None:
        lasting = INTEGRATORS[flight.method].phase * flight.duration / flight.steps
        blown = flight.scenario.wind is not None
        turns = flight.twists or blown or flight.vehicle.uav.rotors is not None
        alike, slack = (1.0, 1.0) if turns else (_ALIKE, _SLACK)
        most = np.maximum(alike * lasting, multiplied(flight))[:, None]
        with np.errstate(over="ignore"):
            may_grow = may_grow | (errors * most > slack * RESOLVED)
    return np.asarray(may_grow & (errors <= RESOLVED))


def _coarser(flight: Flight) -> Flight:
    """The same flight at longer steps, with a sample at its start and its end alone."""
    ends, scenario = flight.marks.samples[[0, -1]], flight.scenario
    marks = marks_at(ends, np.append(scenario.jumps, flight.duration), knots=scenario.knots)
    names = {*FIELDS, *flight.coupled.layout.of_input}
    longest = np.minimum(_OF_LONGEST * flight.longest, flight.duration)
    return replace(
        flight,
        steps=np.maximum(_COARSER * flight.steps, longest),
        marks=marks,
        missed=np.zeros(flight.runs, bool),
        abrupt=np.zeros(flight.runs),
        # What such steps miss of inputs is no word about the flight.
        told=set(names),
        unseen=set(names),
        _sampled={},
    )


def parted(poses: Array, others: Array) -> Array:
    """How far apart tips (..., 7) are [m], inf where they are turned otherwise: flights that went
    elsewhere may pass by one another."""
    between = np.abs(np.sum(poses[..., 3:] * others[..., 3:], axis=-1))
    elsewhere = 2.0 * np.arccos(np.minimum(between, 1.0)) > _TURNED
    off = np.linalg.norm(poses[..., :3] - others[..., :3], axis=-1)
    return np.where(elsewhere, np.inf, off)


def _grown(flight: Flight, other: Flight, runs: Array, apart: Array, late: Array) -> Array:
    """step_error (n, models) of runs, by their indices, by what a coarser flight's tips are
    `parted` at the end (n, models) [m], NaN where one did not get there.

    late: what their ends are apart in time (n, models) [s]. NaN where errors have multiplied so far
    that no order is left: half the step tells more.
    """
    step, coarse = (each.steps[runs, None] for each in (flight, other))
    apart = apart / per_run(flight.vehicle.reach, flight.runs)[runs, None]
    apart = np.where(late > coarse, np.inf, np.nan_to_num(apart, posinf=np.inf))
    told = _SURE * apart / ((coarse / step) ** INTEGRATORS[flight.method].order - 1.0)
    lost = (apart > _FAR) & ((told <= RESOLVED) | np.isinf(told))
    return np.where(lost, np.nan, told)
