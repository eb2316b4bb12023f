"""step_error of runs that are flown at half the step, too: what that changes of the tip."""

from __future__ import annotations

import numpy as np

from continuair.flight.cohorts import Flight
from continuair.flight.rollout import most_runs, record
from continuair.flight.trajectory import Recorder
from continuair.flight.unstable import multiplied
from continuair.kernels.integrators import INTEGRATORS
from continuair.kernels.step import OVERTURNED, UNSEEN
from continuair.vehicle.runs import per_run

Array = np.ndarray

_HALVED_AT_ONCE = 2.0e7
"""Numbers that are kept at once of both flights."""

# Of second order a quarter is left at half the step, of fourth a sixteenth.
_ORDERED = 0.35

_HALVINGS = 5
"""How often steps are halved once more to see whether they have ended a flight themselves."""

_MUCH = 30.0
"""By how much errors multiply from which they may have no order at the end."""

_OF_AN_END = 1e-3
"""What steps err by from which they may have ended a flight themselves [arm lengths]."""

# Of a step, by which times that are sums of steps are off at most.
_ROUNDING = 1e-6


def error_by_halving(flight: Flight, model: str, runs: Array, dtype: str = "float64") -> Array:
    """step_error (runs,) of half the step: of RK4 a fifteenth of what halving changes, of the
    implicit step a third.

    Under polar torques all of it: their direction where the arm passes straight hangs on the step,
    and what does not fall with the step has no order; no more have abrupt commands of rotors, whose
    speeds start from 0 as a square root does. Where torques are in doubt at half the step too, both
    flights may have gone the wrong way, and the doubt stays. Where errors may have multiplied, as
    in a loop around a camera, halving once more tells them. A run that ends otherwise at half the
    step is off by an arm length at least, as far as anyone can tell. dtype: that of the flight,
    whose rounding counts where errors multiply.
    """
    errors, sensitive = np.empty(len(runs)), _multiplies(flight)[runs] & flight.automatic
    if sensitive.any():
        errors[sensitive] = error_here(
            flight.halved(runs[sensitive]), model, runs[sensitive], dtype
        )
    if not sensitive.all():
        errors[~sensitive] = _halved_error(flight, model, runs[~sensitive])
    return errors


def _multiplies(flight: Flight) -> Array:
    """Whether errors may multiply (runs,) so far that two steps may err alike."""
    if flight.scenario.controller is not None:
        return flight.sensitive
    return np.asarray(flight.sensitive | (multiplied(flight) > _MUCH))


def error_here(flight: Flight, model: str, runs: Array, dtype: str = "float64") -> Array:
    """step_error (runs,) of the step itself, taken in dtype: all that halving it changes, and what
    that leaves."""
    share = _share(flight)
    return (1.0 + share) / share * _halved_error(flight, model, runs, dtype)


def _share(flight: Flight) -> float:
    """The error of half the step, as a share of what halving changes."""
    return 1.0 if flight.twists else INTEGRATORS[flight.method].share


def _halved_error(flight: Flight, model: str, runs: Array, dtype: str = "float64") -> Array:
    """As error_by_halving, where errors fall as their order says."""
    finer, length = flight.halved(runs), per_run(flight.vehicle.reach, flight.runs)
    found = []
    most = most_runs(flight.marks.samples, _HALVED_AT_ONCE)
    for part in np.array_split(runs, -(-len(runs) // most)):
        flown = [
            Recorder(each, model, ("tip_position",), of, part)
            for each, of in ((flight, dtype), (finer, "float64"))
        ]
        for recorder in flown:
            record(recorder, part)
        tips = [recorder.values("tip_position") for recorder in flown]
        # What a run that ended has not reached is NaN in one or both.
        apart = np.nanmax(np.linalg.norm(tips[1] - tips[0], axis=-1), axis=-1)
        part_of = np.maximum(flight.abrupt[part], _share(flight))
        estimate = np.fmax(part_of * apart / length[part], flown[1].doubt)
        otherwise = (flown[0].status != flown[1].status) | _end_apart(*flown)
        broken = ~otherwise & (flown[0].status != 0) & (flown[1].of_steps > _OF_AN_END)
        otherwise[broken] = ~_ends_at_finer_steps(flown[1], broken)
        estimate = np.where(otherwise, np.fmax(estimate, 1.0), estimate)
        # What ends a flight, other than its steps, or a law, may put the last one off by anything.
        known = (broken | np.isin(flown[1].status, (UNSEEN, OVERTURNED))) & ~otherwise
        found.append(np.where(known, estimate, _where_ordered(estimate, *flown)))
    return np.concatenate(found)


def _end_apart(coarse: Recorder, fine: Recorder) -> Array:
    """Which runs end early at both steps, but not in the same step of the coarse ones.

    What brings them down there may be the steps themselves, after tips that are still close.
    """
    later, step = fine.end_time - coarse.end_time, coarse.flight.steps[coarse.runs]
    together = (-0.5 * step < later) & (later < step * (1.0 - _ROUNDING))
    return np.asarray((coarse.status != 0) & ~together)


def _ends_at_finer_steps(fine: Recorder, which: Array) -> Array:
    """Whether runs, by which (n,) bool, that end early in steps that are not resolved do so at much
    finer ones, too, within two of their own."""
    runs, finest = fine.runs[which], fine.flight
    for _ in range(_HALVINGS):
        finest = finest.halved(runs)
    again = Recorder(finest, fine.model, ("tip_position",), "float64", runs)
    record(again, runs)
    within = np.abs(again.end_time - fine.end_time[which]) < 2.0 * fine.flight.steps[runs]
    return np.asarray((again.status != 0) & within)


def _where_ordered(estimate: Array, coarse: Recorder, fine: Recorder) -> Array:
    """Errors (runs,) by halving, or those of the steps themselves where these have no order yet.

    What neither step resolves, such as stiff modes or decays, is lost by both alike, and halving
    changes little.
    """
    ordered = fine.of_steps <= _ORDERED * coarse.of_steps
    return np.where(ordered, estimate, np.fmax(estimate, fine.of_steps))
