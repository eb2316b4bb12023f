"""Execution of sweeps: remaining units, where they are computed, and the result."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from continuair import checks
from continuair.engine.engine import check_device, check_threads
from continuair.errors import InputError, shown
from continuair.files import user_path
from continuair.progress import Progress
from continuair.sweeps.design import Design, load_design
from continuair.sweeps.results import open_sweep
from continuair.sweeps.units import check, compute, unit_size

# zarr and Dask are optional, and imported where needed.
if TYPE_CHECKING:
    from continuair.sweeps.store import Store


def sweep(
    design: str | os.PathLike[str] | xr.Dataset | Design,
    out: str | os.PathLike[str],
    *,
    metrics: Iterable[str] | None = None,
    device: str = "cpu",
    threads: int | None = None,
    scheduler: str | None = None,
    shard: tuple[int, int] = (1, 1),
    repair: bool = False,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate all runs of a design, or those that remain, into a store.

    Parameters
    ----------
    design : str, path, xarray.Dataset or Design
        A TOML file, or a Dataset whose variables are fields (docs/howto/sweeps.md).
    out : str or path
        The zarr store. One of the same design is continued.
    metrics : iterable of str, optional
        Metrics to keep instead of the design's.
    device : str, optional
        "cpu", "cuda", or one of several, such as "cuda:1".
    threads : int, optional
        CPU threads. Default: all.
    scheduler : str, optional
        Address of a Dask scheduler whose workers can access `out`.
    shard : tuple of int, optional
        (i, n): compute the i-th of n parts, counted from 1.
    repair : bool, optional
        Recompute damaged units of the store, and rewrite its description. Otherwise damage is an
        error.
    progress : callable, optional
        Called with (done, total, description).

    Returns
    -------
    xarray.Dataset
        Results as of `open_sweep`.

    Raises
    ------
    InputError
        If an argument cannot be used; nothing is written then.
    """
    checks.installed("zarr", "sweep")
    path = user_path("out", out).absolute()
    found = load_design(design, metrics)
    part, parts = _checked_shard(shard)
    check_threads(threads)
    report = progress or (lambda done, total, what: None)
    device = "cuda:0" if device == "cuda" else device
    # The workers of a cluster may have a device that this machine lacks.
    here = "cpu" if scheduler is not None and device.startswith("cuda") else device
    check_device(here)
    with _client(scheduler) as client:
        store = _opened(path, found, device, here, repair, report)
        damaged = store.damaged()
        if repair:
            store.forget(damaged)
        else:
            store.refuse(damaged)
        mine = range(part - 1, store.units, parts)
        done = store.done()
        left = [unit for unit in mine if not done[unit]]
        count = _Count(len(mine) - len(left), len(mine), report)
        if client is not None:
            from continuair.sweeps.cluster import compute_on

            compute_on(client, store, left, device, count)
        elif left:
            # Compile before the threads start, which would all wait for it.
            check(found, here)
            _compute_here(store, left, device, threads, count)
        if store.done().all():
            store.clean()
    return open_sweep(path)


class _Count:
    """Count finished units, and report each."""

    def __init__(self, done: int, total: int, report: Progress) -> None:
        self.done, self.total, self.report = done, total, report
        report(done, total, "units")

    def __call__(self) -> None:
        self.done += 1
        self.report(self.done, self.total, "units")


@contextmanager
def _client(scheduler: str | None) -> Iterator[Any]:
    """Yield a client of a scheduler, or None without one."""
    if scheduler is None:
        yield None
        return
    from continuair.sweeps.cluster import connected

    with connected(scheduler) as client:
        yield client


def _opened(
    path: Path, design: Design, device: str, here: str, repair: bool, report: Progress
) -> Store:
    """Return the store at a path; a new one is created after the design is checked."""
    from continuair.sweeps.making import check_new, create, renew
    from continuair.sweeps.store import DamagedStore, is_store, open_store

    if not is_store(path):
        check_new(path, design, unit_size(design, device))
        report(0, 1, "checking the design")
        check(design, here)
        create(path, design, device)
    try:
        return open_store(path, device, design)
    except DamagedStore:
        if not repair:
            raise
        renew(path, design, device)
        return open_store(path, device, design)


def _compute_here(
    store: Store, units: list[int], device: str, threads: int | None, done: Callable[[], None]
) -> None:
    """Compute units in parallel, so that one is prepared or written while another is simulated."""
    threads = threads or os.cpu_count() or 1
    # A GPU computes one unit at a time.
    side_by_side = min(threads, len(units)) if device == "cpu" else 1

    def work(unit: int) -> None:
        """Compute and store a unit."""
        runs = store.runs(unit)
        store.write(unit, compute(store.design, runs, device, threads // side_by_side))

    with ThreadPoolExecutor(side_by_side) as pool:
        try:
            for unit in as_completed([pool.submit(work, unit) for unit in units]):
                unit.result()
                done()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _checked_shard(shard: tuple[int, int]) -> tuple[int, int]:
    """Return a pair (i, n) with i from 1 to n, or raise InputError."""
    pair = isinstance(shard, tuple) and len(shard) == 2 and all(map(checks.is_whole, shard))
    if not pair or not 1 <= shard[0] <= shard[1]:
        raise InputError("shard", f"is {shown(shard)}", "give (i, n) with i from 1 to n")
    return shard[0], shard[1]
