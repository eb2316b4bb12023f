"""Launches the closed loop over a batch: an engine with a controller, a target and a camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from continuair.kernels.engine import Engine, Logs
from continuair.kernels.factory import closed_loop, watch_kernel
from continuair.kernels.plant import per_run

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
        self.watch = watch_kernel(name, sections, points).watch if points else None
        self.cameras = _pack_cameras(vehicle, self.loop.code)
        self.gains = _pack_gains(controller, self.loop.Gains)

    def roll_out(
        self, start, angle, grid, inputs, sample_inputs, gravity, groups, observe, first=0
    ) -> Logs:
        """As an engine's, and with a scene the logs hold what is watched."""
        self.starts = self._upload(grid.starts)
        logs = super().roll_out(
            start, angle, grid, inputs, sample_inputs, gravity, groups, observe, first
        )
        if self.scene is None:
            return logs
        watched = self._watch(self.scene, logs.log, first)
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
        slots = 1 + int((np.maximum.accumulate(timing.exposed) - timing.shown).max(initial=0))
        out.corners = self._vectors(scene.corners)
        out.desired = self._upload(_rows(scene.desired, at))
        out.motion = self._upload(_columns(scene.motion, at))
        out.frames = self._upload(np.zeros((runs, slots, 5 * len(scene.corners))))
        return out

    def _watch(self, scene: Scene, log: np.ndarray, first: int) -> np.ndarray:
        runs, samples = log.shape[:2]
        points, at = len(scene.corners), slice(first, first + runs)
        watched = np.full((runs, samples, POSE_AND_TWIST + 4 * points), np.nan, self.dtype)
        out = self._upload(watched)
        plants, _ = self._vehicles(at)
        wp.launch(
            self.watch,
            dim=(runs, samples),
            device=self.device,
            inputs=[
                plants,
                wp.array(_rows(self.cameras, at), dtype=self.loop.code.Camera, device=self.device),
                self._vectors(scene.corners),
                self._upload(_columns(scene.motion_at_samples, at)),
                self._upload(log),
                out,
            ],
        )
        self._download(out, watched)
        watched[~np.isfinite(log[..., 0])] = np.nan
        return watched

    def _vectors(self, rows: np.ndarray):
        rows = np.ascontiguousarray(rows, self.dtype)
        return wp.array(rows, dtype=self.loop.code.vec3, device=self.device)


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


def _pack_gains(controller, Gains) -> np.ndarray:
    packed = np.zeros(controller.runs or 1, dtype=Gains.numpy_dtype())
    for name, value in controller.gains.items():
        packed[name] = value
    return packed
