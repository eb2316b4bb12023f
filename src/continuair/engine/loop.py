"""Launches the closed loop over a batch: an engine with a controller, a target and a camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from continuair.engine.engine import Engine, Logs
from continuair.engine.factory import closed_loop, watch_kernel
from continuair.engine.pack import per_run
from continuair.errors import InputError, shown

POSE_AND_TWIST = 13
"""Columns of what is watched before the image: camera pose 7 (world), twist 6 (camera axes)."""


@dataclass(frozen=True)
class Timing:
    """Per step (m,): acts, whether the controller does at its start; exposed, the frame taken then
    or -1; shown, the frame that the controller has then. every_stage: it acts at every stage too.
    """

    acts: np.ndarray
    exposed: np.ndarray
    shown: np.ndarray
    every_stage: bool


@dataclass(frozen=True)
class Scene:
    """corners (points, 3), desired (runs or 1, 2 points); motion (rows, runs or 1, 6): centroid and
    its velocity, three rows per step if the controller acts at every stage, else one; and the same
    at the samples, motion_at_samples (samples, runs or 1, 6)."""

    corners: np.ndarray
    desired: np.ndarray
    motion: np.ndarray
    motion_at_samples: np.ndarray


class ClosedLoop(Engine):
    """An engine whose roll-outs close the loop; the scene is None for a blind controller."""

    def __init__(
        self, vehicle, model: str, controller, scene: Scene | None, timing: Timing, seeds, **options
    ) -> None:
        super().__init__(vehicle, model, **options)
        self.controller, self.scene, self.timing, self.seeds = controller, scene, timing, seeds
        points = 0 if scene is None else len(scene.corners)
        name, sections = self.dtype.name, vehicle.sections
        self.loop = closed_loop(name, sections, model, controller.law, points, timing.every_stage)
        self.cameras = _pack_cameras(vehicle, self.loop.code)
        self.gains = _pack_gains(controller, self.loop.Gains, points)

    def roll_out(
        self,
        start,
        angle,
        grid,
        inputs,
        sample_inputs,
        gravity,
        groups,
        observe,
        first=0,
        initial=None,
    ) -> Logs:
        """As an engine's, and with a scene the logs hold what is watched."""
        self.starts = self._upload(grid.starts)
        logs = super().roll_out(
            start, angle, grid, inputs, sample_inputs, gravity, groups, observe, first, initial
        )
        if self.scene is None:
            return logs
        watched = watch(self, logs.log, self.scene.corners, self.scene.motion_at_samples, first)
        return Logs(logs.log, logs.status, logs.last_step, logs.observed, watched)

    def _fly(self, part, first, start, grid, results) -> None:
        runs = results[0].shape[0]
        at = slice(first + part.start, first + part.stop)
        steps, after = grid
        timing, code = self.timing, self.loop.code
        wp.launch(
            self.loop.rollout,
            dim=runs,
            device=self.device,
            inputs=[
                *start,
                self.starts,
                steps,
                after,
                *(self._upload(a, wp.int32) for a in (timing.acts, timing.exposed, timing.shown)),
                self._upload(self.seeds[at], wp.int32),
                wp.array(_rows(self.cameras, at), dtype=code.Camera, device=self.device),
                self._scene(at, runs),
                wp.array(_rows(self.gains, at), dtype=self.loop.Gains, device=self.device),
                *results,
            ],
        )

    def _load_modules(self) -> None:
        for kernel in (self.loop.rollout, self.kernels.observe):
            kernel.module.load(self.device)

    def _scene(self, at: slice, runs: int):
        out = self.loop.Scene()
        scene, timing = self.scene, self.timing
        if scene is None:
            nothing = np.zeros((1, 3))
            scene = Scene(nothing, np.zeros((1, 2)), np.zeros((1, 1, 6)), np.zeros((1, 1, 6)))
        on_their_way = np.maximum.accumulate(timing.exposed) - timing.shown
        slots = 1 + int(on_their_way[timing.acts != 0].max(initial=0))
        out.corners = self.upload_vectors(scene.corners)
        out.desired = self._upload(_rows(scene.desired, at))
        out.motion = self._upload(_columns(scene.motion, at))
        out.frames = self._upload(np.zeros((runs, slots, 5 * len(scene.corners))))
        out.needed = int(self.controller.looks)
        return out


def watch(engine: Engine, log: np.ndarray, corners, motion, first: int = 0) -> np.ndarray:
    """What is watched (runs, samples, columns) along logged rows (runs, samples, log).

    corners: (points, 3); motion: (samples, runs or 1, 6) of the target's centroid, as in a Scene.
    """
    kernels = watch_kernel(engine.dtype.name, engine.vehicle.sections, len(corners))
    runs, samples = log.shape[:2]
    at = slice(first, first + runs)
    watched = np.full((runs, samples, POSE_AND_TWIST + 4 * len(corners)), np.nan, engine.dtype)
    out = engine._upload(watched)
    plants, _ = engine._vehicles(at)
    cameras = _rows(_pack_cameras(engine.vehicle, kernels.code), at)
    wp.launch(
        kernels.watch,
        dim=(runs, samples),
        device=engine.device,
        inputs=[
            plants,
            wp.array(cameras, dtype=kernels.code.Camera, device=engine.device),
            engine.upload_vectors(corners),
            engine._upload(_columns(motion, at)),
            engine._upload(log),
            out,
        ],
    )
    engine._download(out, watched)
    watched[~np.isfinite(log[..., 0])] = np.nan
    return watched


def _rows(array: np.ndarray, at: slice) -> np.ndarray:
    return array if len(array) == 1 else array[at]


def _columns(table: np.ndarray, at: slice) -> np.ndarray:
    return table if table.shape[1] == 1 else table[:, at]


def _pack_cameras(vehicle, code) -> np.ndarray:
    runs, camera = vehicle.runs or 1, vehicle.camera
    packed = np.zeros(runs, dtype=code.Camera.numpy_dtype())
    packed["focal"] = per_run(camera.focal_length, runs, 2)
    packed["principal"] = per_run(camera.principal_point, runs, 2)
    packed["size"] = per_run(camera.image_size, runs, 2)
    packed["position"] = per_run(camera.position, runs, 3)
    packed["attitude"] = per_run(camera.attitude, runs, 4)
    packed["frenet"] = np.broadcast_to(np.asarray(camera.tip_frame) == "frenet", runs)
    packed["noise"] = per_run(camera.noise, runs)
    return packed


def _pack_gains(controller, Gains, points: int) -> np.ndarray:
    packed = np.zeros(controller.runs or 1, dtype=Gains.numpy_dtype())
    expected = packed.dtype.names or ()
    given = {name: np.asarray(value) for name, value in controller.gains.items()}
    for name in sorted(set(expected) ^ set(given)):
        problem = "is missing from" if name in expected else "is not a field of the law but in"
        raise InputError(
            f"{name} {problem} the gains of the controller {controller.name}; give "
            f"{', '.join(expected)}."
        )
    for name, value in given.items():
        one_run = value.shape[1:] if controller.runs else value.shape
        wanted = packed.dtype[name].shape
        if one_run != wanted:
            raise InputError(
                f"{name} of the controller {controller.name} has shape {one_run}, but {points} "
                f"feature points call for {wanted}; give gains for the target's points."
            )
        if value.dtype.kind not in "biuf" or not np.isfinite(value).all():
            raise InputError(
                f"{name} of the controller {controller.name} is {shown(value)}; give finite gains."
            )
        packed[name] = value
    return packed
