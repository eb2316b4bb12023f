"""Where a kernel is tested: both precisions on the CPU, and on a CUDA device if there is one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pytest
import warp as wp

from continuair.engine.compiling import start_warp


@dataclass(frozen=True)
class Place:
    """A device and a precision."""

    device: str
    dtype: Literal["float64", "float32"]

    @property
    def exact(self) -> bool:
        return self.dtype == "float64"


@pytest.fixture(
    params=[Place(device, dtype) for device in ("cpu", "cuda") for dtype in ("float64", "float32")],
    ids=lambda place: f"{place.device}-{place.dtype}",
)
def place(request: pytest.FixtureRequest) -> Place:
    """Every test that asks for it runs at each place; skipped where there is no such device."""
    found: Place = request.param
    start_warp()
    if found.device == "cuda" and not wp.is_cuda_available():
        pytest.skip("needs a CUDA device")
    return found
