"""The kernel that looks back along a log at the rotors: what they give, and what is too much."""

from typing import Any

import warp as wp

from continuair.kernels.arguments import arguments
from continuair.kernels.flight import flight_code
from continuair.kernels.forces.rotors import rotor_code
from continuair.kernels.logs import push_reader
from continuair.kernels.numbers import Numbers, number_code
from continuair.kernels.types import Tree, device_types
from continuair.vehicle.layout import observed_columns


def thrusts_kernel(numbers: Numbers, tree: Tree) -> Any:
    """The kernel `thrusts`, the same for every model: columns rotor_thrust and saturation."""
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    code, of = number_code(numbers), rotor_code(numbers, tree)
    Cell, layout = types.Cell, types.layout
    Vehicles, Drive = structs.Vehicles, arguments(numbers.precision).Drive
    flight_of, load_state = structs.flight_of, types.load_state
    thrusts_of, excess_of = of.thrusts_of, of.excess_of
    keep, lanes, logged_push = code.keep, code.lanes, push_reader(numbers, tree)
    columns = observed_columns(layout.arms, layout.rotors)
    first, excess_at = columns["rotor_thrust"].start, columns["saturation"].start
    rotors = layout.rotors

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def thrusts(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        """drive: inputs at the samples, with one row per sample or one for all."""
        pack, sample = wp.tid()
        run = pack * lanes
        flight = flight_of(vehicles, drive, run)
        y = load_state(log, run, sample, flight.plant.unit)
        row = sample * flight.stride
        push = logged_push(log, run, sample)
        given = thrusts_of(y, flight, row, push)
        for i in range(rotors):
            keep(out, run, sample, first + i, given[i])
        keep(out, run, sample, excess_at, excess_of(y, flight, row, push))

    return thrusts
