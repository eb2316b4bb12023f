"""A controller with its target and camera, packed for the roll-outs of an engine."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

from continuair.controllers.controller import Controller
from continuair.device.types import room
from continuair.engine.engine import Engine
from continuair.engine.factory import Closing, LoopKernels, closed_loop, packed_loop, watching
from continuair.engine.lanes import packs_of, struct_rows
from continuair.engine.law_made import made_for_packs, made_law
from continuair.engine.pack import tree_of
from continuair.errors import InputError, shown
from continuair.kernels.integrators import TSIT5
from continuair.terms import name_of
from continuair.vehicle.layout import (
    MOTION,
    frame_columns,
    summed_columns,
    watched_columns,
    width_of,
)
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


@dataclass(frozen=True)
class Timing:
    """Per step (m,): acts, whether the controller does at its start; exposed, the frame taken then
    or -1; shown, the frame that the controller has then. every_stage: it acts at every stage too.
    """

    acts: Array
    exposed: Array
    shown: Array
    every_stage: bool


@dataclass(frozen=True)
class Scene:
    """corners (points, 3), desired (runs or 1, 2 points); motion (rows, runs or 1, 6): centroid and
    its velocity, three rows per step if the controller acts at every stage, else one; and the same
    at the samples, motion_at_samples (samples, runs or 1, 6)."""

    corners: Array
    desired: Array
    motion: Array
    motion_at_samples: Array


@dataclass(frozen=True)
class Guidance:
    """For a law that follows set-points: per step (m,), issued, which push it decides on at its
    start, or -1, and taken, which push acts from then on, or -1; slots: most pushes on their way;
    wanted (pushes, runs or 1, columns): set-points; upright (runs or 1, 1): 1 where runs start
    upright."""

    issued: Array
    taken: Array
    slots: int
    wanted: Array
    upright: Array


_NOTHING = Scene(
    np.zeros((1, 3)), np.zeros((1, 2)), *(np.zeros((1, 1, width_of(MOTION))) for _ in range(2))
)


@dataclass(frozen=True, eq=False)
class Loop:
    """What closes a loop over one time grid: the controller, when it acts, and what it looks at.

    scene: None for a controller without a target. seeds (runs,): of the noise, per run. guidance:
    of a guided controller.
    """

    controller: Controller
    timing: Timing
    scene: Scene | None
    seeds: Array
    guidance: Guidance | None = None
    _packed: dict[tuple[Engine, int], PackedLoop] = field(default_factory=dict)

    @property
    def points(self) -> int:
        """The number of feature points."""
        return 0 if self.scene is None else len(self.scene.corners)

    def on(self, engine: Engine, runs: int) -> PackedLoop:
        """This loop packed for an engine and a number of runs that it flies.

        Raises InputError if the gains do not fit the law.
        """
        lanes = engine.lanes(runs)
        if (engine, lanes) not in self._packed:
            kernels, packed = self._kernels(engine, lanes)
            _check_memory(self.controller, kernels)
            gains = pack_gains(self.controller, kernels.Gains, self.points)
            cameras = pack_cameras(engine.vehicle, kernels.eye.Camera)
            believed = self.controller.believes
            mind = None if believed is None else _mind(believed, engine, kernels.eye.Camera)
            self._packed[engine, lanes] = PackedLoop(self, packed or kernels, cameras, gains, mind)
        return self._packed[engine, lanes]

    def _kernels(self, engine: Engine, lanes: int) -> tuple[LoopKernels, LoopKernels | None]:
        """Kernels of single runs, and those of packs of so many if the law is for them."""
        law = self.controller.law, engine.dtype.name, engine.tree, self.points
        how = Closing(
            self.timing.every_stage,
            engine.method,
            self.controller.integral > 0.0,
            self.controller.believes is not None,
        )
        kernels = closed_loop(made_law(*law), engine.model, how)
        several = made_for_packs(*law, lanes) if lanes > 1 else None
        return kernels, None if several is None else packed_loop(several, engine.model, how)

    def watch(self, engine: Engine, log: Array, runs: Array) -> Array | None:
        """What the camera sees along logged rows of some runs; None without a target."""
        if self.scene is None:
            return None
        return watch(engine, log, self.scene.corners, self.scene.motion_at_samples, runs)


@dataclass(frozen=True, eq=False)
class PackedLoop:
    """A loop's kernels, and its cameras and gains as they take them (runs or 1,); mind: the vehicle
    that its law believes in, if that is another one."""

    loop: Loop
    kernels: LoopKernels
    cameras: Array
    gains: Array
    mind: Mind | None = None

    def struct(self, engine: Engine, runs: Array) -> Any:
        """The struct of some runs."""
        if self.loop.guidance is not None:
            return self._guided(engine, runs, self.loop.guidance)
        return self._filled(self.kernels.pilot.Loop(), engine, runs)

    def _filled(self, found: Any, engine: Engine, runs: Array) -> Any:
        """The struct of a law's gains, of its timing and of what it looks at."""
        loop, kernels, timing = self.loop, self.kernels, self.loop.timing
        scene = loop.scene or _NOTHING
        on_their_way = np.maximum.accumulate(timing.exposed) - timing.shown
        slots = 1 + int(on_their_way[timing.acts != 0].max(initial=0))
        for name in ("acts", "exposed", "shown"):
            setattr(found, name, engine.upload(getattr(timing, name), wp.int32))
        found.seeds = engine.upload(loop.seeds[runs], wp.int32)
        at = kernels.lanes, engine.device
        found.cameras = struct_rows(_rows(self.cameras, runs), kernels.eye.Camera, *at)
        found.gains = struct_rows(_rows(self.gains, runs), kernels.Gains, *at)
        found.corners = engine.upload(scene.corners)
        motion = _columns(scene.motion, runs)
        if timing.every_stage and engine.method == TSIT5:
            # Room for the motion at each stage's time.
            motion = np.zeros((1, len(runs), width_of(MOTION)))
        found.motion = engine.upload(motion)
        found.desired = engine.upload(_rows(scene.desired, runs))
        found.frames = engine.upload(self._frames(len(runs), slots))
        found.needed = int(loop.controller.looks)
        if self.mind is not None:
            believed, own = self.mind.engine, _rows(self.mind.cameras, runs)
            found.believed = believed.vehicles(runs, engine.kernels_of(kernels.lanes))
            found.believed_cameras = struct_rows(own, kernels.eye.Camera, *at)
        return found

    def _frames(self, runs: int, slots: int) -> Array:
        """Room for the frames on their way, and behind the first one for what is summed up."""
        points, integral = max(self.loop.points, 1), self.loop.controller.integral
        if not integral:
            return np.zeros((runs, slots, width_of(frame_columns(points))))
        summed = summed_columns(points)
        frames = np.zeros((runs, slots, width_of(summed)))
        frames[:, 0, summed["rate"]] = integral
        return frames

    def _guided(self, engine: Engine, runs: Array, guidance: Guidance) -> Any:
        """The struct of some runs under a guided law."""
        kernels, found = self.kernels, self.kernels.pilot.Loop()
        self._filled(found.sight, engine, runs)
        for name in ("issued", "taken"):
            setattr(found, name, engine.upload(getattr(guidance, name), wp.int32))
        found.wanted = engine.upload(_columns(guidance.wanted, runs))
        found.upright = engine.upload(_rows(guidance.upright, runs))
        found.memory = engine.upload(np.zeros((len(runs), 1, kernels.remembered)))
        pushes = engine.layout.push.stop
        found.pushes = engine.upload(np.zeros((len(runs), guidance.slots, pushes)))
        return found


@dataclass(frozen=True, eq=False)
class Mind:
    """The vehicle that a law believes in, packed as that which flies is, and its cameras."""

    engine: Engine
    cameras: Array


def _mind(believed: Vehicle, engine: Engine, Camera: Any) -> Mind:
    """Raises InputError where the vehicles differ by more than numbers."""
    if tree_of(believed) != engine.tree:
        raise InputError(
            f"controller believes in the vehicle {shown(believed.name)}, which has other arms, "
            f"sections, tips, mounts or terms than {shown(engine.vehicle.name)} that flies; "
            "make it of that one by replace."
        )
    packed = Engine(believed, engine.model, engine.dtype.name, engine.device, engine.threads)
    for term in engine.tree.terms:
        read = packed.plants.dtype.names or ()
        names = [name for name in (*term.flown, "term_numbers") if name in read]
        if any((packed.plants[name] != engine.plants[name]).any() for name in names):
            raise InputError(
                f"controller believes in the vehicle {shown(believed.name)}, whose "
                f"{name_of(term)} is not that of {shown(engine.vehicle.name)} that flies, but no "
                f"law computes with it; leave {name_of(term)} as it is."
            )
    return Mind(packed, pack_cameras(believed, Camera))


def watch(
    engine: Engine, log: Array, corners: Array, motion: Array, runs: Array | None = None
) -> Array:
    """What is watched (runs, samples, columns) along logged rows (runs, samples, log).

    corners: (points, 3); motion: (samples, runs or 1, 6) of the target's centroid, as in a Scene;
    runs: their indices into the vehicles and the motion, all by default.
    """
    of, lanes = (engine.dtype.name, engine.tree, len(corners)), engine.lanes(len(log))
    kernel, eye = watching(*of, lanes)
    runs = np.arange(len(log)) if runs is None else runs
    shape = (*log.shape[:2], width_of(watched_columns(len(corners))))
    watched = np.empty(shape, engine.dtype)
    out = engine.upload(watched)
    cameras = _rows(pack_cameras(engine.vehicle, watching(*of)[1].Camera), runs)
    engine.launch(
        kernel,
        (packs_of(len(log), lanes), log.shape[1]),
        [
            engine.vehicles(runs, engine.kernels_for(len(log))).plants,
            struct_rows(cameras, eye.Camera, lanes, engine.device),
            engine.upload(corners),
            engine.upload(_columns(motion, runs)),
            engine.upload(log),
            out,
        ],
    )
    engine.download(out, watched)
    watched[~np.isfinite(log[..., 0])] = np.nan
    return watched


def pack_cameras(vehicle: Vehicle, Camera: Any) -> Array:
    """Structured cameras (runs or 1,) of a vehicle."""
    runs, camera = vehicle.runs or 1, vehicle.camera
    packed = np.zeros(runs, dtype=Camera.numpy_dtype())
    packed["focal"] = per_run(camera.focal_length, runs, 2)
    packed["principal"] = per_run(camera.principal_point, runs, 2)
    packed["size"] = per_run(camera.image_size, runs, 2)
    packed["position"] = per_run(camera.position, runs, 3)
    packed["attitude"] = per_run(camera.attitude, runs, 4)
    packed["frenet"] = np.broadcast_to(np.asarray(camera.tip_frame) == "frenet", runs)
    packed["noise"] = per_run(camera.noise, runs)
    return packed


def _check_memory(controller: Controller, kernels: LoopKernels) -> None:
    """Raise InputError unless a guided controller's law remembers, and that of no other, and both
    look or neither."""
    if controller.guided != bool(kernels.remembered):
        has = "has no Memory" if controller.guided else "has a Memory"
        raise InputError(
            f"guided is {controller.guided} of the controller {controller.name}, but its law "
            f"{has}; give guided={not controller.guided}."
        )
    if controller.guided and controller.looks != kernels.looks:
        raise InputError(
            f"looks is {controller.looks} of the controller {controller.name}, but {kernels.looks} "
            f"of its law; give looks={kernels.looks}."
        )


def pack_gains(controller: Controller, Gains: Any, points: int) -> Array:
    """Structured gains (runs or 1,) of a controller; raises InputError if they do not fit."""
    packed = np.zeros(controller.runs or 1, dtype=Gains.numpy_dtype())
    expected = packed.dtype.names or ()
    given = controller.gains
    for name in sorted(set(expected) ^ set(given)):
        problem = "is missing from" if name in expected else "is not a field of the law but in"
        raise InputError(
            f"{name} {problem} the gains of the controller {controller.name}; give "
            f"{', '.join(expected)}."
        )
    for name, value in given.items():
        one_run = value.shape[1:] if controller.runs else value.shape
        wanted = packed.dtype[name].shape
        if value.size == 0 and wanted == tuple(map(room, one_run)):
            continue  # of bends, of which a vehicle without arms has none
        if one_run != wanted:
            of, remedy = f"{points} feature points", "give gains for the target's points"
            if 2 * points not in wanted:
                of, remedy = "the vehicle's sections", "make the controller for this vehicle"
            raise InputError(
                f"{name} of the controller {controller.name} has shape {one_run}, but {of} call "
                f"for {wanted}; {remedy}."
            )
        packed[name] = value
    return packed


def _rows(array: Array, runs: Array) -> Array:
    return array if len(array) == 1 else array[runs]


def _columns(table: Array, runs: Array) -> Array:
    return table if table.shape[1] == 1 else table[:, runs]
