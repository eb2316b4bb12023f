"""Preparation of flights: vehicle, scenario and options, combined into one immutable `Flight`.

Every simulation starts here: `simulate`, `run_pairs`, `Simulation`, sweeps, couplings and studies.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from continuair import checks
from continuair.engine.adaptive import Tolerance
from continuair.engine.engine import Engine, Start, check_device, check_threads
from continuair.errors import InputError, shown
from continuair.flight.camera_timing import check_view
from continuair.flight.cohorts import Flight
from continuair.flight.inputs import sample_inputs
from continuair.flight.rotors import check_air_and_rotors, rotor_speeds, with_rotors_running
from continuair.flight.scene import check_outside, in_scene, payload_at_start
from continuair.flight.steps import automatic_step, steps_of
from continuair.flight.tendons import check_commands, check_taut, tendons_at_start
from continuair.flight.time_grid import call_times, check_marks, check_steps, marks_of
from continuair.kernels.integrators import INTEGRATORS, TSIT5
from continuair.scenario.scenarios import Scenario
from continuair.terms import name_of, terms_of
from continuair.typing import Array, Method
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle import Vehicle, check_arcs, check_vehicle

DEFAULT_TOLERANCE = 1e-4
LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-12, 1e-2
_COARSE_TOLERANCE = 1e-4
"""Finest tolerance in single precision, whose rounding error over a flight is of that size."""


def prepare(
    vehicle: Any,
    scenario: Any,
    *,
    step: Any = "auto",
    sample: Any = 1e-3,
    duration: Any = None,
    device: Any = "cpu",
    threads: Any = None,
    method: Method = "RK4",
    tolerance: Tolerance | None = None,
    with_callback: bool = False,
    strain: bool = False,
    stacklevel: int = 2,
) -> Flight:
    """Check vehicle, scenario and options, as described in `continuair.simulate`, and combine them.

    method, tolerance: as in `Flight`. with_callback: whether the caller supports a force_callback.
    strain: whether it uses sections of any kind; else a strain that varies is refused. Raises
    InputError; warns of a step that is too coarse, `stacklevel` frames up.
    """
    check_vehicle(vehicle)
    if not strain:
        check_arcs(vehicle)
    check_scenario(scenario)
    vehicle = in_scene(vehicle, scenario)
    if scenario.force_callback is not None and not with_callback:
        raise InputError(
            "scenario",
            (
                f"{shown(scenario.name)} has a force_callback, which only "
                "continuair.simulate supports"
            ),
            "write the force as a continuair.Term",
        )
    asked = None if isinstance(step, str) and step == "auto" else checked_step(step)
    duration, sample = _times(scenario, duration, sample)
    check_device(device)
    check_threads(threads)
    if method in INTEGRATORS and INTEGRATORS[method].stiff:
        _check_not_stiff(vehicle)
    else:
        _check_no_stretch(vehicle, method)
    coupled = _engine(vehicle, device, threads, method)
    check_fits(scenario, coupled.layout)
    check_air_and_rotors(vehicle, scenario, coupled.layout)
    check_commands(scenario, coupled.layout)
    for target in {id(each): each for each in scenario.targets}.values():
        target.check_until(duration)
    q, qd = np.atleast_2d(scenario.q), np.atleast_2d(scenario.qd)
    runs, batched = _runs(vehicle, scenario, coupled)
    scenario = with_rotors_running(coupled, scenario)
    if asked is not None:
        check_same_runs(runs, {"step": len(asked)})
    check_marks(duration, sample, scenario.period)
    if tolerance is not None:
        steps = np.full(runs, np.nan)
    else:
        fine = np.broadcast_to(automatic_step(coupled, q, qd, method), runs)
        distorts = not INTEGRATORS[method].stiff
        steps = steps_of(scenario, asked, fine, sample, stacklevel + 1 if distorts else None)
        check_steps(duration, float(steps.min()))
    rates = np.broadcast_to(qd, np.broadcast_shapes(q.shape, qd.shape))
    at = np.broadcast_to(q, rates.shape)
    states = state_from_paper(at, rates, coupled.layout)
    own = (
        rotor_speeds(vehicle, scenario),
        tendons_at_start(vehicle, scenario, coupled.layout),
        payload_at_start(scenario, coupled.layout),
    )
    parts = states, *own, branches_of(q, coupled.layout)
    *state, branches = (np.broadcast_to(each, (runs, each.shape[1])) for each in parts)
    start = Start(np.hstack(state), branches)
    late = scenario.controller.latency if scenario.controller is not None else 0.0
    knots = scenario.knots
    if scenario.force_callback is not None:
        check_steps(duration, 1.0 / scenario.callback_rate)
        knots = np.append(knots, call_times(duration, scenario.callback_rate))
    marks = marks_of(duration, sample, scenario.jumps, scenario.period, late, knots)
    check_view(coupled, scenario, start)
    check_taut(coupled, scenario, start)
    check_outside(coupled, scenario, start)
    return Flight(
        vehicle,
        scenario,
        duration,
        sample,
        runs,
        batched,
        start,
        steps,
        marks,
        coupled,
        method=method,
        tolerance=tolerance,
    )


def tolerance_for(
    method: Method,
    rtol: Any = DEFAULT_TOLERANCE,
    atol: Any = None,
    max_step: Any = np.inf,
    dtype: str = "float64",
) -> Tolerance | None:
    """Return the tolerance of an adaptive method, None for another.

    Raises InputError for invalid tolerances, and for those given to a method that does not use
    them.
    """
    if method == TSIT5:
        return _checked_tolerance(rtol, atol, max_step, dtype)
    given = {"rtol": not _is(rtol, DEFAULT_TOLERANCE), "atol": atol is not None}
    given["max_step"] = not _is(max_step, np.inf)
    for name in (name for name, chosen in given.items() if chosen):
        raise InputError(
            name,
            f"is given, but method is {shown(method)}, whose steps have one length",
            f"give step, or method='{TSIT5}'",
        )
    return None


def _is(value: Any, number: float) -> bool:
    """Return whether a value is a given number; arrays are not, as they have no truth value."""
    return np.ndim(value) == 0 and bool(value == number)


def step_for(method: Method, step: Any) -> Any:
    """Return the step of a method, "auto" for an adaptive one.

    Raises InputError if it is missing, or not used.
    """
    if method == TSIT5 and step is not None:
        raise InputError(
            "step",
            f"is {shown(step)}, but method is '{TSIT5}', which chooses its steps",
            "give rtol or max_step, or method='RK4'",
        )
    if method != TSIT5 and step is None:
        raise InputError(
            "step",
            f"is missing, but method is {shown(method)}, whose steps have one length",
            "give step [s], or step='auto'",
        )
    return "auto" if step is None else step


def _checked_tolerance(rtol: Any, atol: Any, max_step: Any, dtype: str) -> Tolerance:
    """Return the tolerance of an adaptive method, or raise InputError."""
    checks.number("rtol", rtol, least=LEAST_TOLERANCE)
    if rtol > LARGEST_TOLERANCE:
        raise InputError(
            "rtol",
            f"is {shown(rtol)}",
            f"give a number from {LEAST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}",
        )
    if dtype == "float32" and rtol < _COARSE_TOLERANCE:
        raise InputError(
            "rtol",
            f"is {shown(rtol)}, finer than float32 resolves",
            f"give {_COARSE_TOLERANCE:g} or more, or dtype='float64'",
        )
    absolute = None if atol is None else checks.positive("atol", atol)
    longest = np.inf if _is(max_step, np.inf) else checks.positive("max_step", max_step, " [s]")
    return Tolerance(float(rtol), absolute, longest)


def _check_not_stiff(vehicle: Vehicle) -> None:
    """Raise InputError for a term whose derivatives the implicit integrator would need."""
    for term in terms_of(vehicle):
        if term.stiff:
            raise InputError(
                "method",
                f"is 'implicit', which has no derivatives of the term {name_of(term)}",
                "use 'RK4' or the default"
                if term not in vehicle.terms or term.field
                else "use 'RK4', or declare stiff = False in its class",
            )


def _check_no_stretch(vehicle: Vehicle, method: str) -> None:
    """Raise InputError for stretch or shear, whose fast modes explicit methods would follow."""
    for section in (part for arm in vehicle.arms for part in arm.section):
        if section.orders.stretch is not None or section.orders.shear is not None:
            raise InputError(
                "method",
                f"is {shown(method)}, but section {section.name} stretches or shears, too fast "
                "for explicit steps",
                "give method='implicit' and a step, or leave stretch and shear out",
            )


def _engine(vehicle: Vehicle, device: str, threads: int | None, method: str) -> Engine:
    """Return an engine of the coupled model, cached for a vehicle of one run."""
    of = _engine_of_one if vehicle.runs is None else _new_engine
    return of(vehicle, device, threads, method)


def _new_engine(vehicle: Vehicle, device: str, threads: int | None, method: str) -> Engine:
    """Return a new engine of the coupled model."""
    return Engine(vehicle, "coupled", device=device, threads=threads, method=method)


# Packing a vehicle takes longer than a short flight.
_engine_of_one = lru_cache(maxsize=16)(_new_engine)


def check_scenario(scenario: Any) -> None:
    """Raise InputError unless it is a scenario."""
    if not isinstance(scenario, Scenario):
        raise InputError(
            "scenario",
            f"is {shown(scenario)}",
            "give a continuair.Scenario, such as amiri2026.open_loop_test('A')",
        )


def check_fits(scenario: Scenario, layout: Layout) -> None:
    """Raise InputError unless a scenario has as many coordinates and arms as a vehicle."""
    if np.shape(scenario.q)[-1] != layout.coordinates:
        further = "the coordinates of each" if layout.strains else "kappa psi_a per"
        raise InputError(
            "scenario.q",
            (
                f"has {np.shape(scenario.q)[-1]} numbers, but the vehicle has "
                f"{layout.sections} sections"
            ),
            f"give {layout.coordinates}: x y z roll pitch yaw, and {further} section",
        )
    if layout.strains and scenario.tau is not None:
        raise InputError(
            "scenario.tau",
            "is conjugate to the paper's coordinates, which a strain that varies does not have",
            "give force, moment and bend_moment",
        )
    wrench = scenario.tip_wrench
    given = wrench(0.0) if callable(wrench) else wrench
    if given is not None and np.shape(given)[-1] != 6 * layout.arms:
        raise InputError(
            "scenario.tip_wrench",
            f"has {np.shape(given)[-1]} numbers, but the vehicle has {layout.arms} arms",
            "give 6 for each",
        )


def checked_step(step: Any) -> Array:
    """Return steps (runs or 1,) [s] that are not "auto"."""
    given = step if np.ndim(step) == 1 and len(step) else [step]
    return np.array([checks.positive("step", each, " or 'auto'") for each in given])


def _times(scenario: Scenario, duration: Any, sample: Any) -> tuple[float, float]:
    """Return duration and time between samples [s]."""
    lasts = scenario.duration if duration is None else checks.positive("duration", duration)
    if checks.positive("sample", sample) > lasts * (1.0 + 1e-9):
        raise InputError(
            "sample",
            f"is {shown(sample)} s, longer than the flight of {lasts:g} s",
            "give a shorter one",
        )
    return lasts, float(sample)


def _runs(vehicle: Vehicle, scenario: Scenario, engine: Engine) -> tuple[int, bool]:
    """Return the number of runs, on which all parts must agree, and whether it is a batch."""
    width = sample_inputs(scenario, np.zeros(1), engine.layout)[0].shape[1]
    controller, seed = scenario.controller, scenario.seed
    nominal = controller.believes if controller is not None else None
    listed = isinstance(scenario.target, (list, tuple))
    sizes: Mapping[str, int | None] = {
        "vehicle": vehicle.runs,
        "scenario.q": _rows(scenario.q),
        "scenario.qd": _rows(scenario.qd),
        "scenario.controller": controller.runs if controller is not None else None,
        "the nominal vehicle of scenario.controller": nominal.runs if nominal else None,
        "scenario.target": len(scenario.targets) if listed else None,
        "scenario.seed": len(seed) if isinstance(seed, tuple) else None,
        "scenario.setpoints": None if scenario.setpoints is None else scenario.setpoints.runs,
        "scenario.rotor_thrust": _rows(scenario.rotor_thrust),
        "the scenario's inputs": width if width > 1 else None,
    }
    runs = max(size or 1 for size in sizes.values())
    check_same_runs(runs, sizes)
    return runs, any(size is not None for size in sizes.values())


def _rows(state: Any) -> int | None:
    """Return the number of rows of a state, None for one row."""
    return len(state) if np.ndim(state) == 2 else None


def check_same_runs(runs: int, sizes: Mapping[str, int | None]) -> None:
    """Raise InputError unless each part has that many runs, or one for all."""
    for name, size in sizes.items():
        if size not in (None, 1, runs):
            raise InputError(
                name,
                f"has {size} runs, but the batch has {runs}",
                "give every array one row per run, or a single row",
            )
