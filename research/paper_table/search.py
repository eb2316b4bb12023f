"""The search for the vehicle and the reading behind the paper's table: Sobol points under every
reading, then differential evolution of the most promising flights, then local refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from continuair.progress import Progress
from research.paper_table.evolution import adapt
from research.paper_table.flights import SEARCH, Accuracy
from research.paper_table.objective import evaluate, objective, read
from research.paper_table.readings import AS_PRINTED, READINGS, Reading
from research.paper_table.space import PARAMETERS, vehicles

Array = np.ndarray
Group = tuple[str, str, int]

_CHUNK = 128
_NEAR = 0.03
_FAR = 1e3
_CONFIRMED = 20


@dataclass(frozen=True)
class Effort:
    """How long to search.

    samples: Sobol points flown under every reading. evolved: how many of the eight kinds of
    flight (decoupled, arm, bend) to evolve. population and generations: of each. refined: how many
    readings to refine, each with half the population for twice the generations; the one as printed
    is refined in any case.
    """

    samples: int = 128
    evolved: int = 3
    population: int = 64
    generations: int = 30
    refined: int = 4

    @classmethod
    def times(cls, factor: int) -> Effort:
        """The default effort, several times over; the population stays."""
        plain = cls()
        return cls(
            samples=factor * plain.samples,
            evolved=factor * plain.evolved,
            generations=factor * plain.generations,
            refined=factor * plain.refined,
        )


@dataclass(frozen=True)
class Candidate:
    """A vehicle, as shares of the bounds of PARAMETERS, under a reading; its objective."""

    objective: float
    share: Array
    reading: Reading


@dataclass
class Search:
    """What a search has found so far.

    best: reading -> its best candidate. flights: vehicles flown, counted once per kind of flight.
    interrupted: whether it was stopped before its end.
    """

    seed: int
    effort: Effort
    best: dict[Reading, Candidate] = field(default_factory=dict)
    flights: int = 0
    interrupted: bool = False

    @property
    def ranking(self) -> list[Candidate]:
        """The best candidate of every reading, the best reading first."""
        return sorted(self.best.values(), key=lambda candidate: candidate.objective)

    def note(self, shares: Array, values: Array, readings: Sequence[Reading]) -> None:
        """Keep what is better than before: values (runs, readings) of rows of shares."""
        rows = np.argmin(values, axis=0)
        for index, (row, reading) in enumerate(zip(rows, readings, strict=True)):
            value = float(values[row, index])
            if value < (self.best[reading].objective if reading in self.best else np.inf):
                self.best[reading] = Candidate(value, shares[row].copy(), reading)


def search(effort: Effort, seed: int, progress: Progress | None = None) -> Search:
    """Search for the vehicle and the reading; an interruption (Ctrl-C) returns what was found.

    The same seed and effort give the same result on every machine: what rounding moves, some 1e-12
    of a number, decides nothing but by rare chance.
    """
    found = Search(seed, effort)
    tell = progress or (lambda done, total, what: None)
    try:
        points = _sample(found, tell)
        for group in _promising(found, effort.evolved):
            _evolve(found, group, points, tell)
        for candidate in _distinct(found, effort.refined):
            _refine(found, candidate, tell)
        if AS_PRINTED in found.best:
            _refine(found, found.best[AS_PRINTED], tell)
    except KeyboardInterrupt:
        if not found.best:
            raise
        found.interrupted = True
    return found


def group_of(reading: Reading) -> Group:
    """What distinguishes flights beside the tip force of Test D: decoupled, arm, bend."""
    flight = reading.flight
    return flight.decoupled, flight.arm, flight.bend


def _sample(found: Search, tell: Progress) -> Array:
    """Fly Sobol points under all readings; return them."""
    sampler = qmc.Sobol(len(PARAMETERS), seed=found.seed)
    points = sampler.random(1 << (found.effort.samples - 1).bit_length())
    points = points[: found.effort.samples]
    groups = {group_of(reading) for reading in READINGS}
    for first in range(0, len(points), _CHUNK):
        tell(first, len(points), "vehicles under every reading")
        part = points[first : first + _CHUNK]
        found.note(part, evaluate(part, READINGS, SEARCH), READINGS)
        found.flights += len(part) * len(groups)
    return points


def _promising(found: Search, count: int) -> list[Group]:
    groups = list(dict.fromkeys(group_of(candidate.reading) for candidate in found.ranking))
    return groups[:count]


def _evolve(found: Search, group: Group, points: Array, tell: Progress) -> None:
    """Differential evolution of the vehicle, at each point under the best reading of its group."""
    readings = [reading for reading in READINGS if group_of(reading) == group]
    effort, generation = found.effort, 0

    def cost(columns: Array) -> Array:
        shares = np.clip(columns.T, 0.0, 1.0)
        values = np.concatenate(
            [
                evaluate(shares[at : at + _CHUNK], readings, SEARCH)
                for at in range(0, len(shares), _CHUNK)
            ]
        )
        found.note(shares, values, readings)
        found.flights += len(shares)
        return np.minimum(values.min(1), _FAR)

    def next_generation(intermediate_result: Any) -> None:
        nonlocal generation
        generation += 1
        best = f"{' '.join(map(str, group))}: best {float(intermediate_result.fun):.3f}"
        tell(generation, effort.generations, best)

    known = [c.share for c in found.ranking if group_of(c.reading) == group]
    known = list({share.tobytes(): share for share in known}.values())[: effort.population // 2]
    start = np.concatenate([known, points])[: effort.population]
    missing = effort.population - len(start)
    more = np.random.default_rng(found.seed).random((max(missing, 0), len(PARAMETERS)))
    differential_evolution(
        cost,
        [(0.0, 1.0)] * len(PARAMETERS),
        strategy="currenttobest1bin",
        maxiter=effort.generations,
        init=np.concatenate([start, more]),
        mutation=(0.3, 0.9),
        recombination=0.8,
        tol=0.0,
        polish=False,
        seed=found.seed,
        vectorized=True,
        updating="deferred",
        callback=next_generation,
    )


def _distinct(found: Search, count: int) -> list[Candidate]:
    """The best candidates of different kinds of flight or metric."""
    seen: dict[Any, Candidate] = {}
    for candidate in found.ranking:
        key = (group_of(candidate.reading), candidate.reading.metric)
        seen.setdefault(key, candidate)
    return list(seen.values())[:count]


def _refine(found: Search, candidate: Candidate, tell: Progress) -> None:
    """Covariance matrix adaptation around a candidate, under its reading alone."""
    readings, effort, generation = [candidate.reading], found.effort, 0
    generations = 2 * effort.generations

    def cost(shares: Array) -> Array:
        nonlocal generation
        generation += 1
        best = found.best[candidate.reading].objective
        tell(generation, generations, f"refining {candidate.reading.metric}: {best:.3f}")
        values = evaluate(shares, readings, SEARCH)
        found.note(shares, values, readings)
        found.flights += len(shares)
        return values[:, 0]

    adapt(
        cost,
        candidate.share,
        spread=_NEAR,
        population=effort.population // 2,
        generations=generations,
        seed=found.seed,
    )


def confirm(found: Search, accuracy: Accuracy) -> tuple[Candidate, Array]:
    """The best candidate when flown accurately, and its numbers (2, 4)."""
    top = found.ranking[:_CONFIRMED]
    numbers = [read(vehicles(c.share[None]), [c.reading], accuracy)[0, 0] for c in top]
    values = [float(objective(n)) for n in numbers]
    best = int(np.argmin(values))
    return Candidate(values[best], top[best].share, top[best].reading), numbers[best]
