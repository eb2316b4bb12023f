"""Whether inputs that do not tell how fast they are move roughly, or unseen, in some steps.

A probe looks into steps that are spread over a flight (`probing.py`), and pulses hide between them.
Stages of all steps show where an input moves, and how smoothly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.engine.engine import Drive
from continuair.errors import InputError
from continuair.flight.inputs import evaluated, field_width, told_rate
from continuair.flight.probing import GOLDEN, INSIDE, PROBES, largest, of_stages, warn_of_unseen
from continuair.flight.time_grid import Grid
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import FIELDS, Layout

Array = np.ndarray

_ROUGH = 3e-3
"""Share of an input's largest value by which its mean over two steps differs from that by their
ends and the middle alone; that of a sine reaches it at seven steps per period."""

_OFF = 2e-4
"""Share of its largest value by which an input may be off the parabola through a step's stages: a
sine reaches it at 22 steps per period."""

_BEYOND = 0.05
"""Share by which it may go beyond all that the stages show, a sine at five steps per period."""

_FLAT, _OFTEN = 3.0, 8
"""How often what stages of a step show of an input an input may be off the parabola through them,
and in how many steps: a vibration in step with the stages, such as two periods a step, is nothing
at all of them, however small it is beside what is steady."""

_LIVELIEST, _SPREAD, _AT_ONCE = 8, 5000, 500
"""Steps that are looked into: of those in which a component of an input moves most, and spread over
the flight, which are all where it has no more; and so many at once."""

_TOGETHER = ("tau", "force")
"""Fields that add up in one column of what acts."""


@dataclass(frozen=True, eq=False)
class Pulses:
    """Looks at what drives some runs of a scenario over a time grid.

    scenario: with commands of rotors as they act; highest: the greatest (all runs or 1, 1) [N];
    runs: indices (n,) of those that are driven.
    """

    scenario: Scenario
    highest: Array
    layout: Layout
    drive: Drive
    grid: Grid
    runs: Array

    def found(self, told: set[str], stacklevel: int) -> tuple[Array, Array]:
        """Whether inputs move as no step follows at full order, as where a pulse begins, and
        whether they swing between the stages of steps beyond all that these show (n,) each.

        told: names of inputs that have been told of, which are not again; those found are added.
        """
        rough, unseen = np.zeros((2, len(self.runs)), bool)
        for name in self._untold():
            stages, worst = self._stages(name), (0.0, 0)
            whole, often = np.abs(stages).max(axis=(0, 1)), np.zeros(len(self.runs), int)
            counted = largest(whole, self._alike(name))
            rough |= self._is_rough(stages, counted)
            for steps in self._looked_into(stages, counted):
                own = np.flatnonzero(steps.any(axis=1))
                off, beyond, hidden = np.where(
                    steps[own], self._between(name, stages, own, whole), 0.0
                )
                rough |= (off > _OFF).any(axis=0)
                unseen |= (beyond > _BEYOND).any(axis=0)
                often += (hidden > 0.0).sum(axis=0)
                most = np.fmax(np.where(beyond > _BEYOND, beyond, 0.0), hidden).max(axis=1)
                worst = max(worst, (float(most.max()), int(own[most.argmax()])))
            unseen |= often >= _OFTEN
            if (worst[0] > _BEYOND or (often >= _OFTEN).any()) and name not in told:
                told.add(name)
                step, time = float(self.grid.steps[worst[1]]), float(self.grid.starts[worst[1]])
                warn_of_unseen(name, worst[0], step, time, stacklevel + 1)
        return rough, unseen

    def _is_rough(self, stages: Array, whole: Array) -> Array:
        """Whether means over two steps are not what their ends and middle give (n or 1,)."""
        start, middle, end = stages
        means = (start + 4.0 * middle + end) / 6.0
        doubled = (start[:-1] + 4.0 * end[:-1] + end[1:]) / 6.0
        steps, opens = self.grid.steps, self.grid.opens
        alike = np.isclose(steps[1:], steps[:-1], rtol=1e-6, atol=0.0) & ~opens[1:]
        off = np.abs(0.5 * (means[:-1] + means[1:]) - doubled) / whole > _ROUGH
        # A bend in an input costs nothing where a step ends.
        curved = np.abs(start - 2.0 * middle + end) / whole > _ROUGH
        found: Array = (off & (curved[:-1] | curved[1:]))[alike].any(axis=(0, 2))
        return found

    def _untold(self) -> list[str]:
        """Fields that are functions of time and do not tell how fast they are."""
        given = {name: getattr(self.scenario, name) for name in FIELDS}
        timed = self.drive.timed and len(self.grid.starts) > 1
        return [
            name
            for name, value in given.items()
            if timed and callable(value) and told_rate(value) is None
        ]

    def _alike(self, name: str) -> list[slice]:
        return self.layout.alike(FIELDS[name])

    def _stages(self, name: str) -> Array:
        """Inputs of a field at start, middle and end of every step (3, steps, n or 1, columns)."""
        if name in _TOGETHER and all(
            getattr(self.scenario, each) is not None for each in _TOGETHER
        ):
            # What is sampled is the sum of both.
            at = np.array([INSIDE, 0.5, 1.0 - INSIDE])
            return np.moveaxis(self._asked(name, np.arange(len(self.grid.starts)), at), 1, 0)
        columns = np.r_[tuple(self.layout.of_input[each] for each in FIELDS[name])]
        table = self.drive.table.reshape(-1, 3, *self.drive.table.shape[1:])
        found = np.moveaxis(table[..., columns], 1, 0)
        if name != "rotor_command":
            return found
        if self.scenario.controller is not None:
            # It adds to what that asks for, and limits cut off the sum.
            return found
        highest = self.highest if len(self.highest) == 1 else self.highest[self.runs]
        return np.clip(found, 0.0, highest)

    def _looked_into(self, stages: Array, whole: Array) -> Iterator[Array]:
        """Which steps are looked into (steps, n or 1), in parts."""
        count = len(self.grid.starts)
        found = np.zeros(stages.shape[1:3], bool)
        spread = np.arange(_SPREAD) * GOLDEN % 1.0 * count if count > _SPREAD else np.arange(count)
        found[spread.astype(int)] = True
        if count > _SPREAD:
            moved = np.abs(np.diff(stages, axis=0)).sum(axis=0) / whole
            for component in np.moveaxis(moved, -1, 0):
                liveliest = np.argpartition(component, count - _LIVELIEST, axis=0)
                np.put_along_axis(found, liveliest[count - _LIVELIEST :], True, axis=0)
        steps = np.flatnonzero(found.any(axis=1))
        for part in np.split(steps, range(_AT_ONCE, len(steps), _AT_ONCE)):
            chosen = np.zeros_like(found)
            chosen[part] = found[part]
            yield chosen

    def _between(self, name: str, stages: Array, steps: Array, whole: Array) -> Array:
        """Shares of the largest value by which an input is off the parabola through the stages of
        some steps, and beyond them, and is off where they show next to nothing of that
        (3, steps, n or 1).

        stages: of all steps (3, steps, n or 1, columns); whole: the largest of them.
        """
        at, stages = PROBES[steps % len(PROBES)], stages[:, steps]
        try:
            # Another place in every other step: no vibration is in step with both.
            probes = self._asked(name, steps, at[:, None])[:, 0]
        except checks.UnsteadyInput:
            raise
        except InputError:
            # A function that fails off its stages alone is not one that can be looked at.
            return np.zeros((3, len(steps), 1))
        off = np.abs(probes - np.einsum("sn,snrk->nrk", of_stages(at), stages))
        beyond = np.maximum(probes - stages.max(0), stages.min(0) - probes)
        most = largest(np.maximum(whole, np.abs(probes).max(0)), self._alike(name))
        shares = off / most
        hidden = np.where((shares > _OFF) & (off > _FLAT * np.ptp(stages, axis=0)), shares, 0.0)
        return np.stack([each.max(axis=-1) for each in (shares, beyond / most, hidden)])

    def _asked(self, name: str, steps: Array, at: Array) -> Array:
        """A field (steps, places, n or 1, columns) at some places within steps, as shares."""
        times = self.grid.starts[steps, None] + self.grid.steps[steps, None] * at
        value: Any = getattr(self.scenario, name)
        found = evaluated(name, value, times.ravel(), field_width(name, self.layout))
        if name == "tip_wrench":
            found = self.scenario.tip_wrench_sign * found
        found = found if found.shape[1] == 1 else found[:, self.runs]
        return found.reshape(*times.shape, *found.shape[1:])
