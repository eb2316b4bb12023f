"""An experiment: several simulations packed in the lanes of vectors, on one core.

The coupled model's rate, traced from the kernels' own source to straight-line C (tracing.py), works
on vectors of 4, 8 or 16 numbers, one run per lane, inside an RK4 loop of its own. It flies the free
flight of the benchmarks under a held push, without log, branch or status, and its final states are
compared with those of the kernel of single runs. roofline.py puts the figures on its page.

Warp reads annotations as types, so they are not postponed here.
"""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gpu
import numpy as np
import warp as wp
from continuair.engine.moments import TERMS
from peaks import WIDE, shortest

import continuair as ca
from continuair.device.types import MOMENTS
from continuair.engine.compiling import start_warp
from continuair.engine.engine import Engine

RUNS, STEPS, STEP = 16, 2000, 1e-4
POLYNOMIALS = TERMS * len(MOMENTS)
"""Coefficients of a section."""


def traced() -> dict[str, Any]:
    """The coupled rate as lines of C, from a process without Warp."""
    script = Path(__file__).with_name("tracing.py")
    return dict(json.loads(subprocess.check_output([sys.executable, str(script), "coupled"])))


def snippet(trace: dict[str, Any], lanes: int) -> str:
    """C++ of an RK4 roll-out of `lanes` runs; arrays hold a quantity's lanes side by side."""
    rates = "\n".join(f"dy[{i}] = {rate};" for i, rate in enumerate(trace["rates"]))
    lines = "\n".join(trace["lines"])
    parameters = len(trace["plant"]) + 9
    return f"""
    typedef double V __attribute__((vector_size({8 * lanes}), aligned(8)));
    const V* c = (const V*)(&coefficients.data[block * {POLYNOMIALS * lanes}]);
    const V* p = (const V*)(&parameters.data[block * {parameters * lanes}]);
    V* state = (V*)(&states.data[block * {17 * lanes}]);
    V now[17], y[17], dy[17], sum[17];
    for (int i = 0; i < 17; ++i) now[i] = state[i];
    const double ahead[4] = {{0.0, 0.5, 0.5, 1.0}}, weight[4] = {{1.0, 2.0, 2.0, 1.0}};
    for (int n = 0; n < steps; ++n) {{
        for (int i = 0; i < 17; ++i) {{ sum[i] = V(); dy[i] = V(); }}
        #pragma clang loop unroll(disable)
        for (int stage = 0; stage < 4; ++stage) {{
            for (int i = 0; i < 17; ++i) y[i] = now[i] + (h * ahead[stage]) * dy[i];
            {lines}
            {rates}
            for (int i = 0; i < 17; ++i) sum[i] += weight[stage] * dy[i];
        }}
        for (int i = 0; i < 17; ++i) now[i] += (h / 6.0) * sum[i];
        V size = now[3] * now[3] + now[4] * now[4] + now[5] * now[5] + now[6] * now[6];
        for (int k = 0; k < {lanes}; ++k) size[k] = 1.0 / ::sqrt(size[k]);
        for (int i = 3; i < 7; ++i) now[i] *= size;
    }}
    for (int i = 0; i < 17; ++i) state[i] = now[i];
    """


def packed_kernel(trace: dict[str, Any], lanes: int) -> wp.Kernel:
    @wp.func_native(snippet(trace, lanes))
    def advance(
        block: int,
        steps: int,
        h: wp.float64,
        coefficients: wp.array(dtype=wp.float64),
        parameters: wp.array(dtype=wp.float64),
        states: wp.array(dtype=wp.float64),
    ): ...

    @wp.kernel(enable_backward=False, module="unique", module_options={"cpu_compiler_flags": WIDE})
    def roll_out(
        steps: int,
        h: wp.float64,
        coefficients: wp.array(dtype=wp.float64),
        parameters: wp.array(dtype=wp.float64),
        states: wp.array(dtype=wp.float64),
    ):
        advance(wp.tid(), steps, h, coefficients, parameters, states)

    return roll_out


def in_lanes(rows: np.ndarray, lanes: int) -> wp.array:
    """Rows (runs, numbers) as blocks of (numbers, lanes)."""
    blocks = rows.reshape(-1, lanes, rows.shape[1]).swapaxes(1, 2)
    return wp.array(np.ascontiguousarray(blocks).ravel(), dtype=wp.float64, device="cpu")


def packed(
    trace: dict[str, Any], engine: Engine, start: np.ndarray, lanes: int
) -> tuple[Callable[[], None], Callable[[], np.ndarray]]:
    """A call that takes STEPS steps of all runs, and one that reads where they are."""
    rows = {
        name: np.reshape(engine.plants[name], (len(engine.plants), -1))
        for name in engine.plants.dtype.names
    }
    plant = [np.broadcast_to(rows[name][:, k], RUNS) for name, k in trace["plant"]]
    push = np.zeros((RUNS, 9))
    push[:, 2], push[:, 8] = 9.81 * float(engine.vehicle.mass), 9.81
    parameters = in_lanes(np.column_stack([*plant, push]), lanes)
    table = np.broadcast_to(engine.table.reshape(len(engine.table), -1), (RUNS, POLYNOMIALS))
    states, table = in_lanes(start, lanes), in_lanes(table, lanes)
    kernel = packed_kernel(trace, lanes)

    def fly() -> None:
        wp.launch(
            kernel,
            dim=RUNS // lanes,
            inputs=[STEPS, STEP, table, parameters, states],
            device="cpu",
        )

    def read() -> np.ndarray:
        return states.numpy().reshape(-1, 17, lanes).swapaxes(1, 2).reshape(RUNS, 17)

    return fly, read


def measure() -> dict[str, Any]:
    """Processor time per run and step of the product's kernel, and of vectors of some widths."""
    start_warp()
    engine = Engine(ca.load_vehicle("paper"), "coupled")
    ours, _, log = gpu.roll_out(engine, RUNS, STEPS)
    ours()
    unit = float(engine.plants["unit"][0, 0])
    scale = np.ones(17)
    scale[[7, 8, 15, 16]] = unit
    flown = log.numpy()[:, 1, :17] * scale
    start = log.numpy()[:, 0, :17] * scale
    trace = traced()
    cases = [{"what": "the kernel of single runs", "seconds": shortest(ours) / RUNS / STEPS}]
    for lanes in (1, 4, 8, 16):
        fly, read = packed(trace, engine, start, lanes)
        fly()
        off = float(np.abs(read() - flown).max())
        # Rounding, and what 0.2 s of motion make of it.
        assert off < 1e-9, off
        seconds = shortest(fly) / RUNS / STEPS
        cases.append({"what": f"vectors of {lanes}", "seconds": seconds, "off": off})
    for case in cases:
        case["ratio"] = cases[0]["seconds"] / case["seconds"]
    return {"cases": cases}


if __name__ == "__main__":
    for case in measure()["cases"]:
        print(case)
