"""Steps per second on a CUDA device, for batches of 1 to 1,000,000 runs, and of its peak.

    python benchmarks/gpu.py [--device cuda] [--model coupled] [--runs 1 1000 ...]

The roll-out kernel alone is timed, everything already on the card: every run has its own start, all
share one vehicle. Operations per step are counted by benchmarks/counting.py; the peak is that of
fused multiplications and additions, measured by benchmarks/peaks.py on the same card. With
--device cpu one thread is measured in the same way, to try the script.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np
import warp as wp
from counting import counted
from peaks import flops_per_second, shortest

import continuair as ca
from continuair.engine.engine import Drive, Engine, Start, check_device
from continuair.errors import InputError
from continuair.flight.time_grid import grid_of, marks_of
from continuair.kernels.rollout import SUMS
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
    begin = Start(state_from_paper(q, qd), branches_of(q))
    status, last = (wp.zeros(runs, wp.int32, device=engine.device) for _ in range(2))
    errors = wp.zeros((runs, SUMS), real, device=engine.device)
    log = wp.zeros((runs, 2, engine.layout.log), real, device=engine.device)
    everything = slice(None)
    arguments = [
        *(engine.vehicles(everything, engine.kernels), engine.start(begin, everything)),
        *(engine.drive(Drive(inputs, False, GENERAL, 9.81), everything, 3), engine.steps(grid)),
        *(engine.no_loop(), log, status, last, errors),
    ]

    def fly() -> None:
        engine.launch(engine.kernels.rollout, runs, arguments)

    return fly, status, log


def measure(device: str, model: str, dtype: str, sizes: list[int]) -> None:
    engine = Engine(ca.load_vehicle("paper"), model, dtype, device)
    peak = flops_per_second(dtype, 1, device, 1 if device == "cpu" else 1 << 18)
    operations = counted(model)["flops"]
    print(
        f"\n{model}, {dtype}: {operations:.0f} operations per step, peak {peak / 1e12:.3g} Tflop/s"
    )
    print(f"{'runs':>9}{'steps':>8}{'M steps/s':>12}{'Tflop/s':>10}{'of peak':>9}")
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


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--model", default="coupled")
    parser.add_argument("--runs", type=int, nargs="*", default=RUNS)
    arguments = parser.parse_args()
    try:
        check_device(arguments.device)
    except InputError as reason:
        raise SystemExit(f"not measured: {reason}") from None
    device = wp.get_device(arguments.device)
    print(json.dumps({"device": device.name, "warp": wp.__version__, "step_s": STEP}))
    for dtype in ("float32", "float64"):
        measure(arguments.device, arguments.model, dtype, list(arguments.runs))


if __name__ == "__main__":
    main()
