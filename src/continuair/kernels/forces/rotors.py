"""Device code of rotors: thrusts of their speeds, and the commands that a push is shared out to."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.forces.load import load_code
from continuair.kernels.numbers import Numbers, number_code
from continuair.kernels.types import Tree, device_types, holding
from continuair.vehicle.layout import COMMAND, ROTORS


@dataclass(frozen=True)
class RotorCode:
    """rotor_load(y, flight, row, push) of their thrusts; spun_up(rate, y, flight, row, push), the
    rate of a state with those of their speeds; thrusts_of, what they give, and excess_of, the
    largest part of the limits' range that is asked for beyond them."""

    rotor_load: Any
    spun_up: Any
    thrusts_of: Any
    excess_of: Any


@cache
def rotor_code(numbers: Numbers, tree: Tree) -> RotorCode:
    """Rotors of one kind of numbers and tree of arms."""
    types, code = device_types(numbers, tree), number_code(numbers)
    Flight, Load = flight_code(numbers, tree).Flight, load_code(numbers, tree).Load
    Real, State, Push, Plant = types.Real, types.State, types.Push, types.Plant
    PerRotor, attitude_of, vec3 = types.PerRotor, types.attitude_of, types.vec3
    force_of, moment_of = types.force_of, types.moment_of
    above, finite, of_row = code.above, code.finite, code.of_row
    rotors, prompt = tree.rotors, tree.prompt
    speeds, commands = types.layout.rotor_speed.start, types.layout.of_input["rotor_command"].start
    zero, one = Real(0.0), Real(1.0)

    @wp.func
    def asked_of(y: State, flight: Flight, row: int, push: Push):
        """Thrusts that a push and the commands of a row ask for: all but for yaw, and for yaw."""
        plant = flight.plant
        force = wp.quat_rotate_inv(attitude_of(y), force_of(push))
        moment = moment_of(push)
        out = PerRotor()
        yaw = PerRotor()
        for i in range(rotors):
            for j in range(3):
                out[i] = out[i] + plant.inverse[i, j] * force[j]
            for j in range(2):
                out[i] = out[i] + plant.inverse[i, 3 + j] * moment[j]
            yaw[i] = plant.inverse[i, 5] * moment[2]
        if (flight.groups & ROTORS) != 0:
            for i in range(rotors):
                out[i] = out[i] + of_row(flight.inputs, row, flight.run, commands + i)
        return out, yaw

    @wp.func
    def lowest_of(flight: Flight):
        """The least thrust: a controller's rotors keep turning, others may be switched off."""
        out = zero
        if (flight.groups & COMMAND) != 0:
            out = flight.plant.lowest
        return out

    @wp.func
    def commanded(y: State, flight: Flight, row: int, push: Push):
        """Thrusts within the limits: what is too much is taken from yaw first."""
        asked, yaw = asked_of(y, flight, row, push)
        lowest = lowest_of(flight)
        highest = flight.plant.highest
        share = one
        for i in range(rotors):
            room = wp.max(above(yaw[i], zero, highest - asked[i], asked[i] - lowest), zero)
            size = wp.abs(yaw[i])
            fits = room / above(size, zero, size, one)
            share = wp.min(share, above(size, zero, fits, one))
        for i in range(rotors):
            wish = asked[i] + share * yaw[i]
            # No limit makes a number of what is none.
            asked[i] = finite(wish, wp.min(wp.max(wish, lowest), highest), wish)
        return asked

    @wp.func
    def excess_of(y: State, flight: Flight, row: int, push: Push):
        asked, yaw = asked_of(y, flight, row, push)
        given = commanded(y, flight, row, push)
        out = zero
        for i in range(rotors):
            out = wp.max(out, wp.abs(asked[i] + yaw[i] - given[i]))
        return out / (flight.plant.highest - lowest_of(flight))

    @wp.func
    def turning(y: State, plant: Plant):
        """Thrusts of speeds."""
        out = PerRotor()
        for i in range(rotors):
            out[i] = plant.highest * y[speeds + i] * y[speeds + i]
        return out

    @wp.func
    def turning_or_commanded(y: State, flight: Flight, row: int, push: Push):
        out = turning(y, flight.plant)
        given = commanded(y, flight, row, push)
        for i in range(rotors):
            out[i] = above(flight.plant.lag, zero, out[i], given[i])
        return out

    @wp.func
    def turning_alone(y: State, flight: Flight, row: int, push: Push):
        return turning(y, flight.plant)

    thrusts_of = turning_or_commanded if prompt else turning_alone

    @wp.func
    def rotor_load(y: State, flight: Flight, row: int, push: Push):
        plant = flight.plant
        thrusts = thrusts_of(y, flight, row, push)
        force = vec3()
        moment = vec3()
        for i in range(rotors):
            for j in range(3):
                force[j] = force[j] + plant.allocation[j, i] * thrusts[i]
                moment[j] = moment[j] + plant.allocation[3 + j, i] * thrusts[i]
        out = Load()
        out.force = force
        out.moment = moment
        return out

    @wp.func
    def spun_up(rate: State, y: State, flight: Flight, row: int, push: Push):
        plant = flight.plant
        given = commanded(y, flight, row, push)
        for i in range(rotors):
            behind = wp.sqrt(given[i] / plant.highest) - y[speeds + i]
            change = behind / above(plant.lag, zero, plant.lag, one)
            rate[speeds + i] = above(plant.lag, zero, change, zero)
        return rate

    return holding(RotorCode, locals())
