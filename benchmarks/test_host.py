"""What the host adds to the kernels: a short flight, a large batch that keeps all, gain sets.

Run with `make bench`; extra_info holds the seconds of the kernels, summed over threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import thread_time
from typing import Any

import numpy as np
import pytest
import warp as wp
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.sweeps.assembly import batches
from continuair.sweeps.design import load_design

BATCH, GAIN_SETS = 4096, 1000
TEST = open_loop_test("A")
KEPT: dict[str, dict[str, Any]] = {
    "all variables": {},
    "one variable": {"variables": ["tip_position"], "sample": 1e-2},
}


@contextmanager
def kernel_seconds() -> Iterator[list[float]]:
    """Processor's time of every launch while this is open [s]."""
    spent: list[float] = []
    launch: Callable[..., Any] = wp.launch

    def timed(*args: Any, **named: Any) -> None:
        begin = thread_time()
        launch(*args, **named)
        spent.append(thread_time() - begin)

    wp.launch = timed
    try:
        yield spent
    finally:
        wp.launch = launch


def test_a_short_flight(benchmark: Any) -> None:
    vehicle = ca.load_vehicle("paper")
    options: dict[str, Any] = {"duration": 0.05, "variables": ["tip_position"]}
    benchmark.pedantic(
        lambda: ca.simulate(vehicle, TEST, **options), rounds=50, iterations=5, warmup_rounds=2
    )


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("kept", KEPT)
def test_a_batch(benchmark: Any, kept: str, threads: int) -> None:
    vehicle = ca.load_vehicle("paper").replace({"uav.mass": np.linspace(1.0, 3.0, BATCH)})

    def fly() -> xr.Dataset:
        return ca.simulate(vehicle, TEST, threads=threads, **KEPT[kept])

    with kernel_seconds() as spent:
        benchmark.pedantic(fly, rounds=3, warmup_rounds=1)
    benchmark.extra_info["kernel_seconds"] = sum(spent) / 4.0


@pytest.mark.parametrize("vehicles", [1, GAIN_SETS])
def test_gain_sets_are_designed(benchmark: Any, vehicles: int) -> None:
    rng, runs = np.random.default_rng(0), np.arange(GAIN_SETS)

    def made() -> tuple[Any, Any]:
        # Of new vehicles each time, as what is known of others is at hand.
        varied = {"controller.bandwidth": ("sample", rng.uniform(4.0, 9.0, GAIN_SETS))}
        if vehicles > 1:
            varied["vehicle.uav.mass"] = ("sample", rng.uniform(1.5, 3.0, GAIN_SETS))
        attributes: dict[str, Any] = {"controller": {}, "target": {}, "step": 1e-3}
        return (load_design(xr.Dataset(varied, attrs=attributes)),), {}

    benchmark.pedantic(lambda design: list(batches(design, runs)), setup=made, rounds=5)
