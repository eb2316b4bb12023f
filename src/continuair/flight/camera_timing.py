"""Timing of a closed loop: when controller and camera are updated, and the motion of targets."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from continuair.engine.engine import Engine, Start
from continuair.engine.loop import Loop, Scene, Timing, over_time, watch
from continuair.errors import InputError, shown
from continuair.flight.guiding import guidance_over
from continuair.flight.time_grid import Grid, instants_at, stage_times
from continuair.scenario.paths import Path
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array, ArrayLike
from continuair.vehicle.layout import MOTION, watched_columns, width_of
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

_ROUNDING = 1e-6
"""Relative rounding error of a latency in multiples of the period, in float32."""

_EARLY = 1e-7
"""Relative rounding error of a control instant before a frame's time, with a period in float32."""


def loop_over(vehicle: Vehicle, scenario: Scenario, grid: Grid, runs: int) -> Loop:
    """Return the loop of a scenario's controller over a time grid; raises InputError."""
    controller = scenario.controller
    assert controller is not None
    without_camera = controller.guided and not controller.looks
    timing = _without_camera(grid) if without_camera else _timing(vehicle, scenario, grid)
    scene = _scene(scenario, grid, timing.every_stage) if scenario.targets else None
    layout = vehicle.layout
    guidance = guidance_over(scenario, grid, layout) if controller.guided else None
    return Loop(controller, timing, scene, _seeds(scenario.seed, runs), guidance)


def _without_camera(grid: Grid) -> Timing:
    """Return the camera's timing for a controller that does not use it."""
    never = np.full(len(grid.steps), -1)
    return Timing(np.zeros(len(never), np.int32), never, never, False)


def _seeds(given: int | Sequence[int], runs: int) -> NDArray[np.int32]:
    """Return the noise streams of the runs, which depend on their seeds only."""
    each = [given] if isinstance(given, int) else given
    own = [np.random.SeedSequence(seed).generate_state(1)[0] for seed in each]
    return np.broadcast_to(np.array(own, np.uint32).view(np.int32), runs)


def motion_of(scenario: Scenario, times: Array, runs: NDArray[np.intp] | None = None) -> Array:
    """Return centroids of the targets and their velocities (times, targets, MOTION), world axes.

    runs: those of some runs, if each has a target.
    """
    at, targets = np.asarray(times, float).tobytes(), scenario.targets
    some = targets if runs is None or len(targets) == 1 else [targets[run] for run in runs]
    return np.stack([_motion(target.path, at) for target in some], axis=1)


@lru_cache(maxsize=16)
def _motion(path: Path, times: bytes) -> Array:
    """Return position and velocity (times, MOTION), cached, as runs share paths and times."""
    return np.hstack(path(np.frombuffer(times))[:2])


def check_view(engine: Engine, scenario: Scenario, start: Start) -> None:
    """Raise InputError if a controller's camera does not see every point at the start.

    Also raises it if the camera looks away from the side of the desired image.
    """
    if scenario.controller is None or not scenario.controller.looks:
        return
    layout, corners = engine.layout, np.asarray(scenario.targets[0].points)
    log = np.zeros((len(start.states), 1, layout.log))
    log[:, 0, : layout.state] = start.states
    polar = log[:, 0, layout.branch]
    polar[:, layout.arc_coordinates[:, 1]] = start.angle[:, list(layout.arcs)]
    log[:, 0, layout.euler] = start.angle[:, layout.sections :]
    watched = watch(engine, log, corners, motion_of(scenario, np.zeros(1)))[:, 0]
    columns = watched_columns(len(corners))
    image, depth, seen = (watched[:, columns[name]] for name in ("image", "depth", "in_view"))
    if seen.all():
        _check_side(scenario, Rotation.from_quat(watched[:, columns["camera_attitude"]]))
        return
    run, point = np.argwhere(seen == 0.0)[0]
    has = f"has point {point}" + (f" of run {run}" if len(log) > 1 else "")
    if depth[run, point] <= 0.0:
        raise InputError(
            "target",
            f"{has} behind the camera at the start (depth {depth[run, point]:.3g} m)",
            "start with the camera facing the target",
        )
    camera = engine.vehicle.camera
    focal, centre, size = (
        per_run(value, engine.vehicle.runs or 1, 2)[run if engine.vehicle.runs else 0]
        for value in (camera.focal_length, camera.principal_point, camera.image_size)
    )
    u, v = focal * image[run, 2 * point : 2 * point + 2] + centre
    raise InputError(
        "target",
        f"{has} out of view at the start, at pixel ({u:.0f}, {v:.0f}) of an image of {size[0]:g} "
        f"by {size[1]:g}",
        "start closer to the desired pose, or farther away",
    )


def _check_side(scenario: Scenario, attitudes: Rotation) -> None:
    """Raise InputError for a run whose camera must turn by 90° or more to the desired image.

    Example: the desired image is from above, but the camera looks up.
    """
    looks = attitudes.apply([0.0, 0.0, 1.0])
    wanted = np.array([target.camera_axis for target in scenario.targets])
    away = np.flatnonzero(np.einsum("ij,ij->i", looks, np.broadcast_to(wanted, looks.shape)) <= 0.0)
    if away.size:
        run = int(away[0])
        of = f" of run {run}" if len(looks) > 1 else ""
        along, other = (
            shown(np.round(each, 2)) for each in (wanted[run % len(wanted)], looks[run])
        )
        raise InputError(
            f"target{of}",
            f"has a desired view along {along}, but the camera looks along {other} at the start",
            "set camera_attitude of the target",
        )


def _timing(vehicle: Vehicle, scenario: Scenario, grid: Grid) -> Timing:
    """Return when controller and camera are updated, and which frame each update uses."""
    camera, period = vehicle.camera, scenario.period
    steps = len(grid.steps)
    if period is None:
        integral = scenario.controller.integral if scenario.controller is not None else 0.0
        if integral:
            raise InputError(
                "control_period",
                (
                    f"is None, but the controller has integral {integral:g}, which needs "
                    "updates at a period"
                ),
                "give one [s], such as 1e-3",
            )
        for name in ("noise", "frame_rate", "latency") if scenario.targets else ():
            if np.any(getattr(camera, name)):
                raise InputError(
                    "control_period",
                    (
                        f"is None, but camera.{name} is {shown(getattr(camera, name))}, "
                        "which needs updates at a period"
                    ),
                    "give one [s], such as 1e-3",
                )
        every = np.ones(steps, np.int32)
        return Timing(every, np.full(steps, -1), np.zeros(steps, int), True)
    rate, latency = (_one("camera." + n, getattr(camera, n)) for n in ("frame_rate", "latency"))
    instants = instants_at(grid, period)
    acts = instants >= 0
    at = instants[acts]
    # A frame is exposed at the first control instant at or after its time.
    due = at * period * rate * (1.0 + _EARLY)
    frames = at if rate == 0.0 else np.floor(due + 1e-9).astype(int)
    frames = np.unique(frames, return_inverse=True)[1]
    fresh = np.append(True, np.diff(frames) > 0)
    delay = int(np.ceil(latency / period * (1.0 - _ROUNDING)))
    # Before the first frame has arrived, the controller uses that of the start.
    arrived = frames[np.maximum(np.arange(len(at)) - delay, 0)]
    exposed, in_hand = np.full(steps, -1), np.zeros(steps, int)
    exposed[acts] = np.where(fresh, frames, -1)
    in_hand[acts] = arrived
    return Timing(acts.astype(np.int32), exposed, in_hand, False)


def _scene(scenario: Scenario, grid: Grid, every_stage: bool) -> Scene:
    """Return the targets' points, desired images and motion."""
    targets = scenario.targets
    times = stage_times(grid) if every_stage else grid.starts
    desired = np.stack([target.desired for target in targets])
    motion, at_samples = (
        over_time(partial(motion_of, scenario, at), len(targets) * len(at) * width_of(MOTION))
        for at in (times, grid.samples)
    )
    return Scene(np.asarray(targets[0].points), desired, motion, at_samples)


def _one(name: str, value: ArrayLike) -> float:
    """Return the value that all runs share, or raise InputError."""
    if np.ndim(value) and len(np.unique(value)) > 1:
        raise InputError(
            name,
            f"is {shown(value)} over the runs, which share their control instants",
            "give one value for all",
        )
    return float(np.ravel(value)[0])
