"""How far a vehicle, under a reading, is from the eight numbers of the paper's table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from continuair.scenario.paper_tests import OPEN_LOOP_TESTS
from continuair.studies.open_loop.study import PRINTED
from continuair.vehicle.vehicle import Vehicle
from research.paper_table.flights import Accuracy, Flights
from research.paper_table.readings import Flight, Reading, rotation, translation
from research.paper_table.space import vehicles

Array = np.ndarray

TABLE = np.array(
    [[PRINTED[test][key] for test in OPEN_LOOP_TESTS] for key in ("nrmse_t", "nrmse_r")]
)
"""The printed numbers, (2, 4): translation and rotation of Tests A to D."""

# A number that is exactly 0 is as far off as this one.
_LEAST = 1e-9


def read(vehicle: Vehicle, readings: Sequence[Reading], accuracy: Accuracy) -> Array:
    """The numbers (runs, readings, 2, 4) that a batch of vehicles gives; NaN where a run fails."""
    flights = Flights(vehicle, accuracy)
    found = np.full((vehicle.runs or 1, len(readings), 2, 4), np.nan)
    flown: dict[Flight, list[int]] = {}
    for index, reading in enumerate(readings):
        flown.setdefault(reading.flight, []).append(index)
    known: dict[object, tuple[dict[str, Array], dict[tuple[str, str], Array]]] = {}
    for flight, indices in flown.items():
        for column, test in enumerate(OPEN_LOOP_TESTS):
            tip_force = flight.tip_force if test == "D" else ""
            key = (flight.decoupled, flight.arm, flight.bend, test, tip_force)
            if key not in known:
                pair = [flights.fly(model, flight, test) for model in ("coupled", flight.decoupled)]
                known[key] = translation(*pair), rotation(*pair)
            of_t, of_r = known[key]
            for index in indices:
                reading = readings[index]
                found[:, index, 0, column] = of_t[reading.metric]
                found[:, index, 1, column] = of_r[reading.metric, reading.angles]
    return found


def log_ratios(numbers: Array) -> Array:
    """ln(ours / printed) of numbers (..., 2, 4)."""
    ratios: Array = np.log(np.maximum(numbers, _LEAST) / TABLE)
    return ratios


def objective(numbers: Array) -> Array:
    """RMS over the eight numbers (..., 2, 4) of ln(ours / printed); inf where one is missing.

    To nine decimals, so that readings which differ in no digit of meaning tie on every machine.
    """
    value = np.sqrt(np.mean(log_ratios(numbers) ** 2, axis=(-2, -1)))
    return np.where(np.isfinite(value), np.round(value, 9), np.inf)


def evaluate(shares: Array, readings: Sequence[Reading], accuracy: Accuracy) -> Array:
    """`objective` (runs, readings) of rows of shares (runs, parameters) in [0, 1]."""
    values: Array = objective(read(vehicles(shares), readings, accuracy))
    return values
