"""Steps of one length: automatic ones, from the fastest rate at the start, and given ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from continuair.engine.engine import Drive, Engine, Start
from continuair.engine.pack import natural_units, units_of_own_states
from continuair.errors import InputError
from continuair.flight.frequencies import first_frequency
from continuair.flight.resolution import in_runs
from continuair.flight.rotors import lag_rate
from continuair.kernels.integrators import INTEGRATORS
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array, ArrayLike
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import AIR, GENERAL, TIP
from continuair.vehicle.runs import per_run
from continuair.warning import warn

_NUDGE = 1e-3
"""Change of a state for differences, of an arm's length, a radian, and these per second."""

_AT_ONCE = 1024
"""Runs computed at once, which limits the memory of large batches."""

LOOP_STEP = 1e-4
"""Largest automatic step with controller updates at every stage [s]: the loop may be faster."""


def automatic_step(
    coupled: Engine, q: ArrayLike, qd: ArrayLike | None = None, method: str = "RK4"
) -> Array:
    """Return the step (runs,) [s]: 0.2 over the fastest rate of a run.

    That rate is the largest |eigenvalue| of the Jacobian of the equations of motion, at rest with
    straight arms or at the start, with damping, drag, rotors and terms, plus the angular velocity
    |ω| at the start. The method "implicit" uses 0.05, and the first mode of every arm and the lag
    of rotors instead of the Jacobian, as faster modes do not make it unstable. coupled: an engine
    of the coupled model, whose free base has the largest rates. q, qd: (runs or 1, 8) paper
    coordinates and rates, at rest by default. A run without a finite rate, such as one bent past a
    full circle, has the step inf. Raises InputError if no run has a finite rate.
    """
    at = np.atleast_2d(np.asarray(q, float))
    given = np.zeros_like(at) if qd is None else np.atleast_2d(np.asarray(qd, float))
    at, rates = np.broadcast_arrays(at, given)
    straight = np.array(at)
    straight[:, 6::2] = 0.0
    taken = INTEGRATORS[method]
    if taken.stiff:
        fastest = first_frequency(coupled, np.stack([straight, at]))
        fastest = np.fmax(fastest, lag_rate(coupled.vehicle))
    else:
        at_rest = _fastest_of_jacobian(coupled, straight, np.zeros_like(rates))
        fastest = np.fmax(at_rest, _fastest_of_jacobian(coupled, at, rates))
    if not np.isfinite(fastest).any():
        raise InputError(
            "vehicle",
            "has no finite bending frequency: its arm is too heavy or too soft for its UAV",
            "check arm.length, arm.radius and uav.mass",
        )
    state = state_from_paper(at, rates, coupled.layout)
    spin = np.linalg.norm(state[:, coupled.layout.angular_velocity], axis=1)
    # Rates near the largest float make the step 0, which the time grid refuses.
    with np.errstate(over="ignore", divide="ignore"):
        step = taken.phase / (fastest + spin)
    found: Array = np.where(np.isnan(step), np.inf, step)
    return found


def _fastest_of_jacobian(engine: Engine, q: Array, qd: Array) -> Array:
    """Return the largest |eigenvalue| (runs,) [1/s] of the Jacobian of the rates of states.

    NaN if it is not finite. q, qd: (runs or 1, coordinates).
    """
    layout = engine.layout
    states, angles = state_from_paper(q, qd, layout), branches_of(q, layout)
    runs = np.arange(max(len(states), len(engine.plants)))
    states, angles = (np.broadcast_to(x, (len(runs), x.shape[1])) for x in (states, angles))
    states = np.pad(states, ((0, 0), (0, engine.layout.state - states.shape[1])))
    found = [
        _eigenvalues(engine, states[some], angles[some], some)
        for some in np.array_split(runs, -(-len(runs) // _AT_ONCE))
    ]
    return np.concatenate(found)


def _eigenvalues(engine: Engine, states: Array, angles: Array, runs: NDArray[np.intp]) -> Array:
    """Return `_fastest_of_jacobian` of states (runs, state) of some runs, by differences."""
    changes = _NUDGE * _sizes(engine, runs)
    moved = np.repeat(states[None], 1 + states.shape[1], axis=0)
    for column in range(states.shape[1]):
        moved[1 + column, :, column] += changes[:, column]
    many = len(moved) * len(runs)
    start = Start(moved.reshape(many, -1), np.tile(angles, (len(moved), 1)))
    still = Drive(np.zeros((1, 1, engine.layout.inputs)), False, GENERAL | AIR | TIP, 0.0)
    rates = engine.derivative(start, still, np.tile(runs, len(moved))).reshape(moved.shape)
    slopes = ((rates[1:] - rates[0]) / changes.T[:, :, None]).transpose(1, 2, 0)
    known = np.asarray(np.isfinite(slopes).all((-1, -2)))
    filled = np.where(known[:, None, None], slopes, 0.0)
    return np.where(known, np.abs(np.linalg.eigvals(filled)).max(axis=-1), np.nan)


def _sizes(engine: Engine, runs: NDArray[np.intp]) -> Array:
    """Return the natural unit of each component of a state (runs, state).

    The reach [m], those of the sections' coordinates and of terms, and 1 for others.
    """
    layout, found = engine.layout, np.ones((len(runs), engine.layout.state))
    reach = per_run(engine.vehicle.reach, len(engine.plants))[:, None]
    reach = reach if len(reach) == 1 else reach[runs]
    bends = natural_units(engine.vehicle, layout, len(engine.plants))
    bends = bends if len(bends) == 1 else bends[runs]
    for places in (layout.position, layout.velocity):
        found[:, places] = reach
    for turns in (layout.bend, layout.bend_rate):
        found[:, turns] = bends
    own = units_of_own_states(engine.vehicle, len(engine.plants))
    found[:, layout.bend_rate.stop :] = own if len(own) == 1 else own[runs]
    return found


def steps_of(
    scenario: Scenario, asked: Array | None, fine: Array, sample: float, warn: int | None
) -> Array:
    """Return the step (runs,) [s] of each run of a flight.

    asked: the user's steps (runs or 1,), or None for automatic ones: `fine`, for vehicle and start,
    at most `sample`, and in a closed loop a divisor of the control period. warn: frames up to which
    to warn of a step longer than `fine`, or None. Raises InputError.
    """
    period = scenario.period
    if asked is not None:
        if period is not None:
            check_divides(period, asked, _period_name(scenario))
        if warn is not None:
            _warn_if_coarse(asked, fine, warn + 1)
        return np.broadcast_to(asked, len(fine))
    finest = np.minimum(fine, sample)
    if scenario.controller is None:
        return finest
    if period is None:
        return np.minimum(finest, LOOP_STEP)
    return np.asarray(period / np.ceil(period / finest * (1.0 - 1e-12)))


def _period_name(scenario: Scenario) -> str:
    """Return the name of the control period in messages."""
    own = scenario.controller is not None and scenario.controller.period is not None
    return "the period of the controller's rate" if own else "control_period"


def check_divides(period: float, steps: Array, name: str = "control_period") -> None:
    """Raise InputError unless a control period is a multiple of every step (n,), all [s]."""
    parts = period / steps
    wrong = (np.round(parts) < 1) | (np.abs(parts - np.round(parts)) > 1e-6)
    if wrong.any():
        raise InputError(
            name,
            f"is {period:g} s, which is not a multiple of the step, {steps[wrong][0]:g} s",
            "give one that is, or step='auto'",
        )


def _warn_if_coarse(steps: Array, fine: Array, stacklevel: int) -> None:
    """Warn of steps (runs or 1,) longer than the fine ones (runs,) [s]."""
    coarse = steps > fine * (1.0 + 1e-9)
    if coarse.any():
        of = in_runs(coarse.sum(), len(fine))
        warn(
            f"step is {steps.max():g} s, too coarse for the fastest motion at the start{of}: RK4 "
            f"will distort it; use {fine.min():.3g} s or less, or step='auto'.",
            stacklevel=stacklevel,
        )
