"""What the machine can do at most, by small kernels: arithmetic on one core or a card, and copies.

Warp reads annotations as types, so they are not postponed here.
"""

from collections.abc import Callable
from functools import cache
from time import perf_counter, process_time

import numpy as np
import warp as wp

CHAINS = 12
"""Sums that do not wait for each other: enough to fill two units of four or five cycles."""
SCALAR = "-march=native -ffp-contract=fast -fno-vectorize -fno-slp-vectorize"
WIDE = "-march=native -ffp-contract=fast"


def _snippet(kind: str, lanes: int) -> str:
    """C of CHAINS chains of x = x m + c, `count` links each; vectors of `lanes` numbers."""
    vector = (
        f"typedef {kind} V __attribute__((vector_size({lanes * (8 if kind == 'double' else 4)})));"
    )
    first = vector if lanes > 1 else f"typedef {kind} V;"
    chains = range(CHAINS)
    return "\n".join(
        [
            first,
            *(f"V x{i} = V() + ({kind})(start + {i});" for i in chains),
            f"V m = V() + ({kind})0.999, c = V() + ({kind})start;",
            "for (int i = 0; i < count; ++i) {",
            *(f"  x{i} = x{i} * m + c;" for i in chains),
            "}",
            "V sum = " + " + ".join(f"x{i}" for i in chains) + ";",
            "return sum;"
            if lanes == 1
            else f"{kind} out = 0; for (int i = 0; i < {lanes}; ++i) out += sum[i]; return out;",
        ]
    )


@cache
def _multiply_add(precision: str, lanes: int) -> wp.Kernel:
    kind, Real = ("double", wp.float64) if precision == "float64" else ("float", wp.float32)

    @wp.func_native(_snippet(kind, lanes))
    def chains(start: Real, count: int) -> Real: ...

    options = {"cpu_compiler_flags": WIDE if lanes > 1 else SCALAR}

    @wp.kernel(enable_backward=False, module="unique", module_options=options)
    def peak(start: Real, count: int, out: wp.array(dtype=Real)):
        out[wp.tid()] = chains(start, count)

    return peak


def flops_per_second(precision: str, lanes: int, device: str = "cpu", threads: int = 1) -> float:
    """The largest rate of multiplications and additions seen in repeats, fused ones as two.

    lanes: numbers per vector (1 on a card). threads: of the kernel; on a CPU they run one after
    the other on one core.
    """
    kernel = _multiply_add(precision, lanes)
    count = 200_000 if device == "cpu" else 20_000
    Real = getattr(wp, precision)
    out = wp.zeros(threads, Real, device=device)

    def work() -> None:
        wp.launch(kernel, dim=threads, inputs=[Real(1e-3), count, out], device=device)

    return 2.0 * CHAINS * lanes * count * threads / shortest(work, device)


def copied_bytes_per_second(device: str = "cpu", mebibytes: int = 256) -> float:
    """The largest rate of bytes read and written by copies much larger than the caches."""
    source = wp.zeros(mebibytes << 17, wp.float64, device=device)
    target = wp.empty_like(source)
    return 2.0 * (mebibytes << 20) / shortest(lambda: wp.copy(target, source), device, 8)


def shortest(work: Callable[[], None], device: str = "cpu", repeats: int = 60) -> float:
    """The shortest time of repeats [s]: of the processor on a CPU, on the clock on a card."""
    clock = process_time if device == "cpu" else perf_counter
    work()
    best = np.inf
    for _ in range(repeats):
        wp.synchronize_device(device)
        begin = clock()
        work()
        wp.synchronize_device(device)
        best = min(best, clock() - begin)
    return float(best)
