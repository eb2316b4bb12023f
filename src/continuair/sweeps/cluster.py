"""Units of a sweep on a Dask cluster whose workers see the same store."""

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
# The threads of a worker share the store, opened once.
_preparing = threading.Lock()


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A client of the scheduler at an address; raises InputError if it does not answer."""
    checks.installed("distributed", "cluster")
    import dask.config
    from distributed import Client

    if address.startswith("tls:") and not dask.config.get("distributed.comm.tls.client.cert", None):
        raise InputError(
            f"scheduler is {shown(address)}, but Dask knows no certificate of this client; name it "
            "with DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT and __KEY, and the CA_FILE."
        )
    try:
        client = Client(address, timeout=_ANSWER_WITHIN, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"scheduler is {shown(address)}, which does not answer ({type(error).__name__}); start "
            "one with 'dask scheduler', and give the address that it prints."
        ) from None
    with _quiet(), client:
        yield client


@contextmanager
def _quiet() -> Iterator[None]:
    """Leave out what Dask logs of a scheduler that goes away: what it means is said in a sentence.

    Its loggers have levels of their own, so that the one above them is not enough.
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
    """Have the workers compute units; units of workers that go away are given to others."""
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
                # Cancelled, as all of them are where the scheduler has ended: there is no error.
                raise InputError(
                    f"scheduler is {shown(address)}, which has ended or cancelled the sweep; "
                    "start it again, and repeat the command to go on."
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
    """The store, open, and the kernels for it, compiled."""
    try:
        store = open_store(Path(path), device)
        check(store.design, device)
    except InputError as error:
        raise error.within(f"worker {platform.node()}: ") from None
    return store
