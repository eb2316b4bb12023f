"""Whether inputs that do not tell how fast they are move roughly, or unseen, in some steps.

A probe looks into steps that are spread over a flight (`probing.py`), and pulses hide between them.
Stages of all steps show where an input moves, and how smoothly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.engine.engine import Drive
from continuair.errors import InputError
from continuair.flight.inputs import evaluated, field_width
from continuair.flight.probing import GOLDEN, INSIDE, JUMP, PROBES, STAGES, largest, warn_of_unseen
from continuair.flight.steps import told_rate
from continuair.flight.time_grid import Grid
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import FIELDS, Layout

Array = np.ndarray

_ROUGH = 3e-3
"""Share of an input's largest value by which its mean over two steps differs from that by their
ends and the middle alone; that of a sine reaches it at seven steps per period."""

_LIVELIEST = _SPREAD = 8
"""Steps that are looked into: of those in which an input moves most, and spread over the flight."""


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

    def rough(self) -> Array:
        """Whether inputs move as no step follows at full order (n,), as where a pulse begins."""
        found = np.zeros(len(self.runs), bool)
        for name in self._untold():
            start, middle, end = self._stages(name)
            means = (start + 4.0 * middle + end) / 6.0
            doubled = (start[:-1] + 4.0 * end[:-1] + end[1:]) / 6.0
            steps, opens = self.grid.steps, self.grid.opens
            alike = np.isclose(steps[1:], steps[:-1], rtol=1e-6, atol=0.0) & ~opens[1:]
            whole = largest(np.abs([start, middle, end]).max(axis=(0, 1)))
            off = np.abs(0.5 * (means[:-1] + means[1:]) - doubled) / whole > _ROUGH
            # A bend in an input costs nothing where a step ends.
            curved = np.abs(start - 2.0 * middle + end) / whole > _ROUGH
            found |= (off & (curved[:-1] | curved[1:]))[alike].any(axis=(0, 2))
        return found

    def unseen(self, told: set[str], stacklevel: int) -> Array:
        """Whether inputs swing between the stages of steps beyond all that these show (n,).

        told: names of inputs that have been told of, which are not again; those found are added.
        """
        found = np.zeros(len(self.runs), bool)
        for name in self._untold():
            start, middle, end = self._stages(name)
            moved = np.abs(middle - start) + np.abs(end - middle)
            moved = (moved / largest(moved.max(axis=0))).max(axis=-1)
            spread = np.arange(_SPREAD) * GOLDEN % 1.0 * len(moved)
            for row in range(moved.shape[1]):
                liveliest = np.argsort(-moved[:, row], kind="stable")[:_LIVELIEST]
                looked = np.union1d(liveliest, spread.astype(int))
                shares = self._beyond(name, looked, row)
                if shares.max() <= JUMP:
                    continue
                found[row if moved.shape[1] > 1 else slice(None)] = True
                if name not in told:
                    told.add(name)
                    at = looked[int(np.argmax(shares))]
                    step, time = float(self.grid.steps[at]), float(self.grid.starts[at])
                    warn_of_unseen(name, float(shares.max()), step, time, stacklevel + 1)
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

    def _stages(self, name: str) -> Array:
        """Inputs of a field at start, middle and end of every step (3, steps, n or 1, columns)."""
        columns = np.r_[tuple(self.layout.of_input[each] for each in FIELDS[name])]
        table = self.drive.table.reshape(-1, 3, *self.drive.table.shape[1:])
        found = np.moveaxis(table[..., columns], 1, 0)
        if name != "rotor_command":
            return found
        highest = self.highest if len(self.highest) == 1 else self.highest[self.runs]
        return np.clip(found, 0.0, highest)

    def _beyond(self, name: str, steps: Array, row: int) -> Array:
        """By which share of the largest value an input goes beyond its stages (steps,) in them."""
        widths = self.grid.steps[steps] * (1.0 - 2.0 * INSIDE)
        starts = self.grid.starts[steps] + INSIDE * self.grid.steps[steps]
        width = field_width(name, self.layout)
        value: Any = getattr(self.scenario, name)
        try:
            stages, probes = (
                evaluated(name, value, (starts[:, None] + widths[:, None] * at).ravel(), width)
                for at in (STAGES, PROBES)
            )
        except InputError:
            # A function that fails off its stages alone is not one that can be looked at.
            return np.zeros(len(steps))
        run = self.runs[row] if stages.shape[1] > 1 else 0
        stages, probes = (x[:, run].reshape(len(steps), -1, width) for x in (stages, probes))
        over = np.maximum(probes.max(1) - stages.max(1), stages.min(1) - probes.min(1))
        whole = np.maximum(*(np.abs(x).max(axis=(0, 1)) for x in (stages, probes)))
        return np.asarray((over / largest(whole)).max(axis=-1))
