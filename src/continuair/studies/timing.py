"""Times of flights, measured in turns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any, TypeVar

import numpy as np

from continuair.flight.prepare import prepare
from continuair.scenario.scenarios import Scenario
from continuair.typing import Method, Model
from continuair.vehicle.vehicle import Vehicle

Key = TypeVar("Key")


def median_times(
    flights: Mapping[Key, Callable[[], object]],
    rounds: int,
    begin: Callable[[Key], None] = lambda key: None,
) -> dict[Key, float]:
    """Return the median time of every function.

    Parameters
    ----------
    flights : mapping of hashable to callable
        Functions without arguments.
    rounds : int
        Number of measurements of each.
    begin : callable, optional
        Called with the key before each measurement.

    Returns
    -------
    dict of hashable to float
        Median times [s], measured in turns as by `times_in_turns`.
    """
    times = times_in_turns(flights, rounds, begin)
    return {key: float(np.median(found)) for key, found in times.items()}


def median_ratios(
    flights: Mapping[Key, Callable[[], object]], reference: Key, rounds: int
) -> dict[Key, float]:
    """Return the median ratio of every flight's time to that of the reference in the same round."""
    times = times_in_turns(flights, rounds)
    return {
        key: float(np.median(found / times[reference]))
        for key, found in times.items()
        if key != reference
    }


def times_in_turns(
    flights: Mapping[Key, Callable[[], object]],
    rounds: int,
    begin: Callable[[Key], None] = lambda key: None,
) -> dict[Key, np.ndarray]:
    """Return the times (rounds,) of every flight [s], after a round that compiles and is not timed.

    The flights alternate, so that noise of the machine affects all alike. begin: called before
    each.
    """
    times: dict[Key, list[float]] = {key: [] for key in flights}
    for _ in range(rounds + 1):
        for key, fly in flights.items():
            begin(key)
            start = perf_counter()
            fly()
            times[key].append(perf_counter() - start)
    return {key: np.array(found[1:]) for key, found in times.items()}


def flight_alone(
    vehicle: Vehicle, scenario: Scenario, model: Model, *, step: float, method: Method = "RK4"
) -> Callable[[], np.ndarray]:
    """Return a function that simulates a scenario on one thread.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    scenario : Scenario
        The scenario.
    model : {"coupled", "decoupled", "independent"}
        Dynamic model.
    step : float
        Step [s].
    method : {"Tsit5", "RK4", "implicit"}, default "RK4"
        Integration method.

    Returns
    -------
    callable
        Function without arguments that simulates from start to end and returns statuses (runs,).
        Everything is prepared beforehand, and nothing is logged.
    """
    options: dict[str, Any] = {"method": method, "step": step, "threads": 1}
    flight = prepare(vehicle, scenario, sample=scenario.duration, strain=True, **options)
    engine, cohort = flight.engine(model), next(flight.cohorts())
    return lambda: np.asarray(cohort.fly(engine, among=flight.runs).status)
