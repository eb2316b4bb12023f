"""Kind of machine, on which run times and the last bits of results depend."""

from __future__ import annotations

import platform
from pathlib import Path


def machine() -> str:
    """Return system, architecture and processor.

    Returns
    -------
    str
        One line of text.
    """
    return f"{platform.system()} {platform.machine()}, {_processor()}"


def _processor() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "")
