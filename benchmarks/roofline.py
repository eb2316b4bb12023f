"""Arithmetic per step against what this machine can do: writes docs/explanation/roofline.md.

    python benchmarks/roofline.py

Operations are counted by benchmarks/counting.py from the kernels' own source, the machine's peaks
are measured by benchmarks/peaks.py, and steps by their processor time, shortest of repeats that
alternate between all models. benchmarks/roofline.json holds the figures.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from time import perf_counter, process_time, strftime
from typing import Any

import numpy as np
import roofline_page
from counting import counted
from machine import described_machine
from peaks import copied_bytes_per_second, flops_per_second

import continuair as ca
from continuair.engine.compiling import start_warp
from continuair.engine.engine import Engine

ROOT = Path(__file__).parents[1]
MODELS = ("coupled", "decoupled", "independent")
STEP, STEPS, REPEATS = 1e-4, 20_000, 15
WIDE = {"float64": 8, "float32": 16}
"""Numbers per vector of 64 bytes; narrower machines take two or more operations for one."""
DISKS = (0, 10, 100)
BATCHES = (1, 4, 16, 64, 256, 1024)


def fly(vehicle: ca.Vehicle, model: str, steps: int, threads: int = 1, **options: Any) -> None:
    """The free flight of the benchmarks, keeping one sample."""
    weight = (0.0, 0.0, 9.81 * float(np.mean(vehicle.mass)))
    q, qd = (0, 0, 5, 0, 0, 0, 0.1, 0), (0, 0, 0, 0.1, 0.1, 0.1, 0, 0)
    ca.simulate(
        vehicle,
        ca.Scenario("free flight", q, qd, force=weight, duration=STEP * steps),
        model=model,
        method="RK4",
        step=STEP,
        sample=STEP * steps,
        variables=("position",),
        threads=threads,
        **options,
    )


def shortest_per_step(cases: dict[Any, Any], repeats: int = REPEATS) -> dict[Any, float]:
    """Processor time per step [s] of flights (vehicle, model, options).

    Of a long flight less that of a short one, so that packing and launching do not count.
    """
    best: dict[Any, list[float]] = {name: [np.inf, np.inf] for name in cases}
    for _ in range(repeats + 1):
        for name, (vehicle, model, options) in cases.items():
            for i, steps in enumerate((1, STEPS + 1)):
                begin = process_time()
                fly(vehicle, model, steps, **options)
                best[name][i] = min(best[name][i], process_time() - begin)
    return {name: (long - short) / STEPS for name, (short, long) in best.items()}


def disks() -> list[dict[str, float]]:
    """Per number of disks: time per step, and of packing the vehicle on the host."""
    plain = ca.load_vehicle("paper")
    vehicles = {}
    for count in DISKS:
        positions = np.linspace(0.01, 1.0, count)
        each = [{"position": float(s), "mass": 1e-4, "inertia": [1e-9, 2e-9]} for s in positions]
        vehicles[count] = plain.replace({"arm.disks": each})
    steps = shortest_per_step({n: (v, "coupled", {}) for n, v in vehicles.items()})
    found = []
    for count, vehicle in vehicles.items():
        times = []
        for _ in range(REPEATS):
            begin = process_time()
            Engine(vehicle, "coupled")
            times.append(process_time() - begin)
        found.append({"disks": count, "step": steps[count], "packing": min(times)})
    return found


def batches() -> list[dict[str, float]]:
    """Per size of a batch: shortest time on the clock per run and step, on one and all threads."""
    cores, found = len(os.sched_getaffinity(0)), []
    for runs in BATCHES:
        vehicle = ca.load_vehicle("paper").replace({"uav.mass": np.linspace(1.0, 3.0, runs)})
        steps, row = max(1000, 200_000 // runs), {"runs": runs}
        for threads in dict.fromkeys((1, cores)):
            best = np.inf
            for _ in range(5):
                begin = perf_counter()
                fly(vehicle, "coupled", steps, threads)
                best = min(best, perf_counter() - begin)
            row[str(threads)] = best / steps / runs
        found.append(row)
    return found


def main() -> None:
    start_warp()
    precisions = {"float64": {}, "float32": {"dtype": "float32"}}
    plain = ca.load_vehicle("paper")
    steps = shortest_per_step(
        {(m, p): (plain, m, options) for m in MODELS for p, options in precisions.items()}
    )
    result = {
        "when": strftime("%Y-%m-%d"),
        "machine": described_machine(),
        "counts": {model: counted(model) for model in MODELS},
        "seconds": {p: {m: steps[m, p] for m in MODELS} for p in precisions},
        "peaks": {
            p: {"scalar": flops_per_second(p, 1), "vector": flops_per_second(p, lanes)}
            for p, lanes in WIDE.items()
        },
        "copy": copied_bytes_per_second(),
        "disks": disks(),
        "batches": batches(),
    }
    (ROOT / "benchmarks" / "roofline.json").write_text(json.dumps(result, indent=1) + "\n")
    roofline_page.write(result, ROOT / "docs")


if __name__ == "__main__":
    main()
