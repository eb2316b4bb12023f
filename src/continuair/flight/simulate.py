"""`simulate`: vehicle, scenario, model -> trajectory."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import warp as wp
import xarray as xr

from continuair import checks
from continuair.engine.engine import Engine, check_device, start_warp
from continuair.errors import ContinuairWarning, InputError, nearest, shown
from continuair.flight.camera_timing import close_loop, control_step
from continuair.flight.steps import automatic_step
from continuair.flight.time_grid import groups_in_use, make_grid, sample_inputs, stage_times
from continuair.flight.trajectory import (
    OBSERVED_VARIABLES,
    VARIABLES,
    WATCHED_VARIABLES,
    assemble,
    concatenate,
    default_variables,
)
from continuair.kernels.forces.inputs import COMMAND, GENERAL, PAPER, TIP
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.coordinates import paper_accelerations, state_from_paper
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle import Vehicle, check_vehicle

MODELS = ("coupled", "decoupled", "independent")

_FINEST_TOLERANCE = 1e-13
"""Relative tolerance below which rounding errors of float64 would steer DOP853's steps."""

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
    step: seconds, or "auto": of the fastest rate, stiffest mode with its damping or initial motion,
    it makes 0.2, and at most `sample`. duration: seconds, the scenario's by default. sample:
    seconds between logged samples, the last interval shorter if need be; steps end at samples.
    variables: names to keep, all by default. integrator: "rk4", or "dop853" with relative
    `tolerance` (single runs, float64; `step` then only times the end of a run that ends early).
    dtype: "float64" or "float32". device: "cpu" or a CUDA device. threads: CPU threads for a batch.
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
    check_vehicle(vehicle)
    checks.choice("model", model, MODELS)
    _check_numerics(integrator, tolerance, dtype, device, threads)
    names = _checked_names(variables)
    if not (isinstance(step, str) and step == "auto"):
        step = checks.positive("step", step, " or 'auto'")
    duration = scenario.duration if duration is None else checks.positive("duration", duration)
    if checks.positive("sample", sample) > duration * (1.0 + 1e-9):
        raise InputError(
            f"sample is {shown(sample)} s, longer than the flight of {duration:g} s; give a "
            "shorter one."
        )
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
    fine = automatic_step(engine, q, qd)
    step = _step(step, fine, sample, scenario)
    if integrator == "rk4":
        warn_if_coarse(step, fine, stacklevel=3)
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
    options: dict[str, Any] = {"precision": dtype, "device": device, "threads": threads}
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
        from continuair.flight.dop853 import integrate_reference

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
    """The step to take: what is asked for, or what the fastest rate and the controller allow."""
    finest = min(fine, sample)
    if scenario.controller is not None:
        return control_step(scenario, finest, None if isinstance(step, str) else step)
    return finest if isinstance(step, str) else float(step)


def warn_if_coarse(step: float, fine: float, stacklevel: int) -> None:
    """Warn of a step [s] longer than `fine`, which vehicle and start allow."""
    if step > fine * (1.0 + 1e-9):
        warnings.warn(
            f"step is {step:g} s, which is too coarse for the fastest motion of vehicle and start "
            f"(stiffest bending mode, its damping, initial rates): RK4 will distort it; use "
            f"{fine:.3g} s or less, or step='auto'.",
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


def _same_runs(runs: int, sizes: Mapping[str, int | None]) -> None:
    for name, size in sizes.items():
        if size not in (None, 1, runs):
            raise InputError(
                f"{name} holds {size} runs, but the batch has {runs}; give every "
                "array one row per run, or a single row."
            )


def _check_numerics(integrator: Any, tolerance: Any, dtype: Any, device: Any, threads: Any) -> None:
    checks.choice("integrator", integrator, ("rk4", "dop853"))
    checks.choice("dtype", dtype, ("float64", "float32"))
    checks.positive("tolerance", tolerance)
    if integrator == "dop853" and dtype != "float64":
        raise InputError(f"dtype is {shown(dtype)}, but integrator='dop853' needs 'float64'.")
    if integrator == "dop853" and tolerance < _FINEST_TOLERANCE:
        raise InputError(
            f"tolerance is {shown(tolerance)}, finer than float64 can hold; give "
            f"{_FINEST_TOLERANCE:g} or more."
        )
    whole = isinstance(threads, (int, np.integer)) and not isinstance(threads, bool)
    if threads is not None and not (whole and threads > 0):
        raise InputError(f"threads is {shown(threads)}; give a whole number above 0.")
    _check_device(device)


def _check_device(device: Any) -> None:
    if not isinstance(device, str):
        raise InputError(f"device is {shown(device)}; give its name, such as 'cpu'.")
    start_warp()
    if device.startswith("cuda") and not wp.is_cuda_available():
        raise InputError(f"device is {shown(device)}, but no CUDA device was found; use 'cpu'.")
    check_device(device)


def _checked_names(variables: Any) -> tuple[str, ...]:
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
    device: str = "cpu",
) -> np.ndarray:
    """Accelerations q̈ in the paper's coordinates, (8,) or (n, 8), through the kernels.

    q, qd: (8,) or (n, 8); tau: generalised forces (8,) or (n, 8), 0 for none; tip_wrench: force
    and moment on the tip in world axes (6,) or (n, 6). ψ̈a divides by κ: |κ| below κ_s counts as
    κ_s (Remark 1). NaN where |κ| l exceeds 2π. dtype, device: as in `simulate`. Eq. of motion,
    Amiri et al. Raises InputError, also where the coordinates are singular: at cos θ = 0, and at
    κ = 0 if κ_s is 0.
    """
    check_vehicle(vehicle)
    checks.choice("model", model, MODELS)
    checks.choice("dtype", dtype, ("float64", "float32"))
    _check_device(device)
    gravity = checks.gravity(gravity)
    layout = Layout(vehicle.sections)
    arrays = {
        name: checks.rows(name, value, width)
        for name, value, width in (
            ("q", q, layout.coordinates),
            ("qd", qd, layout.coordinates),
            ("tau", tau, layout.coordinates),
            ("tip_wrench", tip_wrench, 6),
        )
    }
    sizes = {"vehicle": vehicle.runs or 1} | {name: len(rows) for name, rows in arrays.items()}
    n = max(sizes.values())
    _same_runs(n, sizes)
    _check_regular(arrays["q"], vehicle.arm.kappa_s)
    at, rates = (np.broadcast_to(arrays[name], (n, layout.coordinates)) for name in ("q", "qd"))
    inputs = np.zeros((1, n, layout.inputs))
    inputs[0, :, layout.force] = arrays["tau"][:, :3]
    inputs[0, :, layout.euler_and_polar] = arrays["tau"][:, 3:]
    inputs[0, :, layout.tip_wrench] = arrays["tip_wrench"]
    engine = Engine(vehicle, model, dtype, device)
    rate = engine.derivative(
        state_from_paper(at, rates), at[:, -1], inputs, gravity, GENERAL + PAPER + TIP
    )
    accelerations = paper_accelerations(at, rates, rate, vehicle.arm.kappa_s)
    return accelerations if np.ndim(q) == 2 or n > 1 else accelerations[0]


def _check_regular(q: np.ndarray, kappa_s: Any) -> None:
    """Refuse configurations at which Euler angles or polar bend have no accelerations."""
    if (np.abs(np.cos(q[:, 4])) < _REGULAR).any():
        raise InputError(
            "q holds a pitch of a quarter turn, where roll and yaw have no accelerations; give "
            "another pitch, or simulate, whose state has no singularity."
        )
    if ((q[:, 6] == 0.0) & (np.asarray(kappa_s) == 0.0)).any():
        raise InputError(
            "q holds a bend of 0 while arm.kappa_s is 0, where psi_a has no acceleration; give a "
            "bend, or a kappa_s above 0."
        )


_REGULAR = 1e-9
"""Smallest |cos θ| at which Euler accelerations keep some digits."""
