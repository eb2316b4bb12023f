"""Errors of steps that grow with the flight: those of velocities drift, and unstable ones multiply.

`step_error` adds up what single steps err by, and counts errors of velocities for the time of the
fastest motion. In a flight without a controller they last, where they could move the tip it is
flown once more, at several times the step.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from continuair.flight.cohorts import Flight
from continuair.flight.resolution import RESOLVED
from continuair.flight.time_grid import marks_at
from continuair.kernels.integrators import INTEGRATORS
from continuair.vehicle.layout import FIELDS

Array = np.ndarray

_COARSER = 4
"""Steps of the other flight, in those of the first."""

_SURE = 4.0
"""By which its errors were too small at most, as so long steps are of no full order."""


def growing(flight: Flight, errors: Array) -> Array:
    """Which errors, step_error (runs,) or (runs, models), may have grown beyond RESOLVED, as errors
    of velocity move the tip until the end.

    None at given steps, which may bear no longer ones, nor under polar torques, whose direction
    hangs on the step.
    """
    scenario = flight.scenario
    if scenario.controller is not None or scenario.tau is not None or not flight.automatic:
        return np.zeros(errors.shape, bool)
    steps = (flight.duration / flight.steps).reshape(-1, *(1,) * (errors.ndim - 1))
    moved = INTEGRATORS[flight.integrator].phase * errors * steps
    return np.asarray((moved > RESOLVED) & (errors <= RESOLVED))


def coarser(flight: Flight) -> Flight:
    """The same flight at longer steps, with a sample at its start and its end alone."""
    ends, scenario = flight.marks.samples[[0, -1]], flight.scenario
    marks = marks_at(ends, np.append(scenario.jumps, flight.duration), knots=scenario.knots)
    names = {*FIELDS, *flight.coupled.layout.of_input}
    return replace(
        flight,
        steps=_COARSER * flight.steps,
        marks=marks,
        missed=np.zeros(flight.runs, bool),
        abrupt=np.zeros(flight.runs),
        # What such steps miss of inputs is no word about the flight.
        told=set(names),
        unseen=set(names),
        _sampled={},
    )


def grown(flight: Flight, apart: Array) -> Array:
    """step_error (n, …) of what a coarser flight's tip is apart by [arm lengths]."""
    order = INTEGRATORS[flight.integrator].order
    return np.asarray(_SURE * apart / (float(_COARSER) ** order - 1.0))
