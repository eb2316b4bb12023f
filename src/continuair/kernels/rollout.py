"""Kernels of roll-outs, one per thread, with or without a control law, and of single rates."""

from typing import Any

import numpy as np
import warp as wp

from continuair.device.arguments import arguments
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.dynamics import Dynamics
from continuair.kernels.flight import flight_code
from continuair.kernels.integrators import INTEGRATORS
from continuair.kernels.sensing.pilot import PilotCode
from continuair.kernels.step import OVERTURNED, UNSEEN, stepping_code


def rollout_kernel(
    numbers: Numbers,
    tree: Tree,
    dynamics: Dynamics,
    pilot: PilotCode,
    log_row: Any,
    method: str = "RK4",
    name: str = "rollout",
) -> Any:
    """Return the kernel `rollout` of a model under a controller; log_row: of kernels/logs.py.

    name: of the kernel and its module. It must distinguish controllers whose constants differ by
    less than single precision, because Warp does not.

    log: (runs, samples, columns). status, last_step: (runs,), how and at which step a run stopped.
    saturation: (runs, 1), the largest demand of thrust beyond the rotors' limits at the start of a
    step, as a share of their range.
    """
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    stepping, begins = stepping_code(numbers, tree), arguments(numbers.precision)
    code, Cell, Real, State = number_code(numbers), types.Cell, types.Real, types.State
    Push = types.Push
    Vehicles, Drive, Start, Steps = structs.Vehicles, begins.Drive, begins.Start, begins.Steps
    flight_of, freeze, load_state = structs.flight_of, structs.freeze, types.load_state
    branch_at, end_of = stepping.branch_at, stepping.end_of
    Path, followed = stepping.Path, stepping.followed
    after, compensated = stepping.added, stepping.compensated
    coarse = numbers.precision == "float32"
    Loop, pilot_of, decide, push_at = pilot.Loop, pilot.pilot_of, pilot.decide, pilot.push_at
    step = INTEGRATORS[method].step_code(numbers, tree, dynamics, pilot)
    lanes, above, all_above, any_above = code.lanes, code.above, code.all_above, code.any_above
    mark, keep_whole, keep_of_run = code.mark, code.keep_whole, code.keep_of_run
    zero, one, excess_of = Real(0.0), Real(1.0), dynamics.loads.excess_of
    unseen, overturned = Real(float(UNSEEN)), Real(float(OVERTURNED))
    limited, settled = excess_of is not None, dynamics.loads.settled
    remembers, switched = settled is not None, dynamics.switched
    switches = switched is not None

    @wp.kernel(name=name, enable_backward=False, module="unique", module_options=code.options)
    def rollout(
        vehicles: Vehicles,
        start: Start,
        drive: Drive,
        steps: Steps,
        loop: Loop,
        log: wp.array3d(dtype=Cell),
        status: wp.array(dtype=wp.int32),
        last_step: wp.array(dtype=wp.int32),
        saturation: wp.array2d(dtype=Cell),
    ):
        run = wp.tid() * lanes
        flight = flight_of(vehicles, drive, run)
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, load_state(start.frozen, run, 0, flight.plant.unit))
        y = load_state(start.states, run, 0, flight.plant.unit)
        if wp.static(coarse):
            rest = State()
        branch = branch_at(start.angle, run)
        pilot = pilot_of(loop, run)
        push = Push()
        ended = Real(0.0)
        due = wp.int32(0)
        count = steps.lengths.shape[0]
        mark(last_step, run, one, count)
        excess = Real(0.0)
        for i in range(count):
            time = Real(steps.starts[i])
            if wp.static(switches):
                y, now = switched(y, flight, time)
            decision = decide(i, time, y, branch.direction, flight, pilot, push)
            push = decision.push
            if due >= 0:
                log_row(
                    log, Real(Cell(due)), above(ended, zero, zero, one), y, flight, branch, push
                )
            due = -1
            gone = above(decision.lost, one, overturned, unseen * decision.lost)
            lost = above(ended, zero, zero, gone)
            if any_above(lost, zero):
                mark(last_step, run, lost, i)
                ended += lost
                if all_above(ended, zero):
                    break
            if wp.static(limited):
                beyond = excess_of(y, flight, i * flight.stride, push)
                excess = wp.max(excess, above(ended, zero, zero, beyond))
            h = Real(steps.lengths[i])
            before = y
            change = step(i, time, h, y, branch.direction, flight, pilot, push)
            if wp.static(coarse):
                y, rest = compensated(y, rest, change)
            else:
                y = after(y, change)
            if wp.static(remembers):
                row = i * flight.stride + wp.min(flight.stride, 2)
                y = settled(y, flight, row, push_at(
                    3 * i + 2, time + h, y, branch.direction, flight, pilot, push
                ))  # fmt: skip
            now = above(ended, zero, zero, end_of(y))
            if any_above(now, zero):
                mark(last_step, run, now, i)
                ended += now
                if all_above(ended, zero):
                    break
            path = Path()
            path.change = y - before
            path.begins = path.change
            path.ends = path.change
            branch = followed(branch, before, path, one, y)
            due = steps.sample_after[i]
        if due >= 0:
            last = count - 1
            time = Real(steps.starts[last]) + Real(steps.lengths[last])
            push = push_at(3 * last + 2, time, y, branch.direction, flight, pilot, push)
            log_row(log, Real(Cell(due)), above(ended, zero, zero, one), y, flight, branch, push)
        keep_whole(status, run, ended)
        keep_of_run(saturation, run, 0, excess)

    return rollout


def derivative_kernel(numbers: Numbers, tree: Tree, dynamics: Dynamics) -> Any:
    """Return the kernel `derivative` of a model: rates of states for one row of inputs."""
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    stepping, begins = stepping_code(numbers, tree), arguments(numbers.precision)
    code, Cell, Real, Push = number_code(numbers), types.Cell, types.Real, types.Push
    Vehicles, Drive, Start = structs.Vehicles, begins.Drive, begins.Start
    flight_of, freeze, branch_at = structs.flight_of, structs.freeze, stepping.branch_at
    load_state, rate_of, end_of = types.load_state, dynamics.rate_of, stepping.end_of
    layout, lanes, above, keep_of_run = types.layout, code.lanes, code.above, code.keep_of_run
    width, bends, B, DB = layout.state, layout.bends, layout.bend.start, layout.bend_rate.start
    zero, nan = Real(0.0), Real(np.nan)

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def derivative(vehicles: Vehicles, start: Start, drive: Drive, rates: wp.array2d(dtype=Cell)):
        run = wp.tid() * lanes
        flight = flight_of(vehicles, drive, run)
        unit = flight.plant.unit
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, load_state(start.frozen, run, 0, unit))
        y = load_state(start.states, run, 0, unit)
        dy = rate_of(y, branch_at(start.angle, run).direction, flight, 0, Push())
        for j in range(bends):
            dy[B + j] = dy[B + j] / unit[j]
            dy[DB + j] = dy[DB + j] / unit[j]
        ended = end_of(y)
        for j in range(width):
            keep_of_run(rates, run, j, above(ended, zero, nan, dy[j]))

    return derivative
