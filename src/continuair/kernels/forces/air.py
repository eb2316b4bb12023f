"""Device code of the air: the wind, and the drag of the UAV in it."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.forces.load import load_code
from continuair.kernels.numbers import Numbers
from continuair.kernels.types import Tree, device_types, holding
from continuair.vehicle.layout import AIR


@dataclass(frozen=True)
class AirCode:
    """wind_at(flight, row), world axes; drag_load(y, flight, row) of the UAV."""

    wind_at: Any
    drag_load: Any


@cache
def air_code(numbers: Numbers, tree: Tree) -> AirCode:
    """Air for one kind of numbers and tree of arms."""
    types, Load = device_types(numbers, tree), load_code(numbers, tree).Load
    Flight, State, vec3 = flight_code(numbers, tree).Flight, types.State, types.vec3
    attitude_of, velocity_of, three_of = types.attitude_of, types.velocity_of, types.three_of
    wind = types.layout.of_input["wind"].start

    @wp.func
    def wind_at(flight: Flight, row: int):
        out = vec3()
        if (flight.groups & AIR) != 0:
            out = three_of(flight.inputs, row, flight.run, wind)
        return out

    @wp.func
    def drag_load(y: State, flight: Flight, row: int):
        """-D v - |v| D₂ v, of the velocity v through the air in body axes."""
        v = wp.quat_rotate_inv(attitude_of(y), velocity_of(y) - wind_at(flight, row))
        speed = wp.length(v)
        linear = flight.plant.drag
        square = flight.plant.square_drag
        force = vec3()
        for j in range(3):
            force[j] = -(linear[j] + speed * square[j]) * v[j]
        out = Load()
        out.force = force
        return out

    return holding(AirCode, locals())
