"""The kind of machine: what results to the last bit, and times, depend on beside the versions."""

from __future__ import annotations

import platform
from pathlib import Path


def machine() -> str:
    """Return system, architecture and processor in one line."""
    return f"{platform.system()} {platform.machine()}, {_processor()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "")
