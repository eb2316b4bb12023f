"""Compiler options of kernels; CONTINUAIR_CPU_TARGET selects the target processor."""

import os
import re
from collections.abc import Callable

import warp as wp

from continuair.errors import InputError, shown

NATIVE = "native"
CPU_TARGET = os.environ.get("CONTINUAIR_CPU_TARGET") or NATIVE
"""Processor by Clang's name, such as x86-64-v3; native is the processor of this machine."""

_PROCESSOR = "-march=native" if CPU_TARGET == NATIVE else f"-target-cpu {CPU_TARGET}"

# Measured: full inlining and fused multiply-add reduce run time by 20 % from Warp's own flags.
# Vectors hold one number of each run (device/numbers.py). Without vectorisation within a run the
# same operations are fused, so that a run has the same bits in all packs and on all processors.
# Options are part of a module's hash: the cache can hold kernels for several targets.
OPTIONS = {
    "cpu_compiler_flags": f"{_PROCESSOR} -ffp-contract=fast -fno-vectorize -fno-slp-vectorize "
    "-mllvm=-inline-threshold=100000 -mllvm=-inline-cold-callsite-threshold=100000 "
    "-mllvm=-unroll-threshold=3000"
}


def check_cpu_target(load: Callable[[wp.Kernel], None]) -> None:
    """Raise InputError if Clang does not know CPU_TARGET; call this after Warp is initialised.

    load: function that compiles a kernel for the CPU.
    """
    if CPU_TARGET == NATIVE:
        return
    given = f"is {shown(CPU_TARGET)}"
    if not re.fullmatch(r"[A-Za-z0-9.+_-]+", CPU_TARGET):
        raise InputError(
            "CONTINUAIR_CPU_TARGET",
            given,
            "give one processor by Clang's name, of letters, digits and . + - _ only, such as "
            "x86-64-v3, or native",
        )
    try:
        load(_probe)
    except InputError:
        raise
    except Exception:
        # Warp has no exception of its own for a build that failed.
        raise InputError(
            "CONTINUAIR_CPU_TARGET",
            f"{given}, which Clang does not support",
            "give a processor such as x86-64-v3, or native",
        ) from None


@wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
def _probe() -> None:
    """Do nothing; used to test the compiler."""
