"""Launches the kernels over a batch: on the CPU split over threads, on CUDA in one launch."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.engine.factory import kernels
from continuair.engine.pack import pack
from continuair.errors import InputError, shown
from continuair.kernels.observe import OBSERVED
from continuair.vehicle.layout import Layout


@cache
def start_warp() -> None:
    """Initialise Warp without its banner, and without its warning that there is no CUDA driver."""
    wp.config.log_level = wp.LOG_ERROR
    # The native library warns on its own about a missing CUDA driver, past Warp's log level.
    kept = os.dup(2)
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
        try:
            wp.init()
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def check_device(device: str) -> None:
    """Raise InputError unless the device can be launched on."""
    start_warp()
    cards = [found.alias for found in wp.get_cuda_devices()]
    valid = ["cpu", *(["cuda"] if cards else []), *cards]
    if device not in valid:
        raise InputError(f"device is {shown(device)}; use one of {', '.join(valid)}.")


@dataclass(frozen=True)
class Logs:
    """log, observed, watched (runs, samples, columns), the last two where asked for; status and
    last_step (runs,)."""

    log: np.ndarray
    status: np.ndarray
    last_step: np.ndarray
    observed: np.ndarray | None = None
    watched: np.ndarray | None = None


class Engine:
    """One vehicle or batch, packed for one model, precision and device.

    `layout` names the columns of its states, inputs and logs. beside: an engine of the coupled
    model for the same vehicle, from which another model's takes what they share.
    """

    def __init__(
        self,
        vehicle,
        model: str,
        precision="float64",
        device="cpu",
        threads=None,
        beside: Engine | None = None,
    ):
        start_warp()
        self.vehicle = vehicle
        self.layout = Layout(vehicle.sections)
        self.kernels = kernels(precision, vehicle.sections, model)
        self.dtype = np.dtype(precision)
        self.device = device
        self.threads = threads or os.cpu_count() or 1
        coupled = None if beside is None else beside.table
        self.plants, table = pack(vehicle, self.kernels.code, self.threads, coupled)
        self.table: np.ndarray = table.astype(self.dtype)

    def roll_out(
        self,
        start,
        angle,
        grid,
        inputs,
        sample_inputs,
        gravity,
        groups,
        observe,
        first=0,
        initial=None,
    ) -> Logs:
        """Roll out every run of `start` (runs, state); `inputs` is (table, rows-per-time flag).

        angle: (runs,) initial ψa [rad], naming the signed branch of the bend. sample_inputs: the
        same pair at the sample times, for what is observed. first: index of the first run in the
        batch of vehicles. initial: what `independent` freezes, if that is not the start.
        """
        runs, samples = len(start), len(grid.samples)
        log = np.full((runs, samples, self.layout.log), np.nan, self.dtype)
        status, last = np.zeros(runs, np.int32), np.zeros(runs, np.int32)
        observed = np.full((runs, samples, OBSERVED), np.nan, self.dtype) if observe else None
        steps = self._upload(grid.steps)
        after = self._upload(grid.sample_after, wp.int32)

        def work(part: slice) -> None:
            plants, table = self._vehicles(slice(first + part.start, first + part.stop))
            out = self._upload(log[part])
            ends = [self._upload(a[part], wp.int32) for a in (status, last)]
            drive = [self._inputs(inputs[0], part), 3 * inputs[1], groups, gravity]
            frozen = start if initial is None else initial
            whence = [plants, table, *map(self._upload, (frozen[part], start[part], angle[part]))]
            self._fly(part, first, [*whence, *drive], [steps, after], [out, *ends])
            self._download(out, log[part])
            for source, target in zip(ends, (status, last), strict=True):
                self._download(source, target[part])
            if observed is not None:
                seen = self._upload(observed[part])
                wp.launch(
                    self.kernels.observe,
                    dim=seen.shape[:2],
                    device=self.device,
                    inputs=[
                        plants,
                        table,
                        out,
                        self._inputs(sample_inputs[0], part),
                        sample_inputs[1],
                        groups,
                        gravity,
                        seen,
                    ],
                )
                self._download(seen, observed[part])

        self._split(runs, work)
        return Logs(log, status, last, observed)

    def _fly(self, part: slice, first: int, start: list[Any], grid: list[Any], results: list[Any]):
        """Launch the roll-out of a part of the runs: start and inputs, time grid, results."""
        wp.launch(
            self.kernels.rollout,
            dim=results[0].shape[0],
            device=self.device,
            inputs=[*start, *grid, *results],
        )

    def _load_modules(self) -> None:
        """Compile and load what a roll-out launches."""
        for kernel in (self.kernels.rollout, self.kernels.observe):
            kernel.module.load(self.device)

    def observe(self, log, inputs, gravity, groups) -> np.ndarray:
        """Observed columns (runs, samples, OBSERVED) of logged rows (runs, samples, log)."""
        seen = np.full((*log.shape[:2], OBSERVED), np.nan, self.dtype)
        plants, table = self._vehicles(slice(None))
        out = self._upload(seen)
        wp.launch(
            self.kernels.observe,
            dim=log.shape[:2],
            device=self.device,
            inputs=[
                plants,
                table,
                self._upload(log),
                self._upload(inputs[0]),
                inputs[1],
                groups,
                gravity,
                out,
            ],
        )
        self._download(out, seen)
        return seen

    def derivative(self, states, angle, inputs, gravity, groups, initial=None) -> np.ndarray:
        """Rates of states, both (runs, state), under one row of inputs (1, runs or 1, inputs)."""
        states = np.ascontiguousarray(states, self.dtype)
        rates = np.empty((len(states), self.layout.state), self.dtype)
        plants, table = self._vehicles(slice(None))
        out = self._upload(rates)
        wp.launch(
            self.kernels.derivative,
            dim=len(states),
            device=self.device,
            inputs=[
                plants,
                table,
                self._upload(states if initial is None else initial),
                self._upload(states),
                self._upload(angle),
                self._upload(inputs),
                groups,
                gravity,
                out,
            ],
        )
        self._download(out, rates)
        return rates

    def _vehicles(self, part: slice | np.ndarray):
        shared = len(self.plants) == 1
        plants = self.plants if shared else self.plants[part]
        table = self.table if shared else self.table[part]
        code = self.kernels.code
        return (
            wp.array(plants, dtype=code.Plant, device=self.device),
            wp.array(np.ascontiguousarray(table), dtype=code.Row, device=self.device),
        )

    def _inputs(self, table, part: slice):
        return self._upload(table if table.shape[1] == 1 else table[:, part])

    def _upload(self, array, dtype=None):
        kind = dtype or (wp.float64 if self.dtype == np.float64 else wp.float32)
        host = np.int32 if dtype else self.dtype
        return wp.array(
            np.ascontiguousarray(array, host),
            dtype=kind,
            device=self.device,
            copy=self.device != "cpu",
        )

    def upload_vectors(self, rows):
        """Vectors (n, 3) as the kernels take them."""
        rows = np.ascontiguousarray(rows, self.dtype)
        return wp.array(rows, dtype=self.kernels.code.vec3, device=self.device)

    def _download(self, source, target) -> None:
        if self.device != "cpu":
            target[...] = source.numpy()

    def _split(self, runs: int, work) -> None:
        parts = min(self.threads, runs) if self.device == "cpu" else 1
        if parts == 1:
            work(slice(0, runs))
            return
        edges = np.linspace(0, runs, parts + 1).astype(int)
        # Compiling is not thread-safe: load the modules before the threads start.
        self._load_modules()
        with ThreadPoolExecutor(parts) as pool:
            list(pool.map(work, map(slice, edges[:-1], edges[1:])))
