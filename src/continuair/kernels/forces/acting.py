"""Device code of all that acts on a vehicle: the sum of the forces, from the files beside this."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.forces.air import air_code
from continuair.kernels.forces.arm_air import arm_air_code
from continuair.kernels.forces.inputs import input_code
from continuair.kernels.forces.load import load_code
from continuair.kernels.forces.rotors import rotor_code
from continuair.kernels.numbers import Numbers
from continuair.kernels.types import Tree, device_types, holding
from continuair.vehicle.layout import PAPER, TIP


@dataclass(frozen=True)
class ActingCode:
    """Load, a struct, and what acts: otherwise than at the tips, and in all; and load_on_tip and
    misdirected, of forces/inputs.py, and drag_on_arm, of forces/arm_air.py, None without drag."""

    Load: Any
    load_on_uav: Any
    load_of: Any
    load_on_tip: Any
    misdirected: Any
    drag_on_arm: Any


@cache
def acting_code(numbers: Numbers, tree: Tree, frozen_arm: bool) -> ActingCode:
    """The sums; frozen_arm: the tip pushes the base where it was at the start."""
    types, loads = device_types(numbers, tree), load_code(numbers, tree)
    State, Push, Along = types.State, types.Push, types.Along
    Flight, Load, plus = flight_code(numbers, tree).Flight, loads.Load, loads.plus
    inputs = input_code(numbers, tree, frozen_arm)
    push_load, paper_load, tip_load = inputs.push_load, inputs.paper_load, inputs.tip_load
    load_on_tip, misdirected = inputs.load_on_tip, inputs.misdirected

    @wp.func
    def load_on_uav(y: State, along: Along, flight: Flight, row: int, command: Push):
        """What acts otherwise than at the tips."""
        out = Load()
        if flight.groups != 0:
            out = push_load(y, flight, row, command)
        if (flight.groups & PAPER) != 0:
            out = plus(out, paper_load(y, along, flight, row))
        return out

    if tree.rotors:
        directly, rotor_load = load_on_uav, rotor_code(numbers, tree).rotor_load
        push_of, bend_moment_of, vec3 = types.push_of, types.bend_moment_of, types.vec3

        @wp.func
        def load_with_rotors(y: State, along: Along, flight: Flight, row: int, command: Push):
            """Force and moment of a push are what rotors make of them."""
            bending = push_of(vec3(), vec3(), bend_moment_of(command))
            out = directly(y, along, flight, row, bending)
            return plus(out, rotor_load(y, flight, row, command))

        load_on_uav = load_with_rotors

    if tree.drag:
        without_drag, drag_load = load_on_uav, air_code(numbers, tree).drag_load

        @wp.func
        def load_with_drag(y: State, along: Along, flight: Flight, row: int, command: Push):
            out = without_drag(y, along, flight, row, command)
            return plus(out, drag_load(y, flight, row))

        load_on_uav = load_with_drag

    drag_on_arm = None
    if tree.arm_drag:
        air = arm_air_code(numbers, tree, frozen_arm)
        without_arms, arms_load, drag_on_arm = load_on_uav, air.arms_load, air.drag_on_arm

        @wp.func
        def load_with_arms(y: State, along: Along, flight: Flight, row: int, command: Push):
            out = without_arms(y, along, flight, row, command)
            return plus(out, arms_load(y, flight, row, command))

        load_on_uav = load_with_arms

    @wp.func
    def load_of(y: State, along: Along, flight: Flight, row: int, command: Push):
        """All that acts."""
        out = load_on_uav(y, along, flight, row, command)
        if (flight.groups & TIP) != 0:
            out = plus(out, tip_load(y, flight, row))
        return out

    return holding(ActingCode, locals())
