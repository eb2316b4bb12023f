"""Comparison of the memory that results need with the free memory."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from continuair.errors import InputError

_CGROUP = Path("/sys/fs/cgroup")


def free_memory() -> float:
    """Return the bytes free for this process by system and control group, inf if unknown."""
    found = [float("inf")]
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        found += [1024.0 * int(each.split()[1]) for each in lines if each[:13] == "MemAvailable:"]
        limit = (_CGROUP / "memory.max").read_text("ascii").strip()
        if limit != "max":
            found.append(float(limit) - float((_CGROUP / "memory.current").read_text("ascii")))
    except (OSError, ValueError, IndexError):
        pass
    return min(found)


def check_memory(needed: Mapping[str, float], working: float = 0.0) -> None:
    """Raise InputError if results do not fit into memory.

    needed: bytes by variable; working: bytes that computing them needs besides.
    """
    total, free = sum(needed.values()), free_memory()
    if total > free:
        largest = max(needed, key=lambda name: needed[name])
        raise InputError(
            "sample",
            f"gives results of {total / 1e9:.3g} GB, but {free / 1e9:.3g} GB are free",
            f"keep fewer variables than {largest} and others, a coarser sample or fewer runs",
        )
    if total + working > free:
        raise InputError(
            "duration",
            f"needs {working / 1e9:.3g} GB to compute results of {total / 1e9:.3g} GB, but "
            f"{free / 1e9:.3g} GB are free",
            "give a shorter duration, a coarser sample or fewer runs",
        )
