"""Kernel of the potential energy of terms along a log."""

from typing import Any

import warp as wp

from continuair.device.arguments import arguments
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types
from continuair.errors import InputError
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code


def energies_kernel(numbers: Numbers, tree: Tree) -> Any:
    """Return the kernel `energies`, the same for every model: the column term_energy."""
    types, structs, code = (
        device_types(numbers, tree),
        flight_code(numbers, tree),
        number_code(numbers),
    )
    Cell, Real, State, Flight = types.Cell, types.Real, types.State, structs.Flight
    Vehicles, Drive = structs.Vehicles, arguments(numbers.precision).Drive
    flight_of, load_state, keep, lanes = (
        structs.flight_of,
        types.load_state,
        code.keep,
        code.lanes,
    )
    column = types.layout.observed["term_energy"].start

    @wp.func
    def energy_of(y: State, flight: Flight, row: int):
        return Real(0.0)

    def plus(first: Any, second: Any) -> Any:
        @wp.func
        def both(y: State, flight: Flight, row: int):
            return first(y, flight, row) + second(y, flight, row)

        return both

    for term in tree.terms:
        if term.has_energy:
            own = term.device(Device(numbers, tree)).energy
            if own is None:
                raise InputError(
                    f"term {type(term).__name__}",
                    "has has_energy, but its device(code) returns no energy",
                    "give Acting(energy=...), or leave has_energy out",
                )
            energy_of = plus(energy_of, own)

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def energies(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        pack, sample = wp.tid()
        run = pack * lanes
        flight = flight_of(vehicles, drive, run)
        y = load_state(log, run, sample, flight.plant.unit)
        row = sample * flight.stride
        keep(out, run, sample, column, energy_of(y, flight, row))

    return energies
