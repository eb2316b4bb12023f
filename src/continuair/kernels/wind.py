"""Device code of the wind."""

from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types
from continuair.kernels.flight import flight_code
from continuair.vehicle.layout import AIR


@cache
def wind_code(numbers: Numbers, tree: Tree) -> Any:
    """Return the function wind_at(flight, row), the wind in world axes [m/s]."""
    types, Flight = device_types(numbers, tree), flight_code(numbers, tree).Flight
    vec3, three_of = types.vec3, types.three_of
    wind = types.layout.of_input["wind"].start

    @wp.func
    def wind_at(flight: Flight, row: int):
        out = vec3()
        if (flight.groups & AIR) != 0:
            out = three_of(flight.inputs, row, flight.run, wind)
        return out

    return wind_at
