"""What a sweep costs beside its kernels, and whether its time is linear in the number of runs.

Prints, for each number of coupled/decoupled pairs of 1 s at 1 ms, the time of the whole sweep into
a store, of the roll-out kernels alone, their ratio, the ratio of the processor's time that both
took (which other work on the machine disturbs less), the time per run and the memory taken. Medians
of interleaved repetitions: python benchmarks/sweep_throughput.py [RUNS ...] [--repeat N]
"""

from __future__ import annotations

import argparse
import resource
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.flight.prepare import prepare

STEP = 1e-3
BLOCK = 1000


def design(runs: int) -> xr.Dataset:
    """Vehicles of a Latin hypercube over mass and radius, in Test A of the paper."""
    masses, radii = np.random.default_rng(0).uniform([1.0, 0.003], [3.0, 0.005], (runs, 2)).T
    variables = {"vehicle.uav.mass": ("sample", masses), "vehicle.arm.radius": ("sample", radii)}
    return xr.Dataset(variables, attrs={"scenario": {"test": "A"}, "step": STEP})


def now() -> np.ndarray:
    """Time on the clock, and of the processor [s]."""
    return np.array([perf_counter(), process_time()])


def kernel_seconds(runs: int) -> np.ndarray:
    """Times in which the roll-outs alone fly `runs` pairs, all threads busy."""
    block = min(runs, BLOCK)
    varied = design(block)
    fields = {str(name).removeprefix("vehicle."): varied[name].to_numpy() for name in varied}
    vehicle, scenario = ca.load_vehicle("paper").replace(fields), open_loop_test("A")
    flight = prepare(vehicle, scenario, step=STEP, sample=scenario.duration)
    (cohort,) = flight.cohorts()
    seconds = np.zeros(2)
    for model in ("coupled", "decoupled"):
        engine = flight.engine(model)
        begin = now()
        for _ in range(runs // block):
            cohort.fly(engine, observe=False)
        seconds += now() - begin
    return seconds


def sweep_seconds(runs: int) -> np.ndarray:
    varied = design(runs)
    with tempfile.TemporaryDirectory() as folder:
        begin = now()
        results = ca.sweep(varied, Path(folder) / "store.zarr")
        seconds = now() - begin
    assert results.attrs["done"] == runs and not results["status"].any()
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("runs", type=int, nargs="*", default=[1000, 10_000, 100_000])
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    sweep_seconds(BLOCK)  # compiles, and loads
    kernel_seconds(BLOCK)
    begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    columns = ("runs", "sweep [s]", "kernels [s]", "ratio", "CPU ratio", "us/run", "MiB")
    print("".join(f"{column:>12}" for column in columns))
    for runs in arguments.runs:
        times = [(sweep_seconds(runs), kernel_seconds(runs)) for _ in range(arguments.repeat)]
        (whole, _), (raw, _) = np.median(times, axis=0)
        ratio, cpu = np.median([whole / raw for whole, raw in times], axis=0)
        peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - begin) / 1024
        numbers = f"{whole:12.2f}{raw:12.2f}{ratio:12.2f}{cpu:12.2f}{1e6 * whole / runs:12.0f}"
        print(f"{runs:12}{numbers}{peak:12.0f}", flush=True)


if __name__ == "__main__":
    main()
