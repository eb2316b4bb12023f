"""Many flights of the paper's model as printed at once, by compiled kernels."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.table.printed import (
    NODES,
    Flight,
    PrintedModel,
    check_flight,
    sample_times,
)
from amiri2026.table.reading import Reading, masks
from continuair import Vehicle
from continuair.engine import load, made_once, start_warp

Array = np.ndarray


@dataclass(frozen=True)
class Job:
    """A flight to fly: a vehicle under a reading, a test A to D, and a model, "coupled" or one of
    the names of `Reading.decoupled`."""

    vehicle: Vehicle
    reading: Reading
    test: str
    model: str


def fly(
    jobs: Sequence[Job],
    *,
    tolerance: float = 1e-8,
    sample: float = 1e-3,
    duration: float = 1.0,
    most: int = 5_000_000,
    nodes: int = NODES,
) -> list[Flight]:
    """Simulate jobs on all processors, as `PrintedModel.fly` does, to the tolerances of both.

    most: evaluations of the accelerations after which a flight stops. Raises InputError for a
    vehicle, test, model, tolerance or sample that cannot be simulated.
    """
    time = sample_times(sample, duration)
    for job in jobs:
        check_flight(job.test, job.model, tolerance)
    if not jobs:
        return []
    packed, points, starts = _packed(jobs, nodes)
    states = np.full((len(jobs), len(time), 16), np.nan)
    states[:, 0] = starts
    status = np.zeros(len(jobs), np.int32)
    _launch(packed, points, (tolerance, sample, most), states, status)
    return [
        Flight(time, rows[:, :8], rows[:, 8:], int(end))
        for rows, end in zip(states, status, strict=True)
    ]


def _launch(
    packed: Array,
    points: tuple[Array, Array, Array],
    settings: tuple[float, float, int],
    states: Array,
    status: Array,
) -> None:
    """Fly packed jobs, a thread each, into states (jobs, samples, 16) and status (jobs,)."""
    kernel = _kernel()
    import warp as wp

    from amiri2026.table import kernel as device
    from continuair.engine import structs

    def on_cpu(values: Array, dtype: Any) -> Any:
        return wp.array(values, dtype=dtype, device="cpu", copy=False)

    mass, place, offset = points
    shared = [
        on_cpu(mass, device.Real),
        on_cpu(place, device.Real),
        on_cpu(offset, device.vec3),
        on_cpu(device.TABLEAU, device.Real),
    ]

    def run(index: int) -> None:
        one = slice(index, index + 1)
        results = [on_cpu(states[one], device.vec16), on_cpu(status[one], wp.int32)]
        job = structs(packed[one], device.Job, "cpu")
        inputs: list[Any] = [job, *shared, *settings, *results]
        wp.launch(kernel, 1, inputs=inputs, device="cpu", block_dim=1)

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        list(pool.map(run, range(len(packed))))


@made_once
def _kernel() -> Any:
    start_warp()
    from amiri2026.table.kernel import fly_kernel

    load(fly_kernel, "cpu")
    return fly_kernel


def _packed(jobs: Sequence[Job], nodes: int) -> tuple[Array, tuple[Array, Array, Array], Array]:
    """Return structs of the jobs, arrays of all their points, and their starts (jobs, 16)."""
    from amiri2026.table.kernel import structure

    found = np.zeros(len(jobs), structure())
    starts = np.zeros((len(jobs), 16))
    models = [PrintedModel(job.vehicle, job.reading, nodes) for job in jobs]
    first = 0
    for index, (job, model) in enumerate(zip(jobs, models, strict=True)):
        arm, reading = job.vehicle.arm, job.reading
        on_M, on_C = masks(job.model)
        starts[index, :8] = model.start()
        values = {
            "first": first,
            "points": len(model.points.mass),
            "test": OPEN_LOOP_TESTS.index(job.test),
            "mount": model.mount,
            "length": arm.length,
            "spring": arm.bending_stiffness * arm.length,
            "damping": arm.structural_damping * arm.length,
            "damping_on_angle": float(reading.damping == "bend vector"),
            "threshold": model.threshold,
            "torque": 1.0 if reading.kappa == "1/m" else arm.length,
            "force_sign": reading.force_sign,
            "moves": np.isin(np.arange(8), model.moving(job.test)),
            "on_M": on_M,
            "on_C": on_C,
        }
        for name, value in values.items():
            found[name][index] = value
        first += len(model.points.mass)
    columns = [
        np.concatenate([getattr(model.points, name) for model in models])
        for name in ("mass", "s", "offset")
    ]
    return found, (columns[0], columns[1], columns[2]), starts
