"""Closed loops: a controller with its target and camera, packed for the roll-outs of an engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

from continuair.controllers.controller import Controller
from continuair.device.types import Tree, room
from continuair.engine.engine import Engine
from continuair.engine.factory import Closing, LoopKernels, closed_loop, packed_loop, watching
from continuair.engine.lanes import packs_of, struct_rows
from continuair.engine.law_made import Law, made_for_packs, made_law
from continuair.engine.pack import tree_of
from continuair.engine.struct_types import numpy_type
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

OverTime = Array | Callable[[Array], Array]
"""Numbers (times, runs or 1, columns), or, if these are many, a function of the wanted runs."""


_KEPT = 2e8
"""Largest size of numbers over time that are kept for all runs [bytes]."""


@dataclass(frozen=True)
class Timing:
    """Times of controller updates and camera frames, per step (m,).

    acts: whether the controller is updated at the start of a step; exposed: frame taken then, or
    -1; shown: frame available to the controller then; every_stage: whether the law acts at every
    stage, too.
    """

    acts: Array
    exposed: Array
    shown: Array
    every_stage: bool


@dataclass(frozen=True)
class Scene:
    """Target of the camera.

    corners (points, 3): feature points about the centroid. desired (runs or 1, 2 points): desired
    image. motion (rows, runs or 1, 6): position and velocity of the centroid, three rows per step
    if the law acts at every stage, else one. motion_at_samples (samples, runs or 1, 6): the same at
    the samples.
    """

    corners: Array
    desired: Array
    motion: OverTime
    motion_at_samples: OverTime


@dataclass(frozen=True)
class Guidance:
    """Setpoints and timing of a law that follows setpoints.

    Per step (m,): issued, the index of the actuator wrench computed at its start, or -1; taken, the
    index of the wrench that acts from then on, or -1. slots: most delayed wrenches at a time.
    wanted (wrenches, runs or 1, columns): setpoints. upright (runs or 1, 1): 1 if a run starts
    upright.
    """

    issued: Array
    taken: Array
    slots: int
    wanted: OverTime
    upright: Array


_NOTHING = Scene(
    np.zeros((1, 3)), np.zeros((1, 2)), *(np.zeros((1, 1, width_of(MOTION))) for _ in range(2))
)


@dataclass(frozen=True, eq=False)
class Loop:
    """Closed loop over one time grid: controller, timing and target.

    scene: None for a controller without a target. seeds (runs,): of the noise. guidance: of a
    controller that follows setpoints.
    """

    controller: Controller
    timing: Timing
    scene: Scene | None
    seeds: Array
    guidance: Guidance | None = None
    _packed: dict[tuple[Engine, int], PackedLoop] = field(default_factory=dict)

    @property
    def points(self) -> int:
        """Return the number of feature points."""
        return 0 if self.scene is None else len(self.scene.corners)

    def on(self, engine: Engine, runs: int) -> PackedLoop:
        """Return the loop packed for an engine and a number of runs.

        Raises InputError if the gains do not fit the law.
        """
        lanes = engine.lanes(runs)
        if (engine, lanes) not in self._packed:
            law, how = self._law(engine), self._how(engine)
            kernels = closed_loop(made_law(*law), engine.model, how)
            # What is wrong with the gains is told before anything is compiled, as packs are.
            _check_memory(self.controller, kernels)
            gains = pack_gains(self.controller, kernels.Gains, self.points)
            several = made_for_packs(*law, lanes) if lanes > 1 else None
            packed = None if several is None else packed_loop(several, engine.model, how)
            cameras = pack_cameras(engine.vehicle, kernels.camera.Camera)
            model, Camera = self.controller.believes, kernels.camera.Camera
            nominal = None if model is None else _nominal_model(model, engine, Camera)
            found = PackedLoop(self, packed or kernels, cameras, gains, nominal)
            self._packed[engine, lanes] = found
        return self._packed[engine, lanes]

    def rollout(self, engine: Engine, runs: int) -> wp.Kernel | None:
        """Return the kernel that so many runs fly with, not loaded, or None if that shows later."""
        law = made_for_packs(*self._law(engine), engine.lanes(runs))
        try:
            found = None if law is None else closed_loop(law, engine.model, self._how(engine))
        except Exception:
            # A law may raise anything with unexpected number types.
            return None
        return None if found is None else found.rollout

    def _law(self, engine: Engine) -> tuple[Law, str, Tree, int]:
        return self.controller.law, engine.dtype.name, engine.tree, self.points

    def _how(self, engine: Engine) -> Closing:
        return Closing(
            self.timing.every_stage,
            engine.method,
            self.controller.integral > 0.0,
            self.controller.believes is not None,
        )

    def watch(self, engine: Engine, log: Array, runs: Array) -> Array | None:
        """Return camera and image features along logged rows of some runs, None without target."""
        if self.scene is None:
            return None
        return watch(engine, log, self.scene.corners, self.scene.motion_at_samples, runs)


@dataclass(frozen=True, eq=False)
class PackedLoop:
    """Kernels of a loop, with packed cameras and gains (runs or 1,).

    nominal: nominal model of the law, if it differs from the simulated vehicle.
    """

    loop: Loop
    kernels: LoopKernels
    cameras: Array
    gains: Array
    nominal: NominalModel | None = None

    def struct(self, engine: Engine, runs: Array) -> Any:
        """Return the struct of some runs."""
        if self.loop.guidance is not None:
            return self._guided(engine, runs, self.loop.guidance)
        return self._filled(self.kernels.pilot.Loop(), engine, runs)

    def _filled(self, found: Any, engine: Engine, runs: Array) -> Any:
        """Fill and return a struct with gains, timing and target."""
        loop, kernels, timing = self.loop, self.kernels, self.loop.timing
        scene = loop.scene or _NOTHING
        on_their_way = np.maximum.accumulate(timing.exposed) - timing.shown
        slots = 1 + int(on_their_way[timing.acts != 0].max(initial=0))
        for name in ("acts", "exposed", "shown"):
            setattr(found, name, engine.upload(getattr(timing, name), wp.int32))
        found.seeds = engine.upload(loop.seeds[runs], wp.int32)
        at = kernels.lanes, engine.device
        found.cameras = struct_rows(_rows(self.cameras, runs), kernels.camera.Camera, *at)
        found.gains = struct_rows(_rows(self.gains, runs), kernels.Gains, *at)
        found.corners = engine.upload(scene.corners)
        motion = columns_of_runs(scene.motion, runs)
        if timing.every_stage and engine.method == TSIT5:
            # Memory for the motion at the time of each stage.
            motion = np.zeros((1, len(runs), width_of(MOTION)))
        found.motion = engine.upload(motion)
        found.desired = engine.upload(_rows(scene.desired, runs))
        found.frames = engine.upload(self._frames(len(runs), slots))
        found.needed = int(loop.controller.looks)
        if self.nominal is not None:
            model, own = self.nominal.engine, _rows(self.nominal.cameras, runs)
            found.believed = model.vehicles(runs, engine.kernels_of(kernels.lanes))
            found.believed_cameras = struct_rows(own, kernels.camera.Camera, *at)
        return found

    def _frames(self, runs: int, slots: int) -> Array:
        """Return memory for delayed frames, and behind the first one for the integrated error."""
        points, integral = max(self.loop.points, 1), self.loop.controller.integral
        if not integral:
            return np.zeros((runs, slots, width_of(frame_columns(points))))
        summed = summed_columns(points)
        frames = np.zeros((runs, slots, width_of(summed)))
        frames[:, 0, summed["rate"]] = integral
        return frames

    def _guided(self, engine: Engine, runs: Array, guidance: Guidance) -> Any:
        """Return the struct of some runs under a law that follows setpoints."""
        kernels, found = self.kernels, self.kernels.pilot.Loop()
        self._filled(found.sight, engine, runs)
        for name in ("issued", "taken"):
            setattr(found, name, engine.upload(getattr(guidance, name), wp.int32))
        found.wanted = engine.upload(columns_of_runs(guidance.wanted, runs))
        found.upright = engine.upload(_rows(guidance.upright, runs))
        found.memory = engine.upload(np.zeros((len(runs), 1, kernels.remembered)))
        pushes = engine.layout.push.stop
        found.pushes = engine.upload(np.zeros((len(runs), guidance.slots, pushes)))
        return found


@dataclass(frozen=True, eq=False)
class NominalModel:
    """Nominal model of a law, packed as the simulated vehicle is, and its cameras."""

    engine: Engine
    cameras: Array


def _nominal_model(model: Vehicle, engine: Engine, Camera: Any) -> NominalModel:
    """Return a packed nominal model; raise InputError if vehicles differ by more than numbers."""
    if tree_of(model) != engine.tree:
        raise InputError(
            "believes",
            (
                f"is the vehicle {shown(model.name)}, whose arms, sections, tips, mounts "
                f"or terms differ from those of {shown(engine.vehicle.name)}"
            ),
            "build it by replace",
        )
    packed = Engine(model, engine.model, engine.dtype.name, engine.device, engine.threads)
    for term in engine.tree.terms:
        read = packed.plants.dtype.names or ()
        names = [name for name in (*term.flown, "term_numbers") if name in read]
        if any((packed.plants[name] != engine.plants[name]).any() for name in names):
            raise InputError(
                "believes",
                (
                    f"is the vehicle {shown(model.name)}, whose {name_of(term)} differs "
                    f"from that of {shown(engine.vehicle.name)}"
                ),
                "no law uses it, so leave it unchanged",
            )
    return NominalModel(packed, pack_cameras(model, Camera))


def watch(
    engine: Engine, log: Array, corners: Array, motion: OverTime, runs: Array | None = None
) -> Array:
    """Return camera and image features (runs, samples, columns) along rows (runs, samples, log).

    corners: (points, 3); motion: (samples, runs or 1, 6) of the target's centroid, as in a Scene;
    runs: indices into the vehicles and the motion, by default all.
    """
    of, lanes = (engine.dtype.name, engine.tree, len(corners)), engine.lanes(len(log))
    kernel, of_camera = watching(*of, lanes)
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
            struct_rows(cameras, of_camera.Camera, lanes, engine.device),
            engine.upload(corners),
            engine.upload(columns_of_runs(motion, runs)),
            engine.upload(log),
            out,
        ],
    )
    engine.download(out, watched)
    watched[~np.isfinite(log[..., 0])] = np.nan
    return watched


def pack_cameras(vehicle: Vehicle, Camera: Any) -> Array:
    """Return the structured cameras (runs or 1,) of a vehicle."""
    runs, camera = vehicle.runs or 1, vehicle.camera
    packed = np.zeros(runs, dtype=numpy_type(Camera))
    packed["focal"] = per_run(camera.focal_length, runs, 2)
    packed["principal"] = per_run(camera.principal_point, runs, 2)
    packed["size"] = per_run(camera.image_size, runs, 2)
    packed["position"] = per_run(camera.position, runs, 3)
    packed["attitude"] = per_run(camera.attitude, runs, 4)
    packed["frenet"] = np.broadcast_to(np.asarray(camera.tip_frame) == "frenet", runs)
    packed["noise"] = per_run(camera.noise, runs)
    return packed


def _check_memory(controller: Controller, kernels: LoopKernels) -> None:
    """Raise InputError if controller and law disagree about a memory or the use of the camera."""
    if controller.guided != bool(kernels.remembered):
        has = "has no Memory" if controller.guided else "has a Memory"
        raise InputError(
            "guided",
            f"is {controller.guided} in the controller {controller.name}, but its law {has}",
            f"give guided={not controller.guided}",
        )
    if controller.guided and controller.looks != kernels.looks:
        raise InputError(
            "looks",
            (
                f"is {controller.looks} in the controller {controller.name}, but "
                f"{kernels.looks} in its law"
            ),
            f"give looks={kernels.looks}",
        )


def pack_gains(controller: Controller, Gains: Any, points: int) -> Array:
    """Return structured gains (runs or 1,); raise InputError if they do not fit the law."""
    packed = np.zeros(controller.runs or 1, dtype=numpy_type(Gains))
    expected = packed.dtype.names or ()
    given = controller.gains
    for name in sorted(set(expected) ^ set(given)):
        problem = "is missing from" if name in expected else "is not a field of the law but in"
        raise InputError(
            name,
            f"{problem} the gains of the controller {controller.name}",
            f"give {', '.join(expected)}" if name in expected else f"remove {name}",
        )
    for name, value in given.items():
        one_run = value.shape[1:] if controller.runs else value.shape
        wanted = packed.dtype[name].shape
        if value.size == 0 and wanted == tuple(map(room, one_run)):
            continue  # gains of bends, for a vehicle without arms
        if one_run != wanted:
            of, remedy = f"{points} feature points", "give gains for the target's points"
            if 2 * points not in wanted:
                of, remedy = "the vehicle's sections", "make the controller for this vehicle"
            raise InputError(
                name,
                (
                    f"of the controller {controller.name} has shape {one_run}, but {of} "
                    f"call for {wanted}"
                ),
                remedy,
            )
        packed[name] = value
    return packed


def _rows(array: Array, runs: Array) -> Array:
    return array if len(array) == 1 else array[runs]


def over_time(evaluate: Callable[..., Array], numbers: int) -> OverTime:
    """Return what a function of runs, by default all, returns: at once, unless it is too large."""
    return evaluate if 8 * numbers > _KEPT else evaluate()


def columns_of_runs(table: OverTime, runs: Array) -> Array:
    """Return the columns (times, runs or 1, numbers) of some runs."""
    if callable(table):
        return table(runs)
    return table if table.shape[1] == 1 else table[:, runs]
