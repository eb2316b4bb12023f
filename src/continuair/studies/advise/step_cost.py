"""Time of a step of each model, measured on the kernels of the flights in a loop."""

from __future__ import annotations

from functools import partial

from continuair.engine.adaptive import Tolerance
from continuair.flight.adaptive import whole
from continuair.flight.prepare import DEFAULT_TOLERANCE, prepare
from continuair.kernels.adaptive import REJECTED, STEPS
from continuair.kernels.dynamics import REFERENCE, SIMPLER
from continuair.studies.advise.excitations import MODERATE
from continuair.studies.excited_flights import NO_LOOP, Loop, excited
from continuair.studies.timing import median_ratios
from continuair.vehicle.vehicle import Vehicle

_STEPS, _REPEATS = 10_000, 7
"""Steps at the least of a flight whose time is measured, and how often it is."""


def step_cost(vehicle: Vehicle, loop: Loop = NO_LOOP) -> dict[str, float]:
    """Return the median time of a model's step over that of the coupled one, measured in turns.

    Flights are releases of the bent arm in a loop, the controller's updates included, with the
    method of all flights, on one thread, without their preparation.
    """
    scenario = excited(vehicle, "release", MODERATE, loop)
    tolerance = Tolerance(DEFAULT_TOLERANCE, longest=scenario.duration / _STEPS)
    flight = prepare(
        vehicle,
        scenario,
        sample=scenario.duration,
        threads=1,
        method="Tsit5",
        tolerance=tolerance,
        strain=True,
    )
    part, steps, flights = whole(flight), {}, {}
    for model in (REFERENCE, *SIMPLER):
        flights[model] = partial(part.fly, flight.engine(model), (), flight.runs)
        steps[model] = float(flights[model]()[1][:, [STEPS, REJECTED]].sum())
    ratios = median_ratios(flights, REFERENCE, _REPEATS)
    return {model: ratio * steps[REFERENCE] / steps[model] for model, ratio in ratios.items()}
