"""A 50 s letter at a control rate of 1 kHz, and a batch of 1,000 gain sets on one and two threads.

Run with `make bench`; extra_info holds microseconds per control sample, and the batch's speed-up.
"""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.controllers.gain_files import load_gains
from continuair.scenario.tracking_task import SETTINGS, equipped, task

DURATION, PERIOD, GAIN_SETS = 50.0, 1e-3, 1000
VEHICLE = equipped(ca.load_vehicle("paper"), SETTINGS["nominal"])
MODELS = ("coupled", "decoupled", "independent")


def fly(controller: ca.Controller, duration: float, **options: Any) -> xr.Dataset:
    scenario = task(VEHICLE, ["M"], controller, DURATION)
    return ca.simulate(
        VEHICLE, scenario, duration=duration, sample=duration, variables=["position"], **options
    )


@pytest.mark.parametrize("model", MODELS)
def test_a_letter(benchmark: Any, model: str) -> None:
    law = load_gains("paper").controller(VEHICLE)
    flight = benchmark.pedantic(
        lambda: fly(law, DURATION, model=model, threads=1), rounds=7, warmup_rounds=1
    )
    assert (flight["status"] == 0).all()
    steps = DURATION / PERIOD
    benchmark.extra_info["us_per_sample"] = 1e6 * benchmark.stats.stats.median / steps


def test_a_batch_of_gain_sets_scales_with_threads(benchmark: Any) -> None:
    rates = np.linspace(4.0, 9.0, GAIN_SETS)
    laws = ca.stack([ca.servoing(**ca.design(VEHICLE, float(rate))) for rate in rates])
    times: dict[int, list[float]] = {1: [], 2: []}
    fly(laws, 0.1)
    for _ in range(3):
        for threads, values in times.items():
            start = perf_counter()
            fly(laws, 2.0, threads=threads)
            values.append(perf_counter() - start)
    one, two = (float(np.median(values)) for values in times.values())
    benchmark.extra_info["speed_up_on_2_threads"] = one / two
    benchmark.pedantic(lambda: fly(laws, 2.0, threads=2), rounds=3)
