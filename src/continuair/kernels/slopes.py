"""Kernels of derivatives of step ends, and of tips, in dual numbers.

Directions are, in this order: the columns of inputs, constant during a step; the state at the start
of a step, or of a tip; for the model "independent" the initial state; and the fields of the
vehicle, through derivatives of plants and polynomials. States are those of a log, with bends in 1/m
and all four numbers of the attitude.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from continuair.device.arguments import arguments
from continuair.device.duals import seeding
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.arm.tip import tip_code
from continuair.kernels.dynamics import Dynamics
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.pilot import no_pilot
from continuair.kernels.step import step_code, stepping_code
from continuair.vehicle.layout import Layout, columns


@dataclass(frozen=True)
class Directions:
    """Indices of directions for a layout and model; those of fields follow."""

    layout: Layout
    freezes: bool

    @property
    def state(self) -> slice:
        """Return the directions of the state at the start of a step."""
        return slice(self.layout.inputs, self.layout.inputs + self.layout.state)

    @property
    def start(self) -> slice:
        """Return the directions of the initial state, if the model uses it."""
        first = self.state.stop
        return slice(first, first + self.layout.state * self.freezes)


def tip_columns(arms: int) -> dict[str, slice]:
    """Return the columns of tip quantities, named as in a trajectory, arm by arm."""
    return columns(
        [
            ("tip_position", 3 * arms),
            ("tip_velocity", 3 * arms),
            ("tip_angular_velocity", 3 * arms),
            ("tip_attitude", 4 * arms),
        ]
    )


def _seeded_state(numbers: Numbers, tree: Tree) -> Any:
    """Return the function that reads a logged state, with directions from `direction` on."""
    types, seeded = device_types(numbers, tree), seeding()
    Cell, State, Bends = types.Cell, types.State, types.Bends
    of_sample, layout = number_code(numbers).of_sample, types.layout
    width, bends, B, DB = layout.state, layout.bends, layout.bend.start, layout.bend_rate.start

    @wp.func
    def seeded_state(
        log: wp.array3d(dtype=Cell), sample: int, direction: int, run: int, unit: Bends
    ):
        y = State()
        for j in range(width):
            y[j] = seeded(of_sample(log, run, sample, j), direction + j, run)
        for j in range(bends):
            y[B + j] = y[B + j] * unit[j]
            y[DB + j] = y[DB + j] * unit[j]
        return y

    return seeded_state


def step_slopes_kernel(numbers: Numbers, tree: Tree, dynamics: Dynamics) -> Any:
    """Return the kernel `step_slopes`: derivatives (directions, steps, state) of steps' ends.

    log: states (1, steps + 1, columns) at the starts of all steps; first: index of the first step.
    """
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    code, begins, pilot = number_code(numbers), arguments("float64"), no_pilot(numbers, tree)
    Cell, Real, Along, Push = types.Cell, types.Real, types.Along, types.Push
    Vehicles, Drive, Steps, Pilot = structs.Vehicles, begins.Drive, begins.Steps, pilot.Pilot
    flight_of, freeze, keep, lanes = structs.flight_of, structs.freeze, code.keep, code.lanes
    seeded_state = _seeded_state(numbers, tree)
    step, added = step_code(numbers, tree, dynamics, pilot), stepping_code(numbers, tree).added
    layout, where = types.layout, Directions(types.layout, dynamics.freezes)
    state, start = where.state.start, where.start.start
    width, bends, B, DB = layout.state, layout.bends, layout.bend.start, layout.bend_rate.start

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def step_slopes(
        vehicles: Vehicles,
        drive: Drive,
        steps: Steps,
        log: wp.array3d(dtype=Cell),
        first: int,
        slopes: wp.array3d(dtype=Cell),
    ):
        block, at = wp.tid()
        run = block * lanes
        i = first + at
        flight = flight_of(vehicles, drive, run)
        unit = flight.plant.unit
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, seeded_state(log, 0, start, run, unit))
        y = seeded_state(log, i, state, run, unit)
        time = Real(steps.starts[i])
        h = Real(steps.lengths[i])
        change = step(i, time, h, y, Along(), flight, Pilot(), Push())
        end = added(y, change)
        for j in range(bends):
            end[B + j] = end[B + j] / unit[j]
            end[DB + j] = end[DB + j] / unit[j]
        for j in range(width):
            keep(slopes, run, at, j, end[j])

    return step_slopes


def tip_slopes_kernel(numbers: Numbers, tree: Tree) -> Any:
    """Return the kernel `tip_slopes`: derivatives (directions, samples, tip_columns) of tips.

    log: states (1, samples, columns).
    """
    types, code, tips = device_types(numbers, tree), number_code(numbers), tip_code(numbers, tree)
    Cell, State, Plant = types.Cell, types.State, types.Plant
    Plants, plant_of = code.rows_of(types.Plant), code.reader_of(types.Plant)
    keep, lanes, arms = code.keep, code.lanes, len(tree.sections)
    at, state = tip_columns(arms), Directions(types.layout, False).state.start
    seeded_state = _seeded_state(numbers, tree)

    @wp.func
    def nothing(slopes: wp.array3d(dtype=Cell), run: int, sample: int, y: State, plant: Plant):
        pass

    def plus_arm(before: Any, arm: int) -> Any:
        world_tip = tips.world_tip_of(arm)
        position, velocity, turning = (
            at[name].start + 3 * arm
            for name in ("tip_position", "tip_velocity", "tip_angular_velocity")
        )
        attitude = at["tip_attitude"].start + 4 * arm

        @wp.func
        def keep_arm(slopes: wp.array3d(dtype=Cell), run: int, sample: int, y: State, plant: Plant):
            before(slopes, run, sample, y, plant)
            tip = world_tip(y, plant)
            for j in range(3):
                keep(slopes, run, sample, position + j, tip.position[j])
                keep(slopes, run, sample, velocity + j, tip.velocity[j])
                keep(slopes, run, sample, turning + j, tip.turning[j])
            for j in range(4):
                keep(slopes, run, sample, attitude + j, tip.attitude[j])

        return keep_arm

    keep_tips = nothing
    for arm in range(arms):
        keep_tips = plus_arm(keep_tips, arm)

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def tip_slopes(plants: Plants, log: wp.array3d(dtype=Cell), slopes: wp.array3d(dtype=Cell)):
        block, sample = wp.tid()
        run = block * lanes
        plant = plant_of(plants, run)
        keep_tips(slopes, run, sample, seeded_state(log, sample, state, run, plant.unit), plant)

    return tip_slopes
