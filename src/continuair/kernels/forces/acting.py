"""Device code of all that acts on a vehicle: the sum of the forces, from the files beside this."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.forces.inputs import input_code
from continuair.kernels.forces.load import load_code
from continuair.kernels.types import device_types, holding
from continuair.vehicle.layout import PAPER, TIP


@dataclass(frozen=True)
class ActingCode:
    """Load, a struct, and what acts: otherwise than at the tip, and in all; and misdirected, of
    forces/inputs.py."""

    Load: Any
    load_on_uav: Any
    load_of: Any
    misdirected: Any


@cache
def acting_code(precision: str, sections: int, frozen_arm: bool) -> ActingCode:
    """The sums; frozen_arm: the tip pushes the base where it was at the start."""
    types, loads = device_types(precision, sections), load_code(precision, sections)
    State, Push, vec2 = types.State, types.Push, types.vec2
    Flight, Load, plus = flight_code(precision, sections).Flight, loads.Load, loads.plus
    inputs = input_code(precision, sections, frozen_arm)
    push_load, paper_load, tip_load = inputs.push_load, inputs.paper_load, inputs.tip_load
    misdirected = inputs.misdirected

    @wp.func
    def load_on_uav(y: State, branch: vec2, flight: Flight, row: int, command: Push):
        """What acts otherwise than at the tip."""
        out = Load()
        if flight.groups != 0:
            out = push_load(y, flight, row, command)
        if (flight.groups & PAPER) != 0:
            out = plus(out, paper_load(y, branch, flight, row))
        return out

    @wp.func
    def load_of(y: State, branch: vec2, flight: Flight, row: int, command: Push):
        """All that acts."""
        out = load_on_uav(y, branch, flight, row, command)
        if (flight.groups & TIP) != 0:
            out = plus(out, tip_load(y, flight, row))
        return out

    return holding(ActingCode, locals())
