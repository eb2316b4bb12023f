"""How long flights take, flown in turns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any, TypeVar

import numpy as np

from continuair.flight.prepare import prepare
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

Key = TypeVar("Key")


def median_times(
    flights: Mapping[Key, Callable[[], object]],
    rounds: int,
    begin: Callable[[Key], None] = lambda key: None,
) -> dict[Key, float]:
    """Return the median time of every flight [s], as `times_in_turns` has them."""
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

    The flights alternate, so that noise of the machine hits all alike. begin: called before each.
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
    vehicle: Vehicle, scenario: Scenario, model: str, *, step: float, method: str = "RK4"
) -> Callable[[], np.ndarray]:
    """Return a function that flies a scenario on one thread, from its start to its end.

    All that can be prepared is, and nothing is logged between. The function returns statuses
    (runs,).
    """
    options: dict[str, Any] = {"method": method, "step": step, "threads": 1}
    flight = prepare(vehicle, scenario, sample=scenario.duration, **options)
    engine, cohort = flight.engine(model), next(flight.cohorts())
    return lambda: np.asarray(cohort.fly(engine, observe=False, among=flight.runs).status)
