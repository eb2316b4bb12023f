"""Device code of controller updates in a roll-out, with a control law or without.

It consists of Loop, the struct of a kernel's argument; Pilot, the struct of one run, made by
pilot_of(loop, run); decide(i, time, y, along, flight, pilot, held), the update at the start of step
i, a Decision; and push_at(row, time, y, along, flight, pilot, held), the actuator wrench at a
stage, with three rows per step. An open loop is a loop without a control law.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.camera import camera_code
from continuair.kernels.sensing.nominal import nominal_code
from continuair.kernels.sensing.sense import law_code
from continuair.vehicle.layout import MOTION, frame_columns, summed_columns

_NEAR = 0.1
"""Normalised image error above which it is not integrated, to prevent windup."""


@dataclass(frozen=True)
class PilotCode:
    """Structs and functions of controller updates."""

    Loop: Any
    Pilot: Any
    Decision: Any
    pilot_of: Any
    decide: Any
    push_at: Any
    sensed: Any = None


@wp.struct
class Nothing:
    """Loop without a control law."""

    nothing: wp.int32


@cache
def decision_of(numbers: Numbers, tree: Tree) -> Any:
    """Return Decision, the struct of a controller update."""
    types = device_types(numbers, tree)
    Real, Push = types.Real, types.Push

    @wp.struct
    class Decision:
        """Actuator wrench from now on; lost: 1 if no point is in view that the law needs, 2 if a
        vehicle under a flight controller has turned over, else 0."""

        push: Push
        lost: Real

    return Decision


@cache
def no_pilot(numbers: Numbers, tree: Tree) -> PilotCode:
    """Return the code without a control law."""
    types, Flight = device_types(numbers, tree), flight_code(numbers, tree).Flight
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along

    Loop, Pilot, Decision = Nothing, Nothing, decision_of(numbers, tree)
    sensed = None

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


def law_pilot(
    numbers: Numbers,
    tree: Tree,
    points: int,
    law: Any,
    every_stage: bool,
    integrates: bool = False,
    believes: bool = False,
) -> PilotCode:
    """Return the code of a control law.

    every_stage: whether the law acts at every stage of a step, else its wrench is held.
    integrates: whether the integral of the image error is added to it. believes: whether the law
    has a nominal model that differs from the simulated vehicle.
    """
    types, Flight = device_types(numbers, tree), flight_code(numbers, tree).Flight
    of_camera, ground = camera_code(numbers, tree, points), law_code(numbers, tree, points)
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Camera, Sight, Twist, Sense = of_camera.Camera, of_camera.Sight, of_camera.Twist, ground.Sense
    view_of, look, blur, proprioception = (
        of_camera.view_of,
        of_camera.look,
        of_camera.blur,
        ground.proprioception,
    )
    Gains, control, has_camera = law.Gains, law.control, points > 0
    Decision = decision_of(numbers, tree)
    Cell, three_of, code = types.Cell, types.three_of, number_code(numbers)
    keep, of_run, of_sample, above = code.keep, code.of_run, code.of_sample, code.above
    Cameras, AllGains = code.rows_of(Camera), code.rows_of(Gains)
    nominal, Vehicles = nominal_code(numbers, tree, points), flight_code(numbers, tree).Vehicles
    Believed, believed_of, read_with = nominal.Believed, nominal.believed_of, nominal.read_with
    flight_with, state_with = nominal.flight_with, nominal.state_with
    camera_of, gains_of = code.reader_of(Camera), code.reader_of(Gains)
    zero, one, frame_of = Real(0.0), Real(1.0), frame_columns(points)
    image, seen, depth = (frame_of[name].start for name in ("image", "seen", "depth"))
    place, speed = MOTION["position"].start, MOTION["velocity"].start
    summed = summed_columns(max(points, 1))
    total, clock, rate = (summed[name].start for name in ("sum", "time", "rate"))
    near = Real(_NEAR)

    @wp.struct
    class Loop:
        """Arguments of the control loop.

        Per step: acts, 1 if the law is updated at its start; exposed, frame taken then, or -1;
        shown, frame available then. Per run, or one for all: seeds of the noise, cameras and gains.
        corners: the target's points about its centroid; motion (rows, runs or 1, MOTION): of the
        centroid; desired images. frames (runs, slots, columns): delayed frames. needed: 1 if a run
        stops when all points are lost. believed, believed_cameras: nominal models, one per run or
        one.
        """

        acts: wp.array(dtype=wp.int32)
        exposed: wp.array(dtype=wp.int32)
        shown: wp.array(dtype=wp.int32)
        seeds: wp.array(dtype=wp.int32)
        cameras: Cameras
        gains: AllGains
        corners: wp.array2d(dtype=Cell)
        motion: wp.array3d(dtype=Cell)
        desired: wp.array2d(dtype=Cell)
        frames: wp.array3d(dtype=Cell)
        needed: wp.int32
        if believes:
            believed: Vehicles
            believed_cameras: Cameras

    @wp.struct
    class Pilot:
        """Control loop of one run."""

        loop: Loop
        run: wp.int32
        camera: Camera
        gains: Gains
        if believes:
            believed: Believed

    @wp.func
    def pilot_of(loop: Loop, run: int):
        out = Pilot()
        out.loop = loop
        out.run = run
        out.camera = camera_of(loop.cameras, run)
        out.gains = gains_of(loop.gains, run)
        if wp.static(believes):
            out.believed = believed_of(loop.believed, loop.believed_cameras, run, out.camera)
        return out

    @wp.func
    def expose(pilot: Pilot, frame: int, sight: Sight):
        frames, run = pilot.loop.frames, pilot.run
        slot = frame % frames.shape[1]
        for i in range(2 * points):
            keep(frames, run, slot, image + i, sight.image[i])
            keep(frames, run, slot, seen + i, sight.seen[i])
        for i in range(points):
            keep(frames, run, slot, depth + i, sight.depth[i])

    @wp.func
    def report(pilot: Pilot, frame: int):
        out = Sight()
        frames, run = pilot.loop.frames, pilot.run
        slot = frame % frames.shape[1]
        for i in range(2 * points):
            out.image[i] = of_sample(frames, run, slot, image + i)
            out.seen[i] = of_sample(frames, run, slot, seen + i)
        for i in range(points):
            out.depth[i] = of_sample(frames, run, slot, depth + i)
        return out

    @wp.func
    def sense_of(row: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot):
        """Return all measurements, with the true image; row: of the target's motion."""
        told, known = y, flight
        if wp.static(believes):
            told = state_with(y, flight, pilot.believed)
            known = flight_with(flight, pilot.believed)
        out = proprioception(time, told, known)
        if wp.static(has_camera):
            loop = pilot.loop
            out.camera = pilot.camera
            out.view = view_of(y, along, flight.plant, pilot.camera)
            at = three_of(loop.motion, row, pilot.run, place)
            out.sight = look(out.view, pilot.camera, at, loop.corners)
            for i in range(2 * points):
                out.desired[i] = of_run(loop.desired, pilot.run, i)
            if wp.static(believes):
                out.camera = pilot.believed.camera
                out.view = view_of(told, along, known.plant, out.camera)
                out.sight.image = read_with(out.sight.image, pilot.camera, pilot.believed)
                out.desired = read_with(out.desired, pilot.camera, pilot.believed)
            out.camera_twist = out.view.twist
            moving = three_of(loop.motion, row, pilot.run, speed)
            moving = wp.quat_rotate_inv(out.view.attitude, moving)
            out.target_twist = Twist(moving[0], moving[1], moving[2], zero, zero, zero)
        return out

    @wp.func
    def led(sense: Sense, time: Real, pilot: Pilot):
        """Update the integral of the image error, and return the desired image plus its share."""
        frames, run = pilot.loop.frames, pilot.run
        out = sense.desired
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        largest = zero
        for k in range(2 * points):
            largest = wp.max(largest, wp.abs(e[k]))
        passed = above(largest, near, zero, time - of_sample(frames, run, 0, clock))
        keep(frames, run, 0, clock, time)
        for k in range(2 * points):
            s = of_sample(frames, run, 0, total + k) + passed * e[k]
            keep(frames, run, 0, total + k, s)
            out[k] = out[k] + of_sample(frames, run, 0, rate) * s
        return out

    @wp.func
    def sensed(i: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot):
        """Return all measurements at the start of step i, with the available image.

        Return also 1 if no point is in view that the law needs, else 0.
        """
        loop, row, lost = pilot.loop, i, zero
        if wp.static(every_stage):
            row = 3 * i
        sense = sense_of(row, time, y, along, flight, pilot)
        if wp.static(has_camera):
            if loop.needed != 0:
                lost = above(sense.sight.in_view, zero, zero, one)
            if wp.static(not every_stage):
                if loop.exposed[i] >= 0:
                    blurred = blur(
                        sense.sight, sense.camera, loop.seeds, pilot.run, loop.exposed[i]
                    )
                    expose(pilot, loop.exposed[i], blurred)
                sense.sight = report(pilot, loop.shown[i])
            if wp.static(integrates):
                sense.desired = led(sense, time, pilot)
        return sense, lost

    @wp.func
    def decide(
        i: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot, held: Push
    ):
        loop, out = pilot.loop, Decision()
        out.push = held
        if loop.acts[i] != 0:
            sense, lost = sensed(i, time, y, along, flight, pilot)
            out.lost = lost
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
