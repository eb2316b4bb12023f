"""Kernels of the open loop: a whole roll-out per thread, and single derivatives."""

from types import SimpleNamespace

import warp as wp

from continuair.kernels.step import OPTIONS


def integrator(code: SimpleNamespace, log_row: wp.Function):
    """The kernel `rollout` of a model; log_row, as in kernels/step.py, writes its log."""
    Real, Row, Plant, Push = code.Real, code.Row, code.Plant, code.Push
    rate_of, freeze, load_state = code.rate_of, code.freeze, code.load_state
    branch_at, followed = code.branch_at, code.followed
    unit_attitude, end_of = code.unit_attitude, code.end_of
    half, sixth, two = Real(0.5), Real(1.0 / 6.0), Real(2.0)

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def rollout(
        plants: wp.array(dtype=Plant),
        coefficients: wp.array2d(dtype=Row),
        initial: wp.array2d(dtype=Real),
        start: wp.array2d(dtype=Real),
        angle: wp.array(dtype=Real),
        inputs: wp.array3d(dtype=Real),
        stride: int,
        groups: int,
        gravity: Real,
        steps: wp.array(dtype=Real),
        sample_after: wp.array(dtype=wp.int32),
        log: wp.array3d(dtype=Real),
        status: wp.array(dtype=wp.int32),
        last_step: wp.array(dtype=wp.int32),
    ):
        run = wp.tid()
        vehicle = wp.min(run, plants.shape[0] - 1)
        column = wp.min(run, inputs.shape[1] - 1)
        plant = plants[vehicle]
        y = load_state(start, run, plant.unit)
        frozen = freeze(load_state(initial, run, plant.unit), plant, coefficients, vehicle)
        branch = branch_at(angle[run])
        none = Push()
        log_row(log, run, 0, y, plant, branch, none)
        ended = wp.int32(0)
        done = steps.shape[0]
        for i in range(steps.shape[0]):
            h = steps[i]
            row = i * stride
            mid = row + wp.min(stride, 1)
            end = row + wp.min(stride, 2)
            along = branch.direction
            k1 = rate_of(
                y, along, plant, frozen, coefficients, vehicle, inputs, row, column, groups, none,
                gravity,
            )  # fmt: skip
            k2 = rate_of(
                y + half * h * k1, along, plant, frozen, coefficients, vehicle, inputs, mid, column,
                groups, none, gravity,
            )  # fmt: skip
            k3 = rate_of(
                y + half * h * k2, along, plant, frozen, coefficients, vehicle, inputs, mid, column,
                groups, none, gravity,
            )  # fmt: skip
            k4 = rate_of(
                y + h * k3, along, plant, frozen, coefficients, vehicle, inputs, end, column,
                groups, none, gravity,
            )  # fmt: skip
            y = unit_attitude(y + (h * sixth) * (k1 + two * (k2 + k3) + k4))
            ended = end_of(y)
            if ended != 0:
                done = i
                break
            branch = followed(branch, y)
            sample = sample_after[i]
            if sample >= 0:
                log_row(log, run, sample, y, plant, branch, none)
        status[run] = ended
        last_step[run] = done

    return rollout


def differentiator(code: SimpleNamespace):
    """The kernel `derivative` of a model."""
    Real, Row, Plant, Push = code.Real, code.Row, code.Plant, code.Push
    rate_of, freeze, load_state = code.rate_of, code.freeze, code.load_state
    vec2, two, width = code.vec2, Real(2.0), code.layout.state

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def derivative(
        plants: wp.array(dtype=Plant),
        coefficients: wp.array2d(dtype=Row),
        initial: wp.array2d(dtype=Real),
        states: wp.array2d(dtype=Real),
        angle: wp.array(dtype=Real),
        inputs: wp.array3d(dtype=Real),
        groups: int,
        gravity: Real,
        rates: wp.array2d(dtype=Real),
    ):
        run = wp.tid()
        vehicle = wp.min(run, plants.shape[0] - 1)
        plant = plants[vehicle]
        y = load_state(states, run, plant.unit)
        frozen = freeze(load_state(initial, run, plant.unit), plant, coefficients, vehicle)
        column = wp.min(run, inputs.shape[1] - 1)
        along = vec2(wp.cos(angle[run]), wp.sin(angle[run]))
        dy = rate_of(
            y, along, plant, frozen, coefficients, vehicle, inputs, 0, column, groups, Push(),
            gravity,
        )  # fmt: skip
        for j in range(2):
            dy[7 + j] = dy[7 + j] / plant.unit
            dy[15 + j] = dy[15 + j] / plant.unit
        for j in range(width):
            rates[run, j] = dy[j]
        if y[7] * y[7] + y[8] * y[8] > two:
            for j in range(width):
                rates[run, j] = Real(wp.nan)

    return derivative
