"""Number of runs that a CPU thread simulates at once, after a test of packs once per process."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import warp as wp

from continuair.device.interpreted import Rows, interpreted, struct_from, vector_rows
from continuair.device.numbers import LANES, NARROW, Numbers
from continuair.device.probe import PROBED, TERMS, WIDTH, probe_kernel, wide_registers
from continuair.engine.compiling import load, made_once
from continuair.engine.lanes import packs_of, struct_rows, table_rows
from continuair.engine.struct_types import numpy_type
from continuair.errors import ContinuairWarning

Array = np.ndarray

_PACKS = 32
"""Narrow packs of a thread up to which wide ones save no time: kernels of these take 10 s more to
compile, and under error control lanes of a wide pack wait for one another. From there on wide ones
save up to a fifth."""

_RUNS = 11
"""Runs of the test: more than a pack, and not a multiple of one."""

# Units of rounding of the largest number of a row, for differently fused operations.
_ROUNDING = 64.0


def lanes_of(runs: int, threads: int, precision: str, device: str) -> int:
    """Return the number of runs that a thread simulates at once: those of a pack, or 1.

    Packs are narrow if narrow packs are enough for all threads. A run has the same bits in both
    kinds of packs, because each fills one vector register. If registers hold only a narrow pack,
    wide packs are not used: they are no faster, and the compiler fuses their halves in another
    order.
    """
    if device != "cpu" or not packs_work(precision):
        return 1
    narrow = NARROW[precision]
    few = runs <= _PACKS * narrow * threads
    return narrow if few or not registers_are_wide() else LANES[precision]


@made_once
def registers_are_wide() -> bool:
    """Return whether vector registers of the target processor hold 512 bits."""
    load(wide_registers, "cpu")
    found = wp.zeros(1, wp.int32, device="cpu")
    wp.launch(wide_registers, dim=1, device="cpu", inputs=[found])
    return bool(found.numpy()[0])


@made_once
def packs_work(precision: str) -> bool:
    """Whether packs give what Python computes; where they do not, a warning says so."""
    try:
        alone, packed = _probed_by_python(precision), _probed(precision)
    except Exception as error:  # Warp has no exception of its own for a build that failed.
        return _refused(f"the compiler refuses them, {type(error).__name__}")
    size = np.abs(alone).max(axis=1, keepdims=True)
    apart = np.abs(alone - packed) <= _ROUNDING * np.finfo(packed.dtype).eps * size
    return True if apart.all() else _refused("their numbers are wrong")


def _refused(why: str) -> bool:
    # A property of this machine, which studies do not suppress.
    warnings.warn(
        f"packs of runs do not work here ({why}): runs are simulated one by one, several times "
        f"slower; use another version of Warp than {wp.__version__}.",
        ContinuairWarning,
        stacklevel=2,
    )
    return False


def _probed(precision: str) -> Array:
    """Return what the probe computes in packs (runs, PROBED), for some runs that differ."""
    lanes = LANES[precision]
    kernel, Body, Row = probe_kernel(Numbers(precision, lanes))
    real, cell = np.dtype(precision), getattr(wp, precision)
    bodies, table, angles = _trial(precision)
    out = np.zeros((_RUNS, PROBED), real)
    arguments: list[Any] = [
        struct_rows(bodies, Body, lanes, "cpu"),
        table_rows(table.astype(real), Row, lanes, "cpu"),
        wp.array(angles.astype(real), dtype=cell, device="cpu"),
        wp.array(out, dtype=cell, device="cpu", copy=False),
    ]
    load(kernel, "cpu")
    wp.launch(kernel, dim=packs_of(_RUNS, lanes), device="cpu", inputs=arguments)
    return out


def _probed_by_python(precision: str) -> Array:
    """Return the same, computed in float64."""
    kernel, Body, _ = probe_kernel(Numbers("float64"))
    bodies, table, angles = _trial(precision)
    out = np.zeros((_RUNS, PROBED))
    rows = Rows((_RUNS,), lambda index: struct_from(Body, bodies[index]))
    with np.errstate(all="ignore"):
        interpreted(kernel)(np.arange(_RUNS), rows, vector_rows(table), angles, out)
    return out


def _trial(precision: str) -> tuple[Array, Array, Array]:
    """Return bodies, table and angles of the trial, rounded to the precision."""
    _, Single, _ = probe_kernel(Numbers(precision))
    rng = np.random.default_rng(20260218)
    attitude = rng.normal(size=(_RUNS, 4))
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    bodies = np.zeros(_RUNS, numpy_type(Single))
    bodies["attitude"], bodies["inertia"] = attitude, rng.normal(size=(_RUNS, 3, 3))
    table, angles = rng.normal(size=(_RUNS, TERMS, WIDTH)), np.linspace(-3.0, 7.0, _RUNS)[:, None]
    return bodies, table.astype(precision).astype(float), angles.astype(precision).astype(float)
