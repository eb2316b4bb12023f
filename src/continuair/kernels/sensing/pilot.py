"""Device code of who pushes during a roll-out: nobody, or a law that senses and decides.

A pilot gives Loop, the struct of a kernel's argument; Pilot, the struct of one run, made by
pilot_of(loop, run); decide(i, time, y, along, flight, pilot, held) at the start of step i, a
Decision; and push_at(row, time, y, along, flight, pilot, held), the push at a stage, rows three to
a step. An open loop is a loop without a law.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.eye import eye_code
from continuair.kernels.sensing.sense import law_code
from continuair.kernels.types import Tree, device_types, holding
from continuair.vehicle.layout import MOTION, frame_columns


@dataclass(frozen=True)
class PilotCode:
    """Structs and functions of a pilot."""

    Loop: Any
    Pilot: Any
    Decision: Any
    pilot_of: Any
    decide: Any
    push_at: Any


@cache
def no_pilot(precision: str, tree: Tree) -> PilotCode:
    """Nobody pushes."""
    types, Flight = device_types(precision, tree), flight_code(precision, tree).Flight
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along

    @wp.struct
    class Loop:
        nothing: wp.int32

    @wp.struct
    class Pilot:
        nothing: wp.int32

    @wp.struct
    class Decision:
        push: Push
        lost: wp.bool

    @wp.func
    def pilot_of(loop: Loop, run: int):
        return Pilot()

    @wp.func
    def decide(
        i: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot, held: Push
    ):
        return Decision()

    @wp.func
    def push_at(
        row: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot, held: Push
    ):
        return held

    return holding(PilotCode, locals())


def law_pilot(precision: str, tree: Tree, points: int, law: Any, every_stage: bool) -> PilotCode:
    """A law pushes; every_stage: at every stage of a step, else its push is held."""
    types, Flight = device_types(precision, tree), flight_code(precision, tree).Flight
    eye, ground = eye_code(precision, tree, points), law_code(precision, tree, points)
    Real, State, Push, Along, vec3 = types.Real, types.State, types.Push, types.Along, types.vec3
    Camera, Sight, Twist, Sense = eye.Camera, eye.Sight, eye.Twist, ground.Sense
    view_of, look, blur, proprioception = eye.view_of, eye.look, eye.blur, ground.proprioception
    Gains, control, has_camera = law.Gains, law.control, points > 0
    three_of, zero, frame_of = types.three_of, Real(0.0), frame_columns(points)
    image, seen, depth = (frame_of[name].start for name in ("image", "seen", "depth"))
    place, speed = MOTION["position"].start, MOTION["velocity"].start

    @wp.struct
    class Loop:
        """When the law acts, what with, and what it looks at.

        Per step: acts, 1 where the law does at its start; exposed, the frame taken then or -1;
        shown, the frame that it has then. Per run: seeds of the noise, cameras and gains, one or
        one each. The target's points about its centroid and that one's motion (rows, runs or 1,
        MOTION); desired images. frames (runs, slots, columns): on their way. needed: 1 if a run
        ends when all points are lost, as it does for a law that looks.
        """

        acts: wp.array(dtype=wp.int32)
        exposed: wp.array(dtype=wp.int32)
        shown: wp.array(dtype=wp.int32)
        seeds: wp.array(dtype=wp.int32)
        cameras: wp.array(dtype=Camera)
        gains: wp.array(dtype=Gains)
        corners: wp.array(dtype=vec3)
        motion: wp.array3d(dtype=Real)
        desired: wp.array2d(dtype=Real)
        frames: wp.array3d(dtype=Real)
        needed: wp.int32

    @wp.struct
    class Pilot:
        """One run of the loop."""

        loop: Loop
        run: wp.int32
        camera: Camera
        gains: Gains

    @wp.struct
    class Decision:
        """The push from now on; lost: whether no point is in view that is needed."""

        push: Push
        lost: wp.bool

    @wp.func
    def pilot_of(loop: Loop, run: int):
        out = Pilot()
        out.loop = loop
        out.run = run
        out.camera = loop.cameras[wp.min(run, loop.cameras.shape[0] - 1)]
        out.gains = loop.gains[wp.min(run, loop.gains.shape[0] - 1)]
        return out

    @wp.func
    def expose(pilot: Pilot, frame: int, sight: Sight):
        frames, run = pilot.loop.frames, pilot.run
        slot = frame % frames.shape[1]
        for i in range(2 * points):
            frames[run, slot, image + i] = sight.image[i]
            frames[run, slot, seen + i] = sight.seen[i]
        for i in range(points):
            frames[run, slot, depth + i] = sight.depth[i]

    @wp.func
    def report(pilot: Pilot, frame: int):
        out = Sight()
        frames, run = pilot.loop.frames, pilot.run
        slot = frame % frames.shape[1]
        for i in range(2 * points):
            out.image[i] = frames[run, slot, image + i]
            out.seen[i] = frames[run, slot, seen + i]
        for i in range(points):
            out.depth[i] = frames[run, slot, depth + i]
        return out

    @wp.func
    def sense_of(row: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot):
        """All that is sensed, with the true image; row: of the target's motion."""
        out = proprioception(time, y, flight)
        if wp.static(has_camera):
            loop = pilot.loop
            column = wp.min(pilot.run, loop.motion.shape[1] - 1)
            out.camera = pilot.camera
            out.view = view_of(y, along, flight.plant, pilot.camera)
            out.camera_twist = out.view.twist
            moving = three_of(loop.motion, row, column, speed)
            moving = wp.quat_rotate_inv(out.view.attitude, moving)
            out.target_twist = Twist(moving[0], moving[1], moving[2], zero, zero, zero)
            at = three_of(loop.motion, row, column, place)
            out.sight = look(out.view, pilot.camera, at, loop.corners)
            wanted = wp.min(pilot.run, loop.desired.shape[0] - 1)
            for i in range(2 * points):
                out.desired[i] = loop.desired[wanted, i]
        return out

    @wp.func
    def decide(
        i: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot, held: Push
    ):
        loop, out = pilot.loop, Decision()
        out.push = held
        if loop.acts[i] != 0:
            row = i
            if wp.static(every_stage):
                row = 3 * i
            sense = sense_of(row, time, y, along, flight, pilot)
            if wp.static(has_camera):
                out.lost = loop.needed != 0 and sense.sight.in_view == 0
                if wp.static(not every_stage):
                    if loop.exposed[i] >= 0:
                        blurred = blur(
                            sense.sight, pilot.camera, loop.seeds[pilot.run], loop.exposed[i]
                        )
                        expose(pilot, loop.exposed[i], blurred)
                    sense.sight = report(pilot, loop.shown[i])
            out.push = control(sense, pilot.gains)
        return out

    @wp.func
    def push_at(
        row: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot, held: Push
    ):
        if wp.static(every_stage):
            return control(sense_of(row, time, y, along, flight, pilot), pilot.gains)
        return held

    return holding(PilotCode, locals())
