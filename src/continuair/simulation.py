"""`simulate`: vehicle, scenario, model -> trajectory."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair.coordinates import paper_accelerations, state_from_paper
from continuair.errors import ContinuairWarning, InputError, nearest, shown
from continuair.grid import groups_in_use, make_grid, sample_inputs, stage_times
from continuair.kernels.engine import Engine, check_device
from continuair.kernels.loads import GENERAL, PAPER, TIP
from continuair.layout import Layout
from continuair.linear import automatic_step
from continuair.scenarios import Scenario
from continuair.trajectory import OBSERVED_VARIABLES, VARIABLES, assemble, concatenate
from continuair.vehicle import Vehicle

MODELS = ("coupled", "decoupled", "independent")

# Runs per launch: bounds the memory of what is logged but not kept.
_CHUNK_NUMBERS = 2.0e7


def simulate(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    model: str = "coupled",
    step: float | str = "auto",
    duration: float | None = None,
    sample: float = 1e-3,
    variables: Iterable[str] | None = None,
    integrator: str = "rk4",
    tolerance: float = 1e-9,
    dtype: str = "float64",
    device: str = "cpu",
    threads: int | None = None,
) -> xr.Dataset:
    """Roll out one model of a vehicle through a scenario, one run or a batch.

    model: "coupled", "decoupled" (the paper's: UAV-arm blocks of M and C zero) or "independent".
    step: seconds, or "auto" (ω_max h <= 0.2, at most `sample`). duration: seconds, the scenario's
    by default. sample: seconds between logged samples. variables: names to keep, all by default.
    integrator: "rk4", or "dop853" with relative `tolerance` (single runs). dtype: "float64" or
    "float32". device: "cpu" or a CUDA device. threads: CPU threads for a batch, all by default.
    Returns a Dataset over time (and run, for a batch) with `status` and `end_time` per run; the
    variables, their axes and units are in its attributes. Raises InputError.
    """
    names = _checked(
        vehicle, model, step, duration, sample, variables, integrator, tolerance, dtype, threads
    )
    check_device(device)
    if not isinstance(scenario, Scenario):
        raise InputError(
            f"scenario is {shown(scenario)}; give a continuair.Scenario, such as "
            "continuair.open_loop_test('A')."
        )
    duration = scenario.duration if duration is None else float(duration)
    q, qd = np.atleast_2d(scenario.q), np.atleast_2d(scenario.qd)
    batched = max(
        vehicle.runs or 0, np.ndim(scenario.q) - 1 and len(q), np.ndim(scenario.qd) - 1 and len(qd)
    )
    grouped = groups_in_use(scenario)
    _same_runs(max(batched, 1), vehicle, q, qd, 1)
    engine = Engine(vehicle, "coupled", "float64", device, threads)
    fine = automatic_step(engine, q)
    if (model, dtype) != ("coupled", "float64"):
        engine = Engine(vehicle, model, dtype, device, threads)
    if isinstance(step, str):
        step = min(fine, sample)
    elif step > fine:
        warnings.warn(
            f"step is {step:g} s, which is too coarse for the stiffest bending mode: RK4 will damp "
            f"it; use {fine:.3g} s or less, or step='auto'.",
            ContinuairWarning,
            stacklevel=2,
        )
    grid = make_grid(duration, step, sample, scenario.jumps)
    inputs = sample_inputs(scenario, stage_times(grid), engine.layout)
    at_samples = sample_inputs(scenario, grid.samples, engine.layout)
    width = max(inputs[0].shape[1], at_samples[0].shape[1])
    runs = max(batched, width, 1)
    _same_runs(runs, vehicle, q, qd, width)
    q, qd = (np.broadcast_to(rows, (runs, rows.shape[1])) for rows in (q, qd))
    start = state_from_paper(q, qd)
    provenance = dict(
        vehicle=vehicle,
        scenario=scenario,
        model=model,
        step=float(step),
        integrator=integrator,
        dtype=dtype,
        gravity=scenario.gravity,
    )
    if integrator == "dop853":
        if runs > 1:
            raise InputError(
                f"integrator is 'dop853', but there are {runs} runs; give one run, or "
                "use integrator='rk4'."
            )
        provenance.update(step="adaptive", tolerance=tolerance)
        # SciPy's integrators are slow to import, and few runs need them.
        from continuair.reference import integrate_reference

        logs = integrate_reference(engine, start, q[:, -1], grid, scenario, tolerance, at_samples)
        return assemble(grid, logs, engine.layout, names, bool(batched), provenance)

    observe = any(name in OBSERVED_VARIABLES for name in names)
    chunk = max(1, int(_CHUNK_NUMBERS / (len(grid.samples) * 41)))
    parts = []
    for first in range(0, runs, chunk):
        part = slice(first, min(first + chunk, runs))
        logs = engine.roll_out(
            start[part],
            q[part, -1],
            grid,
            _columns(inputs, part),
            _columns(at_samples, part),
            scenario.gravity,
            grouped,
            observe,
            first,
        )
        parts.append(
            assemble(grid, logs, engine.layout, names, bool(batched) or runs > 1, provenance)
        )
    return concatenate(parts)


def _columns(inputs: tuple[np.ndarray, int], part: slice) -> tuple[np.ndarray, int]:
    table, stride = inputs
    return (table if table.shape[1] == 1 else table[:, part]), stride


def _same_runs(runs: int, vehicle: Vehicle, q: np.ndarray, qd: np.ndarray, width: int) -> None:
    sizes = {
        "vehicle": vehicle.runs or 1,
        "scenario.q": len(q),
        "scenario.qd": len(qd),
        "the scenario's inputs": width,
    }
    for name, size in sizes.items():
        if size not in (1, runs):
            raise InputError(
                f"{name} holds {size} runs, but the batch has {runs}; give every "
                "array one row per run, or a single row."
            )


def _checked(
    vehicle: Any,
    model: Any,
    step: Any,
    duration: Any,
    sample: Any,
    variables: Any,
    integrator: Any,
    tolerance: Any,
    dtype: Any,
    threads: Any,
) -> tuple[str, ...]:
    """Validate the options; return the names of the variables to keep."""
    if not isinstance(vehicle, Vehicle):
        raise InputError(f"vehicle is {shown(vehicle)}; load one with continuair.load_vehicle.")
    for name, value, valid in (
        ("model", model, MODELS),
        ("integrator", integrator, ("rk4", "dop853")),
        ("dtype", dtype, ("float64", "float32")),
    ):
        if value not in valid:
            raise InputError(f"{name} is {shown(value)}; use one of {', '.join(valid)}.")
    positive = {"sample": sample, "tolerance": tolerance}
    if step != "auto":
        positive["step"] = step
    if duration is not None:
        positive["duration"] = duration
    for name, value in positive.items():
        number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
        if not number or not 0.0 < value < np.inf:
            auto = " or 'auto'" if name == "step" else ""
            raise InputError(f"{name} is {shown(value)}; give a finite number above 0{auto}.")
    if threads is not None and (not isinstance(threads, int) or threads < 1):
        raise InputError(f"threads is {shown(threads)}; give a whole number above 0.")
    names = tuple(VARIABLES) if variables is None else tuple(variables)
    for name in names:
        if name not in VARIABLES:
            raise InputError(
                f"variables holds {shown(name)}{nearest(name, VARIABLES)}; "
                f"choose from {', '.join(VARIABLES)}."
            )
    return names


def forward_dynamics(
    vehicle: Vehicle,
    q: Any,
    qd: Any,
    tau: Any = 0.0,
    tip_wrench: Any = 0.0,
    *,
    model: str = "coupled",
    gravity: float = 9.81,
    dtype: str = "float64",
) -> np.ndarray:
    """Accelerations q̈ in the paper's coordinates, (8,) or (n, 8), through the kernels.

    q, qd: (8,) or (n, 8); tau: generalised forces (8,) or (n, 8), 0 for none; tip_wrench: force
    and moment on the tip in world axes (6,) or (n, 6). ψ̈a divides by κ: |κ| below κ_s counts as
    κ_s (Remark 1). NaN where |κ| l exceeds 2π. Eq. of motion, Amiri et al. Raises InputError.
    """
    _checked(vehicle, model, "auto", None, 1.0, (), "rk4", 1.0, dtype, None)
    layout = Layout(vehicle.sections)
    arrays = {
        name: _rows(name, value, width)
        for name, value, width in (
            ("q", q, layout.coordinates),
            ("qd", qd, layout.coordinates),
            ("tau", tau, layout.coordinates),
            ("tip_wrench", tip_wrench, 6),
        )
    }
    n = max(vehicle.runs or 1, *(len(a) for a in arrays.values()))
    for name, a in arrays.items():
        if len(a) not in (1, n):
            raise InputError(f"{name} holds {len(a)} rows, but the batch has {n}; give {n} or 1.")
    at, rates = (np.broadcast_to(arrays[name], (n, layout.coordinates)) for name in ("q", "qd"))
    inputs = np.zeros((1, n, layout.inputs))
    inputs[0, :, layout.force] = arrays["tau"][:, :3]
    inputs[0, :, layout.euler_and_polar] = arrays["tau"][:, 3:]
    inputs[0, :, layout.tip_wrench] = arrays["tip_wrench"]
    engine = Engine(vehicle, model, dtype)
    rate = engine.derivative(
        state_from_paper(at, rates), at[:, -1], inputs, gravity, GENERAL + PAPER + TIP
    )
    accelerations = paper_accelerations(at, rates, rate, vehicle.arm.kappa_s)
    return accelerations if np.ndim(q) == 2 or n > 1 else accelerations[0]


def _rows(name: str, value: Any, width: int) -> np.ndarray:
    try:
        rows = np.array(value, float)
        rows = np.broadcast_to(rows, (1, width)) if rows.ndim == 0 else np.atleast_2d(rows)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.ndim != 2 or rows.shape[1] != width or not np.isfinite(rows).all():
        raise InputError(f"{name} is {shown(value)}; give {width} finite numbers, or rows of them.")
    return rows
