"""Flies several models of the same runs side by side, and keeps only how far apart they end up."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from continuair.engine.engine import Engine
from continuair.engine.factory import deviation
from continuair.kernels.deviations import DEVIATIONS, POSE

# What the logged tips of one block of runs take at most: on the CPU they stay near the core.
_BLOCK_BYTES = {"cpu": 1.6e7, "cuda": 4e9}
_BLOCKS_PER_THREAD = 4


@dataclass(frozen=True)
class Flight:
    """What a set of runs shares: their indices (n,), the time grid, and the inputs over it.

    inputs: table (rows, n or 1, inputs), columns in the order of `runs`, and its rows-per-time
    flag.
    """

    runs: np.ndarray
    grid: Any
    inputs: tuple[np.ndarray, int]


class Pairs:
    """Results of all runs and models: deviations (runs, models, 5) from the first model, tip
    (runs, models, 7) at the end, status and last_step (runs, models)."""

    def __init__(self, engines: Sequence[Engine], runs: int) -> None:
        self.engines = engines
        shape = (runs, len(engines))
        self.deviations = np.full((*shape, len(DEVIATIONS)), np.nan)
        self.tip = np.full((*shape, POSE), np.nan)
        self.status, self.last_step = np.zeros(shape, np.int32), np.zeros(shape, np.int32)

    def fly(self, flight: Flight, start, angle, gravity: float, groups: int) -> None:
        """Fly the runs of a flight; start (runs, state) and angle (runs,) are of all runs."""
        first = self.engines[0]
        for engine in self.engines:
            engine.kernels.tip_rollout.module.load(first.device)
        deviation(first.dtype.name).module.load(first.device)
        table = flight.inputs[0]

        def work(part: slice) -> None:
            runs = flight.runs[part]
            columns = table if table.shape[1] == 1 else table[:, part]
            drive = [first._upload(columns), 3 * flight.inputs[1], groups, gravity]
            at = first._upload(start[runs])
            # Each model freezes what it does not integrate at the start.
            whence = [at, at, first._upload(angle[runs])]
            self._fly_block(runs, flight.grid, whence, drive)

        blocks = _blocks(len(flight.runs), flight.grid, len(self.engines), first)
        if len(blocks) == 1:
            work(blocks[0])
            return
        with ThreadPoolExecutor(first.threads if first.device == "cpu" else 1) as pool:
            list(pool.map(work, blocks))

    def _fly_block(self, runs: np.ndarray, grid, whence: list[Any], drive: list[Any]) -> None:
        first = self.engines[0]
        steps, after = first._upload(grid.steps), first._upload(grid.sample_after, wp.int32)
        logs = []
        for column, engine in enumerate(self.engines):
            log = wp.empty((len(runs), len(grid.samples), POSE), wp.float64, device=first.device)
            ends = [wp.zeros(len(runs), wp.int32, device=first.device) for _ in range(2)]
            wp.launch(
                engine.kernels.tip_rollout,
                dim=len(runs),
                device=first.device,
                inputs=[*engine._vehicles(runs), *whence, *drive, steps, after, log, *ends],
            )
            logs.append(log)
            self.status[runs, column], self.last_step[runs, column] = (a.numpy() for a in ends)
            self._compare(runs, column, logs)

    def _compare(self, runs: np.ndarray, column: int, logs: list[Any]) -> None:
        first, log = self.engines[0], logs[column]
        found = wp.zeros((len(runs), len(DEVIATIONS)), wp.float64, device=first.device)
        if column > 0:
            wp.launch(
                deviation(first.dtype.name),
                dim=len(runs),
                device=first.device,
                inputs=[logs[0], log, found],
            )
        # What a run has not reached, its log does not hold.
        flown = self.status[runs, column] == 0
        both = flown & (self.status[runs, 0] == 0)
        self.deviations[runs[both], column] = found.numpy()[both]
        self.tip[runs[flown], column] = log[:, log.shape[1] - 1].numpy()[flown]


def _blocks(runs: int, grid, models: int, engine: Engine) -> list[slice]:
    """Parts of the runs that are flown at once: as many as fit, and some for every thread."""
    kind = engine.device.split(":")[0]
    most = int(_BLOCK_BYTES[kind] / (8 * POSE * models * len(grid.samples)))
    if kind == "cpu" and engine.threads > 1:
        most = min(most, -(-runs // (_BLOCKS_PER_THREAD * engine.threads)))
    size = max(1, most)
    return [slice(at, min(at + size, runs)) for at in range(0, runs, size)]
