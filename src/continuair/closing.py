"""From a scenario to its closed loop: when the controller and the camera act, and on what."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.errors import InputError
from continuair.grid import Grid, stage_times
from continuair.kernels.loop import ClosedLoop, Scene, Timing
from continuair.scenarios import Scenario
from continuair.vehicle import Vehicle


def close_loop(
    vehicle: Vehicle, scenario: Scenario, model: str, grid: Grid, runs: int, **options: Any
) -> ClosedLoop:
    """The engine of a scenario's controller, over a grid; options are an Engine's."""
    timing = _timing(vehicle, scenario, grid)
    scene = _scene(scenario, grid, timing.every_stage) if scenario.targets else None
    # One stream of noise per run, whatever the batch is split into.
    seeds = np.random.SeedSequence(scenario.seed).generate_state(runs).view(np.int32)
    engine = ClosedLoop(vehicle, model, scenario.controller, scene, timing, seeds, **options)
    _check_gains(scenario, engine)
    return engine


def control_step(scenario: Scenario, finest: float, step: float | None) -> float:
    """The step [s] of a closed loop: the control period, or a whole part of it up to `finest`.

    step: the user's, which must divide the control period, or None. Raises InputError.
    """
    period = scenario.control_period
    if period is None:
        return min(finest, step or finest)
    if step is None:
        return float(period / np.ceil(period / finest * (1.0 - 1e-12)))
    parts = period / step
    if step <= period and abs(parts - round(parts)) > 1e-6:
        raise InputError(
            f"control_period is {period:g} s, which is not a multiple of the step, {step:g} s; "
            "give one that is, or step='auto'."
        )
    return min(step, period)


def _timing(vehicle: Vehicle, scenario: Scenario, grid: Grid) -> Timing:
    camera, period = vehicle.camera, scenario.control_period
    steps = len(grid.steps)
    if period is None:
        if any(np.any(v) for v in (camera.noise, camera.frame_rate, camera.latency)):
            raise InputError(
                "control_period is None, but the camera has noise, frames or latency; give a "
                "control period [s], such as 1e-3."
            )
        acts = np.append(True, grid.sample_after[:-1] >= 0)
        return Timing(acts.astype(np.int32), np.full(steps, -1), np.zeros(steps, int), True)
    rate, latency = (_one("camera." + n, getattr(camera, n)) for n in ("frame_rate", "latency"))
    counts = np.round(grid.starts / period)
    acts = np.abs(grid.starts - counts * period) < 1e-9 * grid.samples[-1]
    at = counts[acts].astype(int)
    # A frame is exposed at the first control instant at or after its time.
    frames = at if rate == 0.0 else np.floor(at * period * rate + 1e-9).astype(int)
    frames = np.unique(frames, return_inverse=True)[1]
    fresh = np.append(True, np.diff(frames) > 0)
    delay = int(np.ceil(latency / period - 1e-9))
    # Before the first frame has arrived, the controller has that of the start.
    arrived = frames[np.maximum(np.arange(len(at)) - delay, 0)]
    exposed, shown = np.full(steps, -1), np.zeros(steps, int)
    exposed[acts] = np.where(fresh, frames, -1)
    shown[acts] = arrived
    return Timing(acts.astype(np.int32), exposed, shown, False)


def _scene(scenario: Scenario, grid: Grid, every_stage: bool) -> Scene:
    targets = scenario.targets
    times = stage_times(grid) if every_stage else grid.starts

    def motion(at: np.ndarray) -> np.ndarray:
        return np.stack([np.hstack(target.path(at)[:2]) for target in targets], axis=1)

    desired = np.stack([target.desired for target in targets])
    return Scene(targets[0].points, desired, motion(times), motion(grid.samples))


def _check_gains(scenario: Scenario, engine: ClosedLoop) -> None:
    for name, value in (scenario.controller.gains if scenario.controller else {}).items():
        if not np.isfinite(np.asarray(value, float)).all():
            raise InputError(f"{name} of the controller is not finite; give finite gains.")
    if engine.scene is None:
        return
    expected = engine.gains.dtype
    points = 2 * len(engine.scene.corners)
    for name in ("Kp",):
        if name in (expected.names or ()) and expected[name].shape != (points, points):
            raise InputError(f"{name} does not fit {points // 2} feature points.")


def _one(name: str, value: Any) -> float:
    if np.ndim(value) and len(np.unique(value)) > 1:
        raise InputError(f"{name} varies over the runs; give all runs the same.")
    return float(np.ravel(value)[0])
