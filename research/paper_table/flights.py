"""Flying vehicles under readings through Tests A to D, and how far the numbers are from Table I."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.table.compiled import Job, fly
from amiri2026.table.metrics import Tips, tips
from amiri2026.table.printed import FLOWN, Flight, PrintedModel
from amiri2026.table.reading import Reading
from amiri2026.table.study import PRINTED
from continuair.vehicle.vehicle import Vehicle
from research.paper_table.readings import METRICS, numbers

Array = np.ndarray
Pair = tuple[Vehicle, Reading]
"""A vehicle, and the choices of a reading that its flights depend on."""


@dataclass(frozen=True)
class Accuracy:
    """tolerance of the flights; sample [s]; most: evaluations after which a flight counts as lost;
    nodes on the backbone."""

    tolerance: float
    sample: float
    most: int
    nodes: int


DRAWS = Accuracy(1e-5, 4e-3, 40_000, 5)
"""For random vehicles: errors of some percent, in Test D more."""

REFINEMENT = Accuracy(1e-6, 4e-3, 60_000, 5)

# Most vehicles fail in the first of these.
_ORDER = "BACD"

_EXPONENT = 8.0


def log_ratios(
    pairs: Sequence[Pair],
    accuracy: Accuracy,
    limit: float = np.inf,
    metrics: Sequence[int] = tuple(range(len(METRICS))),
) -> Array:
    """Return |ln(ours / printed)| (pairs, metrics, 2, 4), rows T and R, columns Tests A to D.

    inf where a flight ends early or a number is 0 or has no range. limit: a pair that exceeds it
    under each of `metrics`, places in METRICS, is not flown further: NaN in the tests left.
    """
    counted = list(metrics)
    found = np.full((len(pairs), len(METRICS), 2, len(OPEN_LOOP_TESTS)), np.nan)
    alive = list(range(len(pairs)))
    for test in _ORDER:
        if not alive:
            break
        column = OPEN_LOOP_TESTS.index(test)
        flown = _of_test([pairs[index] for index in alive], test, accuracy)
        for index, off in zip(alive, flown, strict=True):
            found[index, :, :, column] = off
        alive = [i for i in alive if not largest(found[i, counted]).min() > limit]
    return found


def largest(logs: Array) -> Array:
    """Return the largest of log ratios (..., 2, 4), over the tests that were flown."""
    return np.fmax.reduce(logs, axis=(-2, -1))


def objective(logs: Array) -> Array:
    """Return the 8-norm of log ratios (..., 2, 4), a smooth maximum; inf where a test is missing.

    To nine decimals, so that rounding errors decide nothing between two vehicles.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        value = np.sum(logs**_EXPONENT, axis=(-2, -1)) ** (1.0 / _EXPONENT)
    return np.where(np.isfinite(value), np.round(value, 9), np.inf)


def _of_test(pairs: Sequence[Pair], test: str, accuracy: Accuracy) -> list[Array]:
    """Log ratios (metrics, 2) of one test; flights that pairs share are flown once."""
    jobs: dict[tuple[object, ...], Job] = {}
    wanted = []
    for vehicle, reading in pairs:
        keys = []
        for model in ("coupled", reading.decoupled):
            # Only Test D has a tip force; what the decoupled model is concerns that model alone.
            sign = reading.force_sign if test == "D" else None
            alike = reading.replace(decoupled="element", force_sign=-1).dynamics
            keys.append((id(vehicle), alike, sign, model))
            jobs.setdefault(keys[-1], Job(vehicle, reading, test, model))
        wanted.append((keys[0], keys[1]))
    flights = fly(
        list(jobs.values()),
        tolerance=accuracy.tolerance,
        sample=accuracy.sample,
        most=accuracy.most,
        nodes=accuracy.nodes,
    )
    seen = {key: _tips(job, f) for (key, job), f in zip(jobs.items(), flights, strict=True)}
    printed = PRINTED[:, OPEN_LOOP_TESTS.index(test)]
    known = {keys: _off(seen[keys[0]], seen[keys[1]], printed) for keys in dict.fromkeys(wanted)}
    return [known[keys] for keys in wanted]


def _tips(job: Job, flight: Flight) -> Tips | None:
    """The tip along a flight, None of one that ends early."""
    if flight.status != FLOWN:
        return None
    return tips(PrintedModel(job.vehicle, job.reading), flight)


def _off(coupled: Tips | None, other: Tips | None, printed: Array) -> Array:
    """Log ratios (metrics, 2) of one test to its printed numbers (2,)."""
    if coupled is None or other is None:
        return np.full((len(METRICS), 2), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.abs(np.log(numbers(coupled, other) / printed))
    return np.where(np.isnan(off), np.inf, off)
