"""`simulate`: vehicle, scenario, model -> trajectory."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair.closing import close_loop, control_step
from continuair.coordinates import paper_accelerations, state_from_paper
from continuair.errors import ContinuairWarning, InputError, nearest, shown
from continuair.grid import groups_in_use, make_grid, sample_inputs, stage_times
from continuair.kernels.engine import Engine, check_device
from continuair.kernels.loads import COMMAND, GENERAL, PAPER, TIP
from continuair.layout import Layout
from continuair.linear import automatic_step
from continuair.scenarios import Scenario
from continuair.trajectory import (
    OBSERVED_VARIABLES,
    VARIABLES,
    WATCHED_VARIABLES,
    assemble,
    concatenate,
    default_variables,
)
from continuair.vehicle import Vehicle

MODELS = ("coupled", "decoupled", "independent")

# Runs per launch: bounds the memory of what is logged but not kept.
_CHUNK_NUMBERS = 2.0e7
_NUMBERS_PER_SAMPLE = 50


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
    if not isinstance(scenario, Scenario):
        raise InputError(
            f"scenario is {shown(scenario)}; give a continuair.Scenario, such as "
            "continuair.open_loop_test('A')."
        )
    if variables is None:
        variables = default_variables(scenario)
    names = check_options(
        vehicle, model, step, duration, sample, variables, integrator, tolerance, dtype, threads
    )
    check_device(device)
    duration = scenario.duration if duration is None else float(duration)
    closed = scenario.controller is not None
    _check_loop(names, closed, bool(scenario.targets), integrator)
    q, qd = np.atleast_2d(scenario.q), np.atleast_2d(scenario.qd)
    gains = scenario.controller.runs if scenario.controller is not None else None
    listed = isinstance(scenario.target, (list, tuple))
    sizes = {
        "vehicle": vehicle.runs,
        "scenario.q": len(q) if np.ndim(scenario.q) == 2 else None,
        "scenario.qd": len(qd) if np.ndim(scenario.qd) == 2 else None,
        "scenario.controller": gains,
        "scenario.target": len(scenario.targets) if listed else None,
    }
    batched = max(size or 0 for size in sizes.values())
    _same_runs(max(batched, 1), sizes)
    engine = Engine(vehicle, "coupled", "float64", device, threads)
    fine = automatic_step(engine, q)
    step = _step(step, fine, sample, scenario)
    grid = make_grid(
        duration, step, sample, scenario.jumps, scenario.control_period if closed else None
    )
    inputs = sample_inputs(scenario, stage_times(grid), engine.layout)
    at_samples = sample_inputs(scenario, grid.samples, engine.layout)
    width = max(inputs[0].shape[1], at_samples[0].shape[1])
    runs = max(batched, width, 1)
    _same_runs(runs, {**sizes, "the scenario's inputs": width})
    q, qd = (np.broadcast_to(rows, (runs, rows.shape[1])) for rows in (q, qd))
    start = state_from_paper(q, qd)
    options = {"precision": dtype, "device": device, "threads": threads}
    grouped = groups_in_use(scenario)
    if closed:
        engine = close_loop(vehicle, scenario, model, grid, start, q[:, -1], **options)
        grouped |= COMMAND
    elif (model, dtype) != ("coupled", "float64"):
        engine = Engine(vehicle, model, **options)
    provenance = dict(
        vehicle=vehicle,
        scenario=scenario,
        model=model,
        step=float(step),
        integrator=integrator,
        dtype=dtype,
        gravity=scenario.gravity,
        scene=getattr(engine, "scene", None),
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
        provenance.update(part=slice(0, 1))
        return assemble(grid, logs, engine.layout, names, bool(batched), provenance)

    observe = any(name in OBSERVED_VARIABLES for name in names)
    chunk = max(1, int(_CHUNK_NUMBERS / (len(grid.samples) * _NUMBERS_PER_SAMPLE)))
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
            first=first,
        )
        several = bool(batched) or runs > 1
        known = {**provenance, "part": part}
        parts.append(assemble(grid, logs, engine.layout, names, several, known))
    return concatenate(parts)


def _step(step: Any, fine: float, sample: float, scenario: Scenario) -> float:
    """The step to take: what is asked for, or what the stiffest mode and the controller allow."""
    if scenario.controller is not None:
        finest = min(fine, sample)
        found = control_step(scenario, finest, None if isinstance(step, str) else float(step))
    else:
        found = min(fine, sample) if isinstance(step, str) else float(step)
    warn_if_coarse(found, fine, stacklevel=4)
    return found


def warn_if_coarse(step: float, fine: float, stacklevel: int) -> None:
    """Warn of a step [s] longer than `fine`, that of the stiffest bending mode."""
    if step > fine * (1.0 + 1e-9):
        warnings.warn(
            f"step is {step:g} s, which is too coarse for the stiffest bending mode: RK4 will "
            f"damp it; use {fine:.3g} s or less, or step='auto'.",
            ContinuairWarning,
            stacklevel=stacklevel,
        )


def _check_loop(names: tuple[str, ...], closed: bool, looking: bool, integrator: str) -> None:
    if closed and integrator == "dop853":
        raise InputError(
            "integrator is 'dop853', but a controller closes the loop; use integrator='rk4'."
        )
    for name in names:
        if name in WATCHED_VARIABLES and not (closed and looking):
            raise InputError(
                f"variables holds {name}, which needs a scenario with a controller and a target; "
                "give both, or leave it out."
            )


def _columns(inputs: tuple[np.ndarray, int], part: slice) -> tuple[np.ndarray, int]:
    table, stride = inputs
    return (table if table.shape[1] == 1 else table[:, part]), stride


def _same_runs(runs: int, sizes: dict[str, int | None]) -> None:
    for name, size in sizes.items():
        if size not in (None, 1, runs):
            raise InputError(
                f"{name} holds {size} runs, but the batch has {runs}; give every "
                "array one row per run, or a single row."
            )


def check_options(
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
    if isinstance(variables, str) or not isinstance(variables, Iterable):
        raise InputError(f"variables is {shown(variables)}; give a list of names.")
    names = tuple(variables)
    for name in names:
        if not isinstance(name, str) or name not in VARIABLES:
            raise InputError(f"variables holds {shown(name)}; {nearest(str(name), VARIABLES)}.")
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
    check_options(vehicle, model, "auto", None, 1.0, (), "rk4", 1.0, dtype, None)
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
