"""Steps per second on a CUDA device, for batches of 1 to 1,000,000 runs, and of its peak.

    python benchmarks/gpu.py [--device cuda] [--models coupled ...] [--runs 1 1000 ...] [--out FILE]

The roll-out kernel alone is timed, everything already on the card: every run has its own start, all
share one vehicle. Operations per step are counted by benchmarks/counting.py; the peak is that of
fused multiplications and additions, measured by benchmarks/peaks.py on the same card. Then whole
calls of `simulate`, of as many vehicles as runs, on the card and on all threads of the CPU beside
it. With --device cpu one thread is measured in the same way, to try the script. The figures of
docs/explanation/roofline.md are in benchmarks/gpu.json, which --out writes.
"""

from __future__ import annotations

import argparse
import json
import os
from datetime import date
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import warp as wp
from counting import counted
from peaks import copied_bytes_per_second, flops_per_second, shortest

import continuair as ca
from amiri2026 import open_loop_test
from continuair.engine.engine import Drive, Engine, Start, check_device
from continuair.errors import InputError
from continuair.flight.time_grid import grid_of, marks_of
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL

STEP = 1e-4
RUNS = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000)


def roll_out(engine: Engine, runs: int, steps: int) -> Any:
    """A call that flies a batch which lies on the device; statuses and log that it leaves there."""
    bend = np.random.default_rng(0).uniform(0.05, 0.5, runs)
    q, qd = np.zeros((runs, 8)), np.zeros((runs, 8))
    q[:, 6], qd[:, 3:6] = bend, 0.1
    grid = grid_of(marks_of(STEP * steps, STEP * steps), STEP)
    inputs = np.zeros((1, 1, engine.layout.inputs))
    inputs[0, 0, 2] = 9.81 * float(engine.vehicle.mass)
    real = getattr(wp, engine.dtype.name)
    begin = Start(state_from_paper(q, qd, engine.layout), branches_of(q, engine.layout))
    status, last = (wp.zeros(runs, wp.int32, device=engine.device) for _ in range(2))
    saturation = wp.zeros((runs, 1), real, device=engine.device)
    log = wp.zeros((runs, 2, engine.layout.log), real, device=engine.device)
    everything = slice(None)
    arguments = [
        *(engine.vehicles(everything, engine.kernels), engine.start(begin, everything)),
        *(engine.drive(Drive(inputs, False, GENERAL, 9.81), everything, 3), engine.steps(grid)),
        *(engine.no_loop(), log, status, last, saturation),
    ]

    def fly() -> None:
        engine.launch(engine.kernels.rollout, runs, arguments)

    return fly, status, log


def rates(device: str, model: str, dtype: str, sizes: list[int]) -> dict[str, Any]:
    """Steps per second for each size of a batch, printed as they are found."""
    engine = Engine(ca.load_vehicle("paper"), model, dtype, device)
    peak = flops_per_second(dtype, 1, device, 1 if device == "cpu" else 1 << 18)
    operations = counted(model)["flops"]
    print(
        f"\n{model}, {dtype}: {operations:.0f} operations per step, peak {peak / 1e12:.3g} Tflop/s"
    )
    print(f"{'runs':>9}{'steps':>8}{'M steps/s':>12}{'Tflop/s':>10}{'of peak':>9}")
    found = []
    for runs in sizes:
        steps = int(np.clip(20_000_000 // runs, 200, 20_000))
        fly, status, _ = roll_out(engine, runs, steps)
        rate = runs * steps / shortest(fly, device, 5)
        assert not status.numpy().any()
        print(
            f"{runs:>9}{steps:>8}{rate / 1e6:>12.4g}{rate * operations / 1e12:>10.3g}"
            f"{100 * rate * operations / peak:>8.1f} %",
            flush=True,
        )
        found.append({"runs": runs, "rate": rate})
    case = {"model": model, "dtype": dtype, "operations": operations, "peak": peak}
    return {**case, "batches": found}


def whole_call(device: str, dtype: str, runs: int) -> float:
    """Seconds of a second `simulate` of vehicles of as many masses: 1 s in steps of 1 ms."""
    vehicles = ca.load_vehicle("paper").replace({"uav.mass": np.linspace(1.0, 3.0, runs)})
    seconds = []
    for _ in range(2):
        begin = perf_counter()
        flown = ca.simulate(
            vehicles,
            open_loop_test("A"),
            duration=1.0,
            method="RK4",
            step=1e-3,
            sample=0.1,
            dtype=dtype,
            device=device,
        )
        seconds.append(perf_counter() - begin)
        assert not flown["status"].any()
    return seconds[-1]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--models", nargs="*", default=["coupled", "decoupled", "independent"])
    parser.add_argument("--runs", type=int, nargs="*", default=RUNS)
    parser.add_argument("--calls", type=int, nargs="*", default=[1_000, 10_000, 100_000])
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    try:
        check_device(arguments.device)
    except InputError as reason:
        raise SystemExit(f"not measured: {reason}") from None
    name = wp.get_device(arguments.device).name
    result: dict[str, Any] = {"device": name, "when": str(date.today()), "warp": wp.__version__}
    result |= {"cores": os.cpu_count(), "copy": copied_bytes_per_second(arguments.device, 2048)}
    print(json.dumps(result))
    result["cases"] = [
        rates(arguments.device, model, dtype, list(arguments.runs))
        for dtype in ("float64", "float32")
        for model in arguments.models
    ]
    result["calls"] = []
    for runs in arguments.calls:
        took = {where: whole_call(where, "float64", runs) for where in (arguments.device, "cpu")}
        print(f"simulate, {runs} vehicles, 1,000 steps: {took}", flush=True)
        result["calls"].append({"runs": runs, "device": took[arguments.device], "cpu": took["cpu"]})
    if arguments.out:
        arguments.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
