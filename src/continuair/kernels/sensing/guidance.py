"""Device code of setpoints, and of measurement noise."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.vehicle.layout import setpoint_columns

POSITION_NOISE, VELOCITY_NOISE, ATTITUDE_NOISE, GYRO_NOISE = range(4)
"""Indices of the four standard deviations of a law's noise."""


@dataclass(frozen=True)
class GuidanceCode:
    """SetPoint, a struct; set_point_of(table, row, run) reads one; disturbed adds noise to a state.

    Noise: vector of the standard deviations of position [m], velocity [m/s], attitude [rad] and
    angular velocity [rad/s], per axis.
    """

    SetPoint: Any
    Noise: Any
    set_point_of: Any
    disturbed: Any


@cache
def guidance_code(numbers: Numbers, tree: Tree) -> GuidanceCode:
    """Return the struct and functions for one kind of numbers and tree of arms."""
    types, code = device_types(numbers, tree), number_code(numbers)
    Real, State, Cell, Bends = types.Real, types.State, types.Cell, types.Bends
    vec3, quat, three_of = types.vec3, types.quat, types.three_of
    position_of, attitude_of, velocity_of = types.position_of, types.attitude_of, types.velocity_of
    spin_of, bends_of, bend_rates_of = types.spin_of, types.bends_of, types.bend_rates_of
    state_of, of_row, randn, any_above = types.state_of, code.of_row, code.randn, code.any_above
    Noise, bends = wp.types.vector(4, Real), types.layout.bends
    at = {name: where.start for name, where in setpoint_columns(bends).items()}
    place, follows, speed = at["position"], at["follows"], at["velocity"]
    heading, turning, bent = at["yaw"], at["yaw_rate"], at["bend"]
    zero, half, one = Real(0.0), Real(0.5), Real(1.0)

    @wp.struct
    class SetPoint:
        """Position and velocity of B's origin, world axes; follows: 1 if the position is
        controlled, 0 if only the velocity is; yaw [rad] and its rate; bend vectors [1/m]."""

        position: vec3
        follows: Real
        velocity: vec3
        yaw: Real
        yaw_rate: Real
        bend: Bends

    @wp.func
    def set_point_of(table: wp.array3d(dtype=Cell), row: int, run: int):
        out = SetPoint()
        out.position = three_of(table, row, run, place)
        out.follows = of_row(table, row, run, follows)
        out.velocity = three_of(table, row, run, speed)
        out.yaw = of_row(table, row, run, heading)
        out.yaw_rate = of_row(table, row, run, turning)
        for j in range(bends):
            out.bend[j] = of_row(table, row, run, bent + j)
        return out

    @wp.func
    def shaken(size: Real, seeds: wp.array(dtype=wp.int32), run: int, instant: int, which: int):
        # Indices count down from -1, so that they differ from those of camera frames.
        first = -1 - 12 * instant - which
        x = randn(seeds, run, first, 0)
        y = randn(seeds, run, first - 1, 0)
        return size * vec3(x, y, randn(seeds, run, first - 2, 0))

    @wp.func
    def disturbed(y: State, noise: Noise, seeds: wp.array(dtype=wp.int32), run: int, instant: int):
        """Return a state with measurement noise, which depends on seed and instant only."""
        if any_above(noise[0] + noise[1] + noise[2] + noise[3], zero):
            p = position_of(y) + shaken(noise[POSITION_NOISE], seeds, run, instant, 0)
            v = velocity_of(y) + shaken(noise[VELOCITY_NOISE], seeds, run, instant, 3)
            turn = half * shaken(noise[ATTITUDE_NOISE], seeds, run, instant, 6)
            w = spin_of(y) + shaken(noise[GYRO_NOISE], seeds, run, instant, 9)
            size = one / wp.sqrt(one + wp.dot(turn, turn))
            q = attitude_of(y) * quat(size * turn[0], size * turn[1], size * turn[2], size)
            y = state_of(p, q, bends_of(y), v, w, bend_rates_of(y))
        return y

    return holding(GuidanceCode, locals())
