"""Device code of controller updates with setpoints, a memory and a delay.

Such a law returns Gains; looks, whether it needs the camera; Memory, a vector that is 0 at the
start; and control(sense, gains, flight, wanted, memory) -> push, memory. Gains.noise is its
measurement noise. Its force is a thrust along the body's z axis, and rotates with the body between
updates.
"""

from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.guidance import guidance_code
from continuair.kernels.sensing.nominal import nominal_code
from continuair.kernels.sensing.pilot import PilotCode, decision_of, law_pilot
from continuair.kernels.sensing.sense import law_code


def guided_pilot(
    numbers: Numbers, tree: Tree, points: int, law: Any, believes: bool = False
) -> PilotCode:
    """Return the controller code of a law with a memory; believes: as in `law_pilot`."""
    types, Flight = device_types(numbers, tree), flight_code(numbers, tree).Flight
    code, ground = number_code(numbers), guidance_code(numbers, tree)
    Cell, Real, State, Push, Along = types.Cell, types.Real, types.State, types.Push, types.Along
    vec3, attitude_of, push_of = types.vec3, types.attitude_of, types.push_of
    force_of, moment_of, bend_moment_of = types.force_of, types.moment_of, types.bend_moment_of
    proprioception = law_code(numbers, tree, points).proprioception
    looks = law.looks
    points = points if looks else 0
    seeing = law_pilot(numbers, tree, points, law, every_stage=False, believes=believes)
    nominal = nominal_code(numbers, tree, points)
    flight_with, state_with = nominal.flight_with, nominal.state_with
    Sight, Looking, look_of, seen_at = seeing.Loop, seeing.Pilot, seeing.pilot_of, seeing.sensed
    set_point_of, disturbed = ground.set_point_of, ground.disturbed
    Memory, control, Decision = law.Memory, law.control, decision_of(numbers, tree)
    keep, of_sample, of_run, above = code.keep, code.of_sample, code.of_run, code.above
    remembered, pushes = law.Memory._length_, types.layout.push.stop
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)

    @wp.struct
    class Loop:
        """Arguments of the control loop.

        sight: gains, seeds and target, as of a law without memory. Per step: issued, index of the
        actuator wrench computed at its start, or -1; taken, index of the wrench that acts from then
        on, or -1 for the previous one. wanted (wrenches, runs or 1, columns): setpoints. memory
        (runs, 1, numbers). pushes (runs, slots, columns): delayed wrenches. upright (runs or 1, 1):
        1 if a run starts upright; such a run stops if it turns over.
        """

        sight: Sight
        issued: wp.array(dtype=wp.int32)
        taken: wp.array(dtype=wp.int32)
        wanted: wp.array3d(dtype=Cell)
        memory: wp.array3d(dtype=Cell)
        pushes: wp.array3d(dtype=Cell)
        upright: wp.array2d(dtype=Cell)

    @wp.struct
    class Pilot:
        """Control loop of one run."""

        loop: Loop
        run: wp.int32
        looking: Looking

    @wp.func
    def pilot_of(loop: Loop, run: int):
        out = Pilot()
        out.loop = loop
        out.run = run
        out.looking = look_of(loop.sight, run)
        return out

    @wp.func
    def turned(push: Push, y: State):
        """Return an actuator wrench with its force along the current z axis of the body."""
        along = wp.quat_rotate(attitude_of(y), vec3(zero, zero, one))
        force = wp.length(force_of(push)) * along
        return push_of(force, moment_of(push), bend_moment_of(push))

    @wp.func
    def issue(i: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot):
        """Update the law, and store its delayed wrench; return 1 if all points are lost, else 0."""
        loop, run = pilot.loop, pilot.run
        instant, gains, lost = loop.issued[i], pilot.looking.gains, zero
        memory = Memory()
        for k in range(remembered):
            memory[k] = of_sample(loop.memory, run, 0, k)
        told = disturbed(y, gains.noise, loop.sight.seeds, run, instant)
        wanted = set_point_of(loop.wanted, instant, run)
        known = flight
        if wp.static(believes):
            told = state_with(told, flight, pilot.looking.believed)
            known = flight_with(flight, pilot.looking.believed)
        sense = proprioception(time, told, known)
        if wp.static(looks):
            seen, lost = seen_at(i, time, y, along, flight, pilot.looking)
            sense.sight = seen.sight
            sense.desired = seen.desired
            sense.camera = seen.camera
            sense.view = seen.view
            sense.camera_twist = seen.camera_twist
            sense.target_twist = seen.target_twist
        push, memory = control(sense, gains, known, wanted, memory)
        for k in range(remembered):
            keep(loop.memory, run, 0, k, memory[k])
        for k in range(pushes):
            keep(loop.pushes, run, instant % loop.pushes.shape[1], k, push[k])
        return lost

    @wp.func
    def decide(
        i: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot, held: Push
    ):
        loop, out = pilot.loop, Decision()
        push = held
        if loop.issued[i] >= 0:
            lost = issue(i, time, y, along, flight, pilot)
            up = wp.quat_rotate(attitude_of(y), vec3(zero, zero, one))
            began = of_run(loop.upright, pilot.run, 0)
            over = above(zero, up[2], above(began, half, one, zero), zero)
            out.lost = wp.max(lost, two * over)
        if loop.taken[i] >= 0:
            slot = loop.taken[i] % loop.pushes.shape[1]
            for k in range(pushes):
                push[k] = of_sample(loop.pushes, pilot.run, slot, k)
        out.push = turned(push, y)
        return out

    @wp.func
    def push_at(
        row: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot, held: Push
    ):
        return turned(held, y)

    sensed = None
    return holding(PilotCode, locals())
