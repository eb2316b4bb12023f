"""Errors of the models on the standard excitations, in a loop, and which coupling makes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from continuair.analysis.couplings import attribution
from continuair.analysis.excited import excited_arm
from continuair.analysis.limits import Limit, find_limits
from continuair.controllers.cascade_design import GRAVITY
from continuair.engine.adaptive import Tolerance
from continuair.flight.adaptive import compile_models
from continuair.flight.prepare import DEFAULT_TOLERANCE, prepare
from continuair.kernels.dynamics import COUPLINGS, REFERENCE, SIMPLER, WITHOUT
from continuair.studies.advise.frequencies import LONGEST, slowest, tried
from continuair.studies.excited_flights import (
    NO_LOOP,
    Loop,
    error_of,
    excited,
    flown_errors,
    least_periods,
    sampling,
)
from continuair.studies.standard_excitations import EXCITATIONS, PERIODS
from continuair.typing import Model
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

MODERATE = 0.5
"""Frequency over the clamped one at which errors are quoted and couplings separated."""

REFINED = 8
"""Frequencies of the round that halves in on a limit."""

SETTLED, LASTING = 0.1, 8.0
"""Largest share by which a settled error differs from that of a longer flight: twice as long, and
of so many times what the slowest motion of the loop takes."""

_LONGER = float(np.sqrt(10.0))
"""Ratio of the durations of flights simulated together, whose loads are sampled once."""


def compile_all(vehicle: Vehicle, loop: Loop) -> None:
    """Compile the models that are flown in a loop, several at a time."""
    scenario = excited(vehicle, "release", MODERATE, loop)
    flight = prepare(
        vehicle,
        scenario,
        sample=scenario.duration,
        method="Tsit5",
        tolerance=Tolerance(DEFAULT_TOLERANCE),
        strain=True,
    )
    # Those without one coupling share one kernel.
    compile_models(flight, (REFERENCE, *SIMPLER, next(iter(WITHOUT))))


def excite(vehicle: Vehicle, name: str, tolerance: float, loop: Loop = NO_LOOP) -> dict[str, Any]:
    """Return the error of each model at the moderate load, and the highest tolerable frequency.

    limit_hz: NaN if the lowest frequency tried exceeds the tolerance, inf if none does, None for a
    release or a fall. Errors are those of `flown_errors`. settled, and limit_settled at the limit:
    whether a flight longer by the loop's settling time agrees within a tenth, and its value. Both
    are None if no loop holds the position, there is no error, or nothing oscillates.
    """
    excitation = EXCITATIONS[name]
    places, periods = np.empty((2, 0)) if excitation.on is None else tried(vehicle, loop)
    flown = _errors(vehicle, name, [MODERATE, *places], loop, periods=[0.0, *periods])
    errors = {model: float(found[0]) for model, found in flown.items()}
    models: dict[str, dict[str, Any]] = {
        model: {"error": error, "tolerable": error <= tolerance, "limit_hz": None}
        for model, error in errors.items()
    }
    if excitation.on is not None:
        clamped = float(excited_arm(vehicle).frequency) / (2.0 * np.pi)

        def finer(ratios: Array, model: Any) -> Array:
            return _errors(vehicle, name, ratios, loop, models=(model,))[model]

        scanned = {model: found[1:] for model, found in flown.items()}
        limits = find_limits(places, scanned, tolerance, finer, REFINED)
        for model, found in limits.items():
            models[model] |= {
                "limit_hz": found.last * clamped,
                "hz": (found.places * clamped).tolist(),
                "errors": found.errors.tolist(),
            }
        for model, settled in _settled(vehicle, name, errors, limits, loop).items():
            models[model] |= settled
    return {
        "meaning": excitation.meaning,
        "load": excitation.load,
        "load_ratio": excitation.moderate,
        "amplitude": _amplitude(vehicle, name),
        "models": models,
    }


def _amplitude(vehicle: Vehicle, name: str) -> float | None:
    """Return the input's amplitude at the moderate load and frequency; None without input."""
    excitation = EXCITATIONS[name]
    if excitation.amplitude is None:
        return None
    at = vehicle, excited_arm(vehicle), excitation.moderate, MODERATE, GRAVITY
    return float(np.squeeze(excitation.amplitude(*at)))


def _settled(
    vehicle: Vehicle, name: str, moderate: dict[str, float], limits: dict[str, Limit], loop: Loop
) -> dict[str, dict[str, Any]]:
    """Whether each model's errors at MODERATE and at its limit are those of longer flights."""
    found: dict[str, dict[str, Any]] = {
        model: {
            "settled": None,
            "limit_settled": None,
            "longer_error": None,
            "limit_longer_error": None,
        }
        for model in limits
    }
    if not loop.settles:
        return found
    at = [each.last for each in limits.values() if np.isfinite(each.last)]
    places = np.array([MODERATE, *at])
    longer = _errors(vehicle, name, places, loop, 2.0, _lasting(vehicle, loop))
    for model, limit in limits.items():
        long = float(longer[model][0])
        found[model] |= {"settled": _alike(moderate[model], long), "longer_error": long}
        if np.isfinite(limit.last):
            error = limit.errors[limit.places == limit.last][0]
            long = float(longer[model][places == limit.last][0])
            found[model] |= {"limit_settled": _alike(error, long), "limit_longer_error": long}
    return found


def _lasting(vehicle: Vehicle, loop: Loop) -> float:
    """Return clamped periods in which the slowest motion of a loop settles; 0 if unknown."""
    rate = slowest(vehicle, loop)
    if rate is None:
        return 0.0
    clamped = float(excited_arm(vehicle).frequency) / (2.0 * np.pi)
    return LASTING / rate * clamped


def _alike(error: float, longer: float) -> bool | None:
    """Return whether an error is that of a longer flight; None where there is none."""
    return bool(abs(longer - error) <= SETTLED * error) if np.isfinite(error) else None


def _errors(
    vehicle: Vehicle,
    name: str,
    frequencies: Any,
    loop: Loop,
    longer: float = 1.0,
    least: float = 0.0,
    periods: Any = 0.0,
    models: Sequence[Model] = SIMPLER,
) -> dict[str, Array]:
    """Return the error of each model at each frequency.

    longer: factor on the duration that is needed; least: least duration [clamped periods]; periods:
    least duration of a flight in a loop [clamped periods], one number or (n,).
    """
    frequencies = np.asarray(frequencies, float)
    errors: dict[str, Array] = {model: np.empty(len(frequencies)) for model in models}
    for at, needed in together(name, frequencies, loop, periods):
        lasting = max(longer * needed, least)
        found = flown_errors(vehicle, name, frequencies[at], loop, lasting, models)
        for model in models:
            errors[model][at] = found[model]
    return errors


def together(
    name: str, frequencies: Array, loop: Loop, periods: Any = 0.0
) -> Iterator[tuple[Array, float]]:
    """Return indices of frequencies (n,) of equal duration, and the duration [clamped periods].

    It is what the flight of them needs that needs the longest; periods: as in `_errors`.
    """
    if EXCITATIONS[name].on is None or not loop.closed:
        yield np.arange(len(frequencies)), PERIODS
        return
    if not loop.settles:
        # Sideways the models drift apart as long as they fly: all alike, as the slowest must.
        yield np.arange(len(frequencies)), LONGEST
        return
    needed = np.maximum(least_periods(frequencies), periods)
    steps = np.ceil(np.log(needed / PERIODS) / np.log(_LONGER) - 1e-9)
    for step in np.unique(steps):
        at = np.flatnonzero(steps == step)
        yield at, float(needed[at].max())


def attribute(vehicle: Vehicle, name: str, loop: Loop = NO_LOOP) -> dict[str, float]:
    """Return the error of the coupled model without one coupling, at the moderate load."""
    (_, periods), *_rest = together(name, np.array([MODERATE]), loop)
    scenario = excited(vehicle, name, MODERATE, loop, periods)
    found = attribution(vehicle, scenario, *sampling(vehicle, scenario), whole=False)
    return {coupling: float(error_of(found[coupling], vehicle)) for coupling in COUPLINGS}


def missed(couplings: dict[str, float], error: float) -> str:
    """Return the coupling whose omission errs most, or "recoil" if two partly cancel.

    Return nothing if flights without each of them end early, as those of the coupled model then
    may. couplings: of `attribute`; error: without all of them. `responsible` of
    analysis/couplings.py counts one coupling only, over many flights.
    """
    if not np.isfinite(list(couplings.values())).any():
        return ""
    if min(couplings["inertia"], couplings["coriolis"]) > error:
        return "recoil, inertial and Coriolis coupling together"
    return max(couplings, key=lambda key: couplings[key])
