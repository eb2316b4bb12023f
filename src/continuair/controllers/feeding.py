"""Feedforward of the arms in a flight controller: none, their weight, or their reaction.

The base's acceleration acts on an arm as gravity does. Under a thrust f along the body's z axis the
apparent gravity is f/m in a vehicle of mass m; in hover it is gravity. About B, with H, F, L, M of
all arms (kernels/dynamics.py) and the apparent gravity a', the arms need H×a' on the body and Fᵀ a'
on their bends. Their own motion needs F b̈ and L b̈ with the terms quadratic in the rates. b̈ is
estimated from measured bend rates, as moments held between samples do not determine it.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.chain import chain_code, total_types
from continuair.kernels.flight import flight_code

FEEDFORWARD = ("none", "weight", "reaction")
"""Choices of feedforward; each includes those before it."""


@dataclass(frozen=True)
class FeedingCode:
    """fed(y, arms, flight, inertia, felt, bend, limit, ddb) -> Fed, for each of FEEDFORWARD.

    arms: their sum, on a base at rest; inertia: of the vehicle about its centre of mass; felt: a'
    in body axes; bend: the bend servo's moment [N m²]; limit: its largest value; ddb: bend
    accelerations [1/(m s²)].
    """

    Fed: Any
    none: Any
    weight: Any
    reaction: Any


@cache
def feeding_code(numbers: Numbers, tree: Tree) -> FeedingCode:
    """Return the functions for one kind of numbers and tree of arms."""
    types, Flight = device_types(numbers, tree), flight_code(numbers, tree).Flight
    Real, State, Plant, Bends = types.Real, types.State, types.Plant, types.Bends
    vec3, mat33, spin_of = types.vec3, types.mat33, types.spin_of
    Total = total_types(numbers, tree).Total
    moving = chain_code(numbers, tree, "full").total_of
    bends = types.layout.bends

    @wp.struct
    class Fed:
        """Force and moment on the UAV in body axes; total bend moments."""

        force: vec3
        moment: vec3
        bend: Bends

    @wp.func
    def within(bend: Bends, limit: Bends):
        for j in range(bends):
            bend[j] = wp.max(-limit[j], wp.min(limit[j], bend[j]))
        return bend

    @wp.func
    def apparent_weight(total: Total, felt: vec3):
        """Fᵀ a'."""
        out = Bends()
        for j in range(bends):
            out[j] = total.F[0, j] * felt[0] + total.F[1, j] * felt[1] + total.F[2, j] * felt[2]
        return out

    @wp.func
    def carried(total: Total, plant: Plant, felt: vec3, bend: Bends, limit: Bends):
        """Bend moments with the arms' weight, within the limits [N m²]."""
        pull = apparent_weight(total, felt)
        for j in range(bends):
            bend[j] = bend[j] + plant.unit[j] * pull[j]
        return within(bend, limit)

    @wp.func
    def none(
        y: State, arms: Total, flight: Flight, inertia: mat33, felt: vec3, bend: Bends,
        limit: Bends, ddb: Bends,
    ):  # fmt: skip
        out, w = Fed(), spin_of(y)
        out.moment = wp.cross(w, inertia * w)
        out.bend = within(bend, limit)
        return out

    @wp.func
    def weight(
        y: State, arms: Total, flight: Flight, inertia: mat33, felt: vec3, bend: Bends,
        limit: Bends, ddb: Bends,
    ):  # fmt: skip
        out, w = Fed(), spin_of(y)
        out.moment = wp.cross(w, inertia * w) + wp.cross(arms.H, felt)
        out.bend = carried(arms, flight.plant, felt, bend, limit)
        return out

    @wp.func
    def reaction(
        y: State, arms: Total, flight: Flight, inertia: mat33, felt: vec3, bend: Bends,
        limit: Bends, ddb: Bends,
    ):  # fmt: skip
        out, w, plant = Fed(), spin_of(y), flight.plant
        total = moving(y, flight.coefficients, plant, flight.vehicle)
        out.bend = carried(total, plant, felt, bend, limit)
        out.force = total.force
        turning = total.moment + wp.cross(w, plant.uav_inertia * w)
        for j in range(bends):
            faster = plant.unit[j] * ddb[j]
            out.force = out.force + faster * vec3(total.F[0, j], total.F[1, j], total.F[2, j])
            turning = turning + faster * vec3(total.L[0, j], total.L[1, j], total.L[2, j])
        out.moment = turning + wp.cross(total.H, felt - out.force / plant.mass)
        return out

    return holding(FeedingCode, locals())
