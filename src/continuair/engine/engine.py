"""Launches of kernels over a batch: on the CPU split over threads, on CUDA in one launch."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Collection, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import warp as wp

from continuair import checks
from continuair.engine.compiling import block_of, load, start_warp
from continuair.engine.factory import Kernels, kernels
from continuair.engine.lanes import packs_of, struct_rows, table_rows
from continuair.engine.pack import Coefficients, pack_plants, tree_of
from continuair.engine.packs import lanes_of
from continuair.engine.rows import adjacent, forget_unreached
from continuair.engine.term_checks import check_terms
from continuair.engine.uncompiled import MOST_SAMPLES, few_columns, few_rates
from continuair.errors import InputError, shown
from continuair.kernels.dynamics import PARTLY_COUPLED, WITHOUT
from continuair.vehicle.layout import width_of
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

MOST_THREADS = 4096
"""Most threads of a flight."""


def check_threads(threads: Any) -> None:
    """Raise InputError unless a number of threads can be used; None is that of the processors."""
    if threads is not None:
        checks.whole("threads", threads, 1, MOST_THREADS)


def check_device(device: object) -> None:
    """Raise InputError if kernels cannot be launched on a device."""
    if not isinstance(device, str):
        raise InputError("device", f"is {shown(device)}", "give its name, such as 'cpu'")
    start_warp()
    cards = [found.alias for found in wp.get_cuda_devices()]
    if device.startswith("cuda") and not cards:
        raise InputError("device", f"is {shown(device)}, but no CUDA device was found", "use 'cpu'")
    valid = ["cpu", *(["cuda"] if cards else []), *cards]
    if device not in valid:
        raise InputError("device", f"is {shown(device)}", f"use one of {', '.join(valid)}")


@dataclass(frozen=True)
class Start:
    """Initial conditions of runs.

    states (runs, state); angle (runs, sections + 3): ψa of the signed branches of the bends, roll,
    pitch and yaw; frozen: states that the model "independent" freezes, if they differ.
    """

    states: Array
    angle: Array
    frozen: Array | None = None


@dataclass(frozen=True)
class Drive:
    """Inputs as a table (rows, runs or 1, inputs), bits of the groups in use, and gravity [m/s²].

    timed: whether the table has three rows per step (or one per sample), not one for all times.
    """

    table: Array
    timed: bool
    groups: int
    gravity: float


@dataclass(frozen=True)
class Logs:
    """Results of a roll-out.

    log, observed, watched (runs, samples, columns), the last two if requested; status, last_step
    (runs,); saturation (runs,): maximum over rotors and steps; scene: of the camera.
    """

    log: Array
    status: Array
    last_step: Array
    saturation: Array
    observed: Array | None = None
    watched: Array | None = None
    scene: Any = None


class Closing(Protocol):
    """Closed loop of a roll-out: a `Loop` of engine/loop.py."""

    @property
    def scene(self) -> Any:
        """Return the scene of the camera, or None."""

    def on(self, engine: Any, runs: int) -> Any:
        """Return the loop packed for an engine and a number of runs."""

    def watch(self, engine: Any, log: Array, runs: Array) -> Array | None:
        """Return camera and image features along logged rows of some runs."""


class Engine:
    """One vehicle or batch, packed for one model, precision and device.

    `layout` gives the columns of its states, inputs and logs. beside: an engine of the coupled
    model for the same vehicle, whose packed data another model's engine shares. method: integrator
    of roll-outs, by its name in kernels/integrators.py.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        model: str,
        precision: str = "float64",
        device: str = "cpu",
        threads: int | None = None,
        beside: Engine | None = None,
        method: str = "RK4",
    ) -> None:
        start_warp()
        omitted = WITHOUT.get(model)
        self.vehicle, self.method = vehicle, method
        self.model = model if omitted is None else PARTLY_COUPLED
        self.tree = tree_of(vehicle)
        if vehicle.terms:
            check_terms(self.tree)
        self.layout = self.tree.layout
        self.kernels = kernels(precision, self.tree, self.model, method=method)
        self.dtype: np.dtype[Any] = np.dtype(precision)
        self.device = device
        self.threads = threads or os.cpu_count() or 1
        if beside is not None and beside.dtype == self.dtype:
            self.plants: Array = beside.plants
        else:
            self.plants = pack_plants(vehicle, self.kernels.types.Plant)
        if omitted is not None:
            self.plants = self.plants.copy()
            self.plants["omitted"][:, omitted] = 1.0
        own = Coefficients(vehicle, self.threads) if beside is None else beside.coefficients
        self.coefficients: Coefficients = own
        self.observed = self.layout.observed
        whole = own.whole
        self._table = None if whole is None else whole.astype(self.dtype, copy=False)
        self._packed: dict[int, Any] = {}

    @property
    def table(self) -> Array:
        """The coefficients (vehicles, rows, columns) of all vehicles."""
        return self.table_of(slice(None))

    def table_of(self, at: slice | Array) -> Array:
        """Return the coefficients (n, rows, columns) of some vehicles, by their indices."""
        if self._table is not None:
            return self._table[at]
        return self.coefficients.of(at).astype(self.dtype, copy=False)

    def on_one_thread(self) -> Engine:
        """Return the same engine for one thread, which may run beside others."""
        alone = copy.copy(self)
        alone.threads = 1
        return alone

    def load_rollout(self, loop: Closing | None, runs: int) -> int:
        """Load the kernel that so many runs fly with, before threads wait for it.

        Returns the number of runs that a thread simulates at once.
        """
        closed = None if loop is None else loop.on(self, runs)
        lanes = self.lanes(runs) if closed is None else closed.kernels.lanes
        used = self.kernels_of(lanes)
        rollout = used.rollout if closed is None else closed.kernels.rollout
        load(rollout, self.device)
        return int(lanes)

    def side_by_side(self, work: Callable[[Any], None], parts: Iterable[Any]) -> None:
        """Process every part, on all threads of the engine."""
        parts = list(parts)
        threads = min(self.threads, len(parts)) if self.device == "cpu" else 1
        if threads == 1:
            for part in parts:
                work(part)
            return
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, parts))

    def roll_out(
        self,
        runs: Array,
        start: Start,
        grid: Any,
        drive: Drive,
        *,
        at_samples: Drive | None = None,
        names: Collection[str] = (),
        loop: Closing | None = None,
        among: int = 0,
    ) -> Logs:
        """Simulate some runs over a time grid, in open loop or under a control law.

        runs: (n,) indices into the vehicles, and into the loop's runs; start, drive: of these runs.
        at_samples: what acts at the samples, to observe the named columns too. among: the runs of
        the whole flight, if these are a part.
        """
        n, samples = len(runs), len(grid.samples)
        log = np.empty((n, samples, self.layout.log), self.dtype)
        status, last = np.zeros(n, np.int32), np.zeros(n, np.int32)
        saturation = np.zeros((n, 1), self.dtype)
        closed = None if loop is None else loop.on(self, n)
        lanes = self.load_rollout(loop, n)
        used = self.kernels_of(lanes)
        rollout = used.rollout if closed is None else closed.kernels.rollout
        steps = self.steps(grid)

        def work(part: slice) -> None:
            vehicles = self.vehicles(runs[part], used)
            out = self.upload(log[part])
            ends = [self.upload(each[part], wp.int32) for each in (status, last)]
            ends.append(self.upload(saturation[part]))
            begin, acting = self.start(start, part), self.drive(drive, part, 3)
            flown = self.no_loop() if closed is None else closed.struct(self, runs[part])
            threads = packs_of(len(out), lanes)
            self.launch(rollout, threads, [vehicles, begin, acting, steps, flown, out, *ends])
            self.download(out, log[part])
            for source, target in zip(ends, (status, last, saturation), strict=True):
                self.download(source, target[part])

        self.side_by_side(work, self._split(n, lanes))
        observed = None if at_samples is None else self.observe(log, at_samples, names, runs, among)
        for each in (log, observed) if observed is not None else (log,):
            forget_unreached(each, status, last, grid.sample_after)
        found = Logs(log, status, last, saturation[:, 0], observed)
        if loop is None:
            return found
        return replace(found, watched=loop.watch(self, log, runs), scene=loop.scene)

    @property
    def observed_columns(self) -> int:
        """The number of columns that are observed."""
        return width_of(self.observed)

    def observe(
        self,
        log: Array,
        drive: Drive,
        names: Collection[str],
        runs: Array | None = None,
        among: float = 0,
    ) -> Array:
        """Return observed columns (runs, samples, columns) of logged rows (runs, samples, log).

        drive: inputs of these runs at the samples. names: of the columns that are needed; others
        may be NaN. Python computes those of a few rows: of all the runs that they are `among`, so
        that a flight in parts is treated alike. A loop that observes over and over is among inf.
        """
        few = max(among, len(log)) * log.shape[1] <= MOST_SAMPLES
        found = few_columns(self, log, drive, names, runs) if few else None
        if found is not None:
            return found
        lanes = self.lanes(len(log))
        used = self.kernels_of(lanes)
        observers = used.observers(names)
        for kernel in observers:
            load(kernel, self.device)
        seen = np.full((*log.shape[:2], self.observed_columns), np.nan, self.dtype)
        every = np.arange(len(log)) if runs is None else runs

        def work(part: slice) -> None:
            out, acting = self.upload(seen[part]), self.drive(drive, part, 1)
            rows = [self.vehicles(every[part], used), acting, self.upload(log[part]), out]
            for kernel in observers:
                self.launch(kernel, (packs_of(len(seen[part]), lanes), log.shape[1]), rows)
            self.download(out, seen[part])

        self.side_by_side(work, self._split(len(log), lanes))
        return seen

    def derivative(
        self, start: Start, drive: Drive, runs: Array | None = None, compiled: bool = False
    ) -> Array:
        """Return the rates (runs, state) of the states of a start, under the first row of inputs.

        Python computes those of a few states, unless they are to be `compiled`, as loops need them.
        """
        found = None if compiled else few_rates(self, start, drive, runs)
        if found is not None:
            return found
        rates = np.empty((len(start.states), self.layout.state), self.dtype)
        # One kernel for any number of runs: steps depend on these rates.
        used = self.kernels_for(1)
        out, acting = self.upload(rates), self.drive(drive, slice(None), 0)
        arguments = [self.vehicles(runs, used), self.start(start, slice(None)), acting, out]
        self.launch(used.derivative, packs_of(len(rates), used.lanes), arguments)
        self.download(out, rates)
        return rates

    def kernels_for(self, runs: int) -> Kernels:
        """Return the kernels for a number of runs: on the CPU those of packs."""
        return self.kernels_of(self.lanes(runs))

    def kernels_of(self, lanes: int) -> Kernels:
        """Return the kernels of packs with `lanes` runs, or of single runs."""
        return kernels(self.dtype.name, self.tree, self.model, lanes, self.method)

    def lanes(self, runs: int) -> int:
        """Return how many of a number of runs a thread simulates at once."""
        return lanes_of(runs, self.threads, self.dtype.name, self.device)

    def vehicles(self, runs: Array | slice | None, found: Kernels) -> Any:
        """Return the struct of the vehicles of some runs, or of all, for given kernels."""
        out = found.structs.Vehicles()
        at = slice(None) if runs is None or len(self.plants) == 1 else runs
        at = at if isinstance(at, slice) else adjacent(at)
        if isinstance(at, slice) and at == slice(None):
            return self._all_vehicles(found)
        out.plants = struct_rows(self.plants[at], found.types.Plant, found.lanes, self.device)
        out.coefficients = table_rows(self.table_of(at), found.types.Row, found.lanes, self.device)
        return out

    def _all_vehicles(self, found: Kernels) -> Any:
        if found.lanes not in self._packed:
            out = found.structs.Vehicles()
            out.plants = struct_rows(self.plants, found.types.Plant, found.lanes, self.device)
            out.coefficients = table_rows(self.table, found.types.Row, found.lanes, self.device)
            self._packed[found.lanes] = out
        return self._packed[found.lanes]

    def start(self, start: Start, part: slice | Array) -> Any:
        """Return the struct of initial conditions for a part of the runs."""
        found = self.kernels.arguments.Start()
        found.states = self.upload(self.with_rotors(start.states[part])[:, None])
        # Unless told otherwise, each model freezes what it does not integrate at the start.
        frozen = start.frozen
        if frozen is None:
            found.frozen = found.states
        else:
            found.frozen = self.upload(self.with_rotors(frozen[part])[:, None])
        found.angle = self.upload(start.angle[part])
        return found

    def with_rotors(self, states: Array) -> Array:
        """States, in which rotors are at rest where they tell nothing of rotors."""
        missing = self.layout.state - states.shape[1]
        return np.pad(states, ((0, 0), (0, missing))) if missing else states

    def drive(self, drive: Drive, part: slice | Array, rows: int) -> Any:
        """Return the struct of inputs of a part of the runs; rows: per step or sample."""
        table = drive.table if drive.table.shape[1] == 1 else drive.table[:, part]
        found = self.kernels.arguments.Drive()
        found.inputs = self.upload(table)
        found.stride = rows * drive.timed
        found.groups, found.gravity = drive.groups, drive.gravity
        return found

    def steps(self, grid: Any) -> Any:
        """Return the struct of a grid's steps."""
        found = self.kernels.arguments.Steps()
        found.starts, found.lengths = self.upload(grid.starts), self.upload(grid.steps)
        found.sample_after = self.upload(grid.sample_after, wp.int32)
        return found

    def no_loop(self) -> Any:
        """Return the struct of a loop without a control law."""
        return self.kernels.pilot.Loop()

    def launch(self, kernel: wp.Kernel, size: Any, arguments: list[Any]) -> None:
        """Launch a kernel on this engine's device."""
        load(kernel, self.device)
        block = block_of(self.device)
        wp.launch(kernel, dim=size, device=self.device, inputs=arguments, block_dim=block)

    def upload(self, array: Any, kind: Any = None) -> Any:
        """Return numbers of this engine's precision, or of another kind, on its device."""
        real = wp.float64 if self.dtype == np.float64 else wp.float32
        host = np.int32 if kind else self.dtype
        return wp.array(
            np.ascontiguousarray(array, host),
            dtype=kind or real,
            device=self.device,
            copy=self.device != "cpu",
        )

    def download(self, source: Any, target: Array) -> None:
        """Copy an uploaded array back to the host; on the CPU both share memory."""
        if self.device != "cpu":
            target[...] = source.numpy()

    def _split(self, runs: int, lanes: int) -> list[slice]:
        """Return a part of the runs for every thread, in whole packs."""
        packs = packs_of(runs, lanes)
        parts = min(self.threads, packs) if self.device == "cpu" else 1
        edges = np.minimum(lanes * np.linspace(0, packs, parts + 1).astype(int), runs)
        return [slice(*ends) for ends in zip(edges[:-1], edges[1:], strict=True)]
