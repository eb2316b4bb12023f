"""Kernels that fly: a whole roll-out per thread, with a law or without one, and single rates."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.dynamics import Dynamics
from continuair.kernels.flight import flight_code
from continuair.kernels.options import OPTIONS
from continuair.kernels.sensing.pilot import PilotCode
from continuair.kernels.step import OK, UNSEEN, step_code, stepping_code
from continuair.kernels.types import FULL_LENGTH, Tree, device_types, holding
from continuair.vehicle.layout import PAPER

MEASURED_EVERY = 4
"""One step of so many is measured, for all of them: what they leave out changes slowly."""

FEW_STEPS = 32
"""In a flight of fewer steps, every one is measured."""


@dataclass(frozen=True)
class Arguments:
    """Structs of the kernels' arguments: where runs begin, and the steps that they take."""

    Start: Any
    Steps: Any


@cache
def arguments(precision: str) -> Arguments:
    """The structs for one precision."""
    Real = getattr(wp, precision)

    @wp.struct
    class Start:
        """states (runs, state); frozen, the same or what `independent` freezes; angle (runs,
        sections + 1), ψa of each section and the roll."""

        states: wp.array2d(dtype=Real)
        frozen: wp.array2d(dtype=Real)
        angle: wp.array2d(dtype=Real)

    @wp.struct
    class Steps:
        """Starts and lengths of the steps, and the sample that a step ends at, or -1."""

        starts: wp.array(dtype=Real)
        lengths: wp.array(dtype=Real)
        sample_after: wp.array(dtype=wp.int32)

    return holding(Arguments, locals())


def rollout_kernel(
    precision: str, tree: Tree, dynamics: Dynamics, pilot: PilotCode, log_row: Any
) -> Any:
    """The kernel `rollout` of a model under a pilot; log_row: of kernels/logs.py.

    log: (runs, samples, columns). status, last_step: (runs,), how a run ended and at which step.
    errors: (runs, 2), in arm lengths the sum of what its steps leave out and the most that
    torques may have gone the wrong way, and its swing, the integral of |k| |k̇| l² over time.
    """
    types, structs = device_types(precision, tree), flight_code(precision, tree)
    stepping, begins = stepping_code(precision, tree), arguments(precision)
    Real, Push, load_state = types.Real, types.Push, types.load_state
    Vehicles, Drive, Start, Steps = structs.Vehicles, structs.Drive, begins.Start, begins.Steps
    flight_of, freeze = structs.flight_of, structs.freeze
    branch_at, followed, end_of = stepping.branch_at, stepping.followed, stepping.end_of
    Loop, pilot_of, decide, push_at = pilot.Loop, pilot.pilot_of, pilot.decide, pilot.push_at
    step = step_code(precision, tree, dynamics.rate_of, pilot)
    bend_of, bend_rate_of = types.bend_of, types.bend_rate_of
    one_of, few = MEASURED_EVERY, FEW_STEPS
    ok, unseen, full, sections = OK, UNSEEN, Real(FULL_LENGTH), types.layout.sections
    paper, misdirected = PAPER, dynamics.loads.misdirected

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def rollout(
        vehicles: Vehicles,
        start: Start,
        drive: Drive,
        steps: Steps,
        loop: Loop,
        log: wp.array3d(dtype=Real),
        status: wp.array(dtype=wp.int32),
        last_step: wp.array(dtype=wp.int32),
        errors: wp.array2d(dtype=Real),
    ):
        run = wp.tid()
        flight = flight_of(vehicles, drive, run)
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, load_state(start.frozen, run, flight.plant.unit))
        y = load_state(start.states, run, flight.plant.unit)
        branch = branch_at(start.angle, run)
        pilot = pilot_of(loop, run)
        push = Push()
        ended = wp.int32(ok)
        due = wp.int32(0)
        count = steps.lengths.shape[0]
        done = count
        every = wp.int32(one_of)
        if count < few:
            every = wp.int32(1)
        error = Real(0.0)
        doubt = Real(0.0)
        swing = Real(0.0)
        for i in range(count):
            decision = decide(i, steps.starts[i], y, branch.direction, flight, pilot, push)
            push = decision.push
            if due >= 0:
                log_row(log, run, due, y, flight, branch, push)
            if decision.lost:
                ended = wp.int32(unseen)
                done = i
                break
            h = steps.lengths[i]
            stands_for = Real(0.0)
            measured = i % every == 0
            if measured:
                stands_for = Real(wp.min(every, count - i))
                for k in range(sections):
                    swing += (
                        stands_for * h * wp.length(bend_of(y, k)) * wp.length(bend_rate_of(y, k))
                    )
            begun = y
            y, left_out = step(
                i, steps.starts[i], h, y, branch.direction, flight, pilot, push, measured
            )
            error += stands_for * left_out
            if (flight.groups & paper) != 0:
                wrong_way = misdirected(begun, y, branch.direction, flight, i * flight.stride)
                doubt = wp.max(doubt, wrong_way)
            ended = end_of(y)
            due = -1
            if ended != ok:
                done = i
                break
            branch = followed(branch, y)
            due = steps.sample_after[i]
        if ended == ok and due >= 0:
            last = count - 1
            at = steps.starts[last] + steps.lengths[last]
            push = push_at(3 * last + 2, at, y, branch.direction, flight, pilot, push)
            log_row(log, run, due, y, flight, branch, push)
        status[run] = ended
        last_step[run] = done
        if not wp.isfinite(error + swing):
            error = Real(wp.inf)
            swing = Real(0.0)
        errors[run, 0] = error + doubt
        errors[run, 1] = swing * full * full

    return rollout


def derivative_kernel(precision: str, tree: Tree, dynamics: Dynamics) -> Any:
    """The kernel `derivative` of a model: rates of states, under one row of inputs."""
    types, structs = device_types(precision, tree), flight_code(precision, tree)
    stepping, begins = stepping_code(precision, tree), arguments(precision)
    Real, Push, load_state, bend_of = types.Real, types.Push, types.load_state, types.bend_of
    Vehicles, Drive, Start = structs.Vehicles, structs.Drive, begins.Start
    flight_of, freeze, branch_at = structs.flight_of, structs.freeze, stepping.branch_at
    layout, two, rate_of = types.layout, Real(2.0), dynamics.rate_of
    sections = layout.sections
    width, bends, B, DB = layout.state, layout.bends, layout.bend.start, layout.bend_rate.start

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def derivative(vehicles: Vehicles, start: Start, drive: Drive, rates: wp.array2d(dtype=Real)):
        run = wp.tid()
        flight = flight_of(vehicles, drive, run)
        unit = flight.plant.unit
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, load_state(start.frozen, run, unit))
        y = load_state(start.states, run, unit)
        dy = rate_of(y, branch_at(start.angle, run).direction, flight, 0, Push())
        for j in range(bends):
            dy[B + j] = dy[B + j] / unit[j // 2]
            dy[DB + j] = dy[DB + j] / unit[j // 2]
        for j in range(width):
            rates[run, j] = dy[j]
            for k in range(sections):
                if wp.length_sq(bend_of(y, k)) > two:
                    rates[run, j] = Real(wp.nan)

    return derivative
