"""What a benchmark ran on, in words."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def described_machine() -> str:
    """Processor, cores that may be used, memory, load at the moment, and Python."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    wide = "AVX-512" if any("avx512f" in line for line in lines) else "no AVX-512"
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    cores = len(os.sched_getaffinity(0))
    return (
        f"{names[0] if names else platform.machine()} ({wide}), {cores} cores, {memory:.0f} GiB, "
        f"load {os.getloadavg()[0]:.1f} at the start, Python {platform.python_version()}"
    )
