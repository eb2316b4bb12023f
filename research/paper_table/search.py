"""The search for vehicles and readings that give Table I: random draws, then refinement."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from amiri2026.table.reading import Reading
from amiri2026.table.study import READING
from continuair import checks
from continuair.errors import InputError
from continuair.progress import Progress
from research.paper_table.evolution import adapt
from research.paper_table.flights import DRAWS, REFINEMENT, Pair, largest, log_ratios, objective
from research.paper_table.readings import DECOUPLED, FORCE_SIGNS, METRICS, others_drawn
from research.paper_table.space import Design, drawn

Array = np.ndarray

_CHUNK = 16

_SPREAD = 0.08
"""Standard deviation of the first generation of a refinement, in shares."""

_REJECTED = float(np.log(3.0))
"""A drawn vehicle is not flown further once no metric can bring it within a factor of 3."""

LITERAL = next(i for i, metric in enumerate(METRICS) if READING.replace(**metric) == READING)
"""Place in METRICS of the metric of Table I."""


@dataclass(frozen=True)
class Effort:
    """How long to search.

    draws: random vehicles. starts: how many of them to refine under any reading, and as many under
    that of Table I. population and generations: of each refinement.
    """

    draws: int = 256
    starts: int = 3
    population: int = 16
    generations: int = 25

    def __post_init__(self) -> None:
        for name, least in (("draws", 1), ("starts", 0), ("population", 4), ("generations", 1)):
            checks.whole(name, getattr(self, name), least)

    @classmethod
    def times(cls, factor: int) -> Effort:
        """Return the default effort, several times over in draws and starts."""
        plain = cls()
        return cls(draws=factor * plain.draws, starts=factor * plain.starts)


@dataclass(frozen=True)
class Candidate:
    """A vehicle under a reading: its objective, and its factor as `study.factor` has it."""

    objective: float
    factor: float
    design: Design
    reading: Reading


@dataclass
class Search:
    """What a search has found so far.

    pairs: the best candidate of every vehicle under every kind of flight that it made to the end.
    literal: the candidates under the reading of Table I. by_reading: the best of every reading.
    vehicles: how many were flown. drawn: of those drawn, the least factor under any reading, and
    under that of Table I; inf where no number came of it.
    """

    seed: int
    effort: Effort
    pairs: list[Candidate] = field(default_factory=list)
    literal: list[Candidate] = field(default_factory=list)
    by_reading: dict[Reading, Candidate] = field(default_factory=dict)
    vehicles: int = 0
    drawn: list[tuple[float, float]] = field(default_factory=list)
    interrupted: bool = False

    def note(self, design: Design, dynamics: Reading, logs: Array) -> list[Candidate]:
        """Keep what a vehicle's log ratios (metrics, 2, 4) say; return its candidates."""
        values, factors = objective(logs), np.exp(largest(logs))
        found = [
            Candidate(float(value), float(factor), design, dynamics.replace(**metric))
            for metric, value, factor in zip(METRICS, values, factors, strict=True)
            if np.isfinite(value)
        ]
        self.pairs += ranked(found)[:1]
        self.literal += [candidate for candidate in found if candidate.reading == READING]
        for candidate in found:
            known = self.by_reading.setdefault(candidate.reading, candidate)
            if candidate.objective < known.objective:
                self.by_reading[candidate.reading] = candidate
        return found


def ranked(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return candidates, the best one first; of equals the one that was found first."""
    return sorted(candidates, key=lambda candidate: candidate.objective)


def search(effort: Effort, seed: int, progress: Progress | None = None) -> Search:
    """Search from random vehicles; an interruption (Ctrl-C) returns what was found.

    The same seed and effort give the same result on one machine. Raises InputError for a seed that
    is no whole number from 0 on, and if no drawn vehicle is within a factor of 3.
    """
    checks.whole("seed", seed, 0)
    found = Search(seed, effort)
    tell = progress or (lambda done, total, what: None)
    try:
        _draw(found, tell)
        if not found.pairs:
            raise InputError(
                "draws", f"is {effort.draws}, of which none is within a factor of 3", "draw more"
            )
        starts = _starts(found)
        for number, (start, metrics) in enumerate(starts):
            _refine(found, start, metrics, (number, len(starts)), tell)
    except KeyboardInterrupt:
        if not found.pairs:
            raise
        found.interrupted = True
    return found


def _draw(found: Search, tell: Progress) -> None:
    """Fly random vehicles under all meanings of decoupled, both signs and every metric.

    The other choices are those of Table I for every second vehicle, and drawn for the rest.
    """
    rng, draws = np.random.default_rng(found.seed), found.effort.draws
    for first in range(0, draws, _CHUNK):
        tell(first, draws, "flying random vehicles")
        pairs = [(drawn(rng), others_drawn(rng)) for _ in range(first, min(first + _CHUNK, draws))]
        designs = [design for design, _ in pairs]
        others = [other if place % 2 else READING for place, (_, other) in enumerate(pairs)]
        wanted = [
            (place, others[place].replace(decoupled=decoupled, force_sign=sign))
            for place, decoupled, sign in product(range(len(designs)), DECOUPLED, FORCE_SIGNS)
        ]
        logs = log_ratios([(designs[i].vehicle, r) for i, r in wanted], DRAWS, _REJECTED)
        least = np.full((len(designs), 2), np.inf)
        for (place, dynamics), off in zip(wanted, logs, strict=True):
            for candidate in found.note(designs[place], dynamics, off):
                columns = [0, 1] if candidate.reading == READING else [0]
                least[place, columns] = np.minimum(least[place, columns], candidate.factor)
        found.drawn += [(float(anyhow), float(literal)) for anyhow, literal in least]
        found.vehicles += len(designs)


def _starts(found: Search) -> list[tuple[Candidate, list[int]]]:
    """Where refinements begin, and the places in METRICS of the metrics that count there."""
    count = found.effort.starts
    distinct = {id(each.design): each for each in reversed(ranked(found.pairs))}
    anyhow = [(start, list(range(len(METRICS)))) for start in ranked(distinct.values())]
    literal = [(start, [LITERAL]) for start in ranked(found.literal)]
    return anyhow[:count] + literal[:count]


def _refine(
    found: Search, start: Candidate, metrics: list[int], place: tuple[int, int], tell: Progress
) -> None:
    """Adapt the shares of a start under its reading's flights; the best of `metrics` counts."""
    effort, limit, generation, best = found.effort, np.inf, 0, start.factor

    def cost(rows: Array) -> Array:
        nonlocal limit, generation, best
        done = place[0] * effort.generations + generation
        tell(done, place[1] * effort.generations, f"refining: factor {best:.3f}")
        designs = [Design(row, start.design.material) for row in rows]
        pairs: list[Pair] = [(design.vehicle, start.reading) for design in designs]
        logs = log_ratios(pairs, REFINEMENT, limit, metrics)
        for design, off in zip(designs, logs, strict=True):
            found.note(design, start.reading, off)
        found.vehicles += len(rows)
        generation += 1
        counted = logs[:, metrics]
        finished = ~np.isnan(counted).any(axis=(2, 3))
        best = min(best, float(np.exp(largest(counted)[finished].min(initial=np.inf))))
        # A pair that was not flown to the end is at least as far off as in the tests it flew.
        values = np.where(finished, objective(counted), np.round(largest(counted), 9)).min(axis=1)
        # Vehicles beyond the median do not enter the mean, so that those of the next generation
        # which are worse need no further flights.
        limit = float(np.median(values))
        return values

    adapt(
        cost,
        start.design.shares,
        spread=_SPREAD,
        population=effort.population,
        generations=effort.generations,
        seed=found.seed,
    )
