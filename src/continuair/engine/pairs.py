"""Roll-outs of several models of the same runs, which keep only their deviations."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from continuair.engine.adaptive import Launch, Tolerance
from continuair.engine.compiling import kind_of, load, load_together
from continuair.engine.engine import Drive, Engine, Start
from continuair.engine.factory import Kernels, deviation, turning
from continuair.engine.lanes import packs_of
from continuair.kernels.adaptive import COUNTS, REACHED, SATURATION
from continuair.kernels.step import OK
from continuair.vehicle.following import unfollowed
from continuair.vehicle.layout import DEVIATIONS, EULER_DEVIATIONS, TIP_POSE, width_of

Array = np.ndarray

POSE = width_of(TIP_POSE)
_ATTITUDE = TIP_POSE["attitude"]
_EULER = [DEVIATIONS.index(name) for name in EULER_DEVIATIONS]

# Largest size of the logged tips of a block of runs [bytes]: on the CPU they stay in the cache.
_BLOCK_BYTES = {"cpu": 1.6e7, "cuda": 4e9}
_BLOCKS_PER_THREAD = 4


class Pairs:
    """Results of all runs and models.

    deviations (runs, models, 5) from the first model, NaN for Euler angles that the samples cannot
    follow; tip (runs, models, 7), the final pose; status, last_step (runs, models); saturation
    (runs, models), the maximum over rotors.
    """

    def __init__(self, engines: Sequence[Engine], runs: int) -> None:
        self.engines = engines
        shape = (runs, len(engines))
        self.deviations = np.full((*shape, len(DEVIATIONS)), np.nan)
        self.tip = np.full((*shape, POSE), np.nan)
        self.status, self.last_step = np.zeros(shape, np.int32), np.zeros(shape, np.int32)
        self.saturation = np.zeros(shape)

    def fly(self, runs: Array, start: Start, grid: Any, drive: Drive) -> None:
        """Simulate some runs, by their indices, on one time grid; start, drive: of these runs."""
        first = self.engines[0]
        flown = [engine.kernels_for(len(runs)) for engine in self.engines]
        for kernels in flown:
            load(kernels.tip_rollout, first.device)
        compared = deviation(first.dtype.name, flown[0].lanes), turning(first.dtype.name)
        for kernel in compared:
            load(kernel, first.device)

        def work(part: slice) -> None:
            begin, acting = first.start(start, part), first.drive(drive, part, 3)
            self._fly_block(runs[part], flown, grid, begin, acting)

        blocks = _blocks(len(runs), flown[0].lanes, len(grid.samples), len(self.engines), first)
        if len(blocks) == 1:
            work(blocks[0])
            return
        with ThreadPoolExecutor(first.threads if first.device == "cpu" else 1) as pool:
            list(pool.map(work, blocks))

    def _fly_block(
        self, runs: Array, flown: list[Kernels], grid: Any, start: Any, drive: Any
    ) -> None:
        first = self.engines[0]
        steps, logs, followed = first.steps(grid), [], []
        threads = packs_of(len(runs), flown[0].lanes)
        for column, (engine, kernels) in enumerate(zip(self.engines, flown, strict=True)):
            log = wp.empty((len(runs), len(grid.samples), POSE), wp.float64, device=first.device)
            ends = [wp.zeros(len(runs), wp.int32, device=first.device) for _ in range(2)]
            begins = [engine.vehicles(runs, kernels), start, drive, steps, engine.no_loop()]
            saturation = wp.zeros((len(runs), 1), wp.float64, device=first.device)
            engine.launch(kernels.tip_rollout, threads, [*begins, log, *ends, saturation])
            logs.append(log)
            self.status[runs, column], self.last_step[runs, column] = (a.numpy() for a in ends)
            self.saturation[runs, column] = saturation.numpy()[:, 0]
            followed.append(self._followed(self.status[runs, column] == 0, log))
            both = followed[0] & followed[column]
            self._compare(runs, column, logs, both, kernels.lanes)

    def _followed(self, flown: Array, log: Any) -> Array:
        """Return which complete runs (runs,) have samples that follow the tip's Euler angles."""
        first, found = self.engines[0], wp.zeros(len(flown), wp.int32, device=log.device)
        first.launch(turning(first.dtype.name), len(flown), [log, found])
        followed, (in_doubt,) = np.array(flown), np.nonzero(flown & (found.numpy() > 0))
        if len(in_doubt):
            chosen: Any = wp.array(in_doubt, dtype=wp.int32, device=log.device)
            rows = wp.indexedarray(log, [chosen]).numpy()[..., _ATTITUDE]
            followed[in_doubt] = ~unfollowed(rows).any(axis=1)
        return followed

    def _compare(
        self, runs: Array, column: int, logs: list[Any], followed: Array, lanes: int
    ) -> None:
        first, log = self.engines[0], logs[column]
        found = wp.zeros((len(runs), len(DEVIATIONS)), wp.float64, device=first.device)
        if column > 0:
            kernel = deviation(first.dtype.name, lanes)
            first.launch(kernel, packs_of(len(runs), lanes), [logs[0], log, found])
        # The log of a run that stopped early is incomplete.
        flown = self.status[runs, column] == 0
        both = flown & (self.status[runs, 0] == 0)
        deviations = found.numpy()
        # Equal attitudes have no deviation, on any branch of their angles.
        lost = ~followed & (deviations[:, _EULER[-1]] != 0.0)
        deviations[np.ix_(lost, _EULER)] = np.nan
        self.deviations[runs[both], column] = deviations[both]
        self.tip[runs[flown], column] = log[:, log.shape[1] - 1].numpy()[flown]


class ControlledPairs(Pairs):
    """Pairs with adaptive steps.

    In addition to `Pairs`: end_time (runs, models) [s]; counts (runs, models, COUNTS); distance
    (runs, models), the largest distance of the tip from that of a second run, if there is one [m],
    inf if the two end with different status.
    """

    def __init__(self, engines: Sequence[Engine], runs: int) -> None:
        super().__init__(engines, runs)
        shape = (runs, len(engines))
        self.counts = np.zeros((*shape, COUNTS))
        self.end_time, self.distance = np.zeros(shape), np.full(shape, np.nan)

    def fly_controlled(self, launch: Launch, finer: Tolerance | None) -> None:
        """Simulate some runs with all models; finer: the tolerance of second runs, if any."""
        first, n = self.engines[0], len(launch.runs)
        flown = [engine.kernels_for(n) for engine in self.engines]
        compared = deviation(first.dtype.name, flown[0].lanes), turning(first.dtype.name)
        needed = [*(kernels.tip_rollout for kernels in flown), *compared]
        load_together(needed, first.device)
        for kernel in needed:
            load(kernel, first.device)
        order = launch.order(first, flown[0].tip_rollout, flown[0].lanes, POSE)
        launch = launch.of_runs(order)
        copies = len(self.engines) + 2 * (finer is not None)
        blocks = _blocks(n, flown[0].lanes, len(launch.ticks.samples), copies, first)

        def work(part: slice) -> None:
            self._fly_part(launch.of_runs(np.arange(n)[part]), finer, flown)

        with ThreadPoolExecutor(first.threads if first.device == "cpu" else 1) as pool:
            list(pool.map(work, blocks))

    def _fly_part(self, launch: Launch, finer: Tolerance | None, flown: list[Kernels]) -> None:
        runs, logs, followed = launch.runs, [], []
        end = launch.ticks.times[-1]
        for column, (engine, kernels) in enumerate(zip(self.engines, flown, strict=True)):
            log, status, counts = self._flown(launch, engine, kernels)
            logs.append(log)
            self.status[runs, column], self.counts[runs, column] = status, counts
            self.end_time[runs, column] = np.where(status == OK, end, counts[:, REACHED])
            self.saturation[runs, column] = counts[:, SATURATION]
            if finer is not None:
                again, ended, _ = self._flown(replace(launch, tolerance=finer), engine, kernels)
                apart = (log.numpy() - again.numpy())[..., TIP_POSE["position"]]
                largest = np.nanmax(np.linalg.norm(apart, axis=-1), axis=1, initial=0.0)
                self.distance[runs, column] = np.where(status == ended, largest, np.inf)
            followed.append(self._followed(status == OK, log))
            both = followed[0] & followed[column]
            self._compare(runs, column, logs, both, kernels.lanes)

    def _flown(self, launch: Launch, engine: Engine, kernels: Kernels) -> tuple[Any, Array, Array]:
        shape = (len(launch.runs), len(launch.ticks.samples), POSE)
        log = wp.full(shape, np.nan, wp.float64, device=engine.device)
        return log, *launch.on(engine, kernels.tip_rollout, kernels.lanes, log)


def _blocks(runs: int, lanes: int, samples: int, models: int, engine: Engine) -> list[slice]:
    """Return blocks of runs: each fits into memory, and every thread gets several."""
    kind = kind_of(engine.device)
    most = int(_BLOCK_BYTES[kind] / (8 * POSE * models * samples))
    if kind == "cpu" and engine.threads > 1:
        most = min(most, -(-runs // (_BLOCKS_PER_THREAD * engine.threads)))
    size = lanes * max(1, most // lanes)
    return [slice(at, min(at + size, runs)) for at in range(0, runs, size)]
