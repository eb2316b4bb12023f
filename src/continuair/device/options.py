"""What kernels are compiled with; CONTINUAIR_CPU_TARGET names the processor that runs them."""

import os
import re
from collections.abc import Callable

import warp as wp

from continuair.errors import InputError, shown

NATIVE = "native"
CPU_TARGET = os.environ.get("CONTINUAIR_CPU_TARGET") or NATIVE
"""A processor by Clang's name, such as x86-64-v3; native is the one that this runs on."""

_PROCESSOR = "-march=native" if CPU_TARGET == NATIVE else f"-target-cpu {CPU_TARGET}"

# Measured: inlining everything and fusing products and sums takes a fifth off Warp's own flags.
# Runs lie side by side in vectors (device/numbers.py). That numbers of one run are not paired as
# well keeps what is fused, and so a run's bits, the same in all packs and on all processors.
# They are part of a module's hash: kernels for several targets lie beside each other in the cache.
OPTIONS = {
    "cpu_compiler_flags": f"{_PROCESSOR} -ffp-contract=fast -fno-vectorize -fno-slp-vectorize "
    "-mllvm=-inline-threshold=100000 -mllvm=-inline-cold-callsite-threshold=100000 "
    "-mllvm=-unroll-threshold=3000"
}


def check_cpu_target(load: Callable[[wp.Kernel], None]) -> None:
    """Raise InputError unless Clang knows CPU_TARGET; call it once Warp is initialised.

    load: compiles a kernel for the CPU.
    """
    if CPU_TARGET == NATIVE:
        return
    problem = f"CONTINUAIR_CPU_TARGET is {shown(CPU_TARGET)}"
    if not re.fullmatch(r"[A-Za-z0-9.+_-]+", CPU_TARGET):
        raise InputError(
            f"{problem}; give one processor by Clang's name, of letters, digits and . + - _ only, "
            "such as x86-64-v3, or native."
        )
    try:
        load(_probe)
    except InputError:
        raise
    except Exception:
        # Warp has no exception of its own for a build that failed.
        raise InputError(
            f"{problem}, for which Clang compiles nothing; give a processor that it knows, such as "
            "x86-64-v3, or native."
        ) from None


@wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
def _probe() -> None:
    """Does nothing, but needs the compiler."""
