"""Units of a sweep on a Dask cluster whose workers share the store."""

from __future__ import annotations

import logging
import os
import platform
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from continuair import checks
from continuair.errors import InputError, shown
from continuair.sweeps.store import Store, open_store
from continuair.sweeps.units import check, compute

_ANSWER_WITHIN = 5.0  # seconds
# The threads of a worker share the store, which is opened once.
_preparing = threading.Lock()


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """Yield a client of the scheduler at an address; InputError if it does not answer."""
    checks.installed("distributed", "cluster")
    import dask.config
    from distributed import Client

    if address.startswith("tls:") and not dask.config.get("distributed.comm.tls.client.cert", None):
        raise InputError(
            "scheduler",
            f"is {shown(address)}, but this client has no certificate",
            "set DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT and __KEY, and the CA_FILE",
        )
    try:
        client = Client(address, timeout=_ANSWER_WITHIN, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            "scheduler",
            f"is {shown(address)}, which does not answer ({type(error).__name__})",
            "start 'dask scheduler', and give the address that it prints",
        ) from None
    with _quiet(), client:
        yield client


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress Dask's log messages about a scheduler that ends, which an error reports.

    Its loggers have levels of their own, so the parent's level is not enough.
    """
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    levels = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


def compute_on(
    client: Any, store: Store, units: list[int], device: str, done: Callable[[], None]
) -> None:
    """Compute units on the workers; units of workers that leave are resubmitted."""
    from distributed import as_completed

    address, left = client.scheduler.address, units
    while left:
        tasks = {
            client.submit(compute_unit, str(store.path), unit, device, pure=False): unit
            for unit in left
        }
        failed: dict[int, BaseException] = {}
        for task in as_completed(tasks, loop=client.loop):
            if task.status == "finished":
                done()
                continue
            error = task.exception()
            if error is None:
                # Cancelled without an error, as when the scheduler has ended.
                raise InputError(
                    "scheduler",
                    f"is {shown(address)}, which has ended or cancelled the sweep",
                    "restart it, and repeat the command to continue",
                )
            failed[tasks[task]] = error
            if isinstance(error, InputError):
                raise error
        if len(failed) == len(left):
            raise next(iter(failed.values()))
        left = sorted(failed)


def compute_unit(path: str, unit: int, device: str) -> None:
    """Compute a unit on a worker, and write it to the store."""
    from distributed import get_worker

    with _preparing:
        store = _prepared(path, device)
    if store.is_done(unit):
        return
    threads = max(1, (os.cpu_count() or 1) // get_worker().state.nthreads)
    store.write(unit, compute(store.design, store.runs(unit), device, threads))


@cache
def _prepared(path: str, device: str) -> Store:
    """Return the open store, with compiled kernels."""
    try:
        store = open_store(Path(path), device)
        check(store.design, device)
    except InputError as error:
        raise error.located(f"worker {platform.node()}") from None
    return store
