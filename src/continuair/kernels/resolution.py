"""Device code of what a step leaves out: sizes of differences, and the error of a step of RK4."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import warp as wp

from continuair.kernels.numbers import Numbers, number_code
from continuair.kernels.types import FULL_LENGTH, Tree, device_types, holding
from continuair.sections.arc.bend import bend_code

STEP_PHASE = 0.2
"""Largest product of an automatic step and the fastest rate: RK4 then keeps the amplitude of the
stiffest mode, and follows the fastest decay."""


@dataclass(frozen=True)
class Resolution:
    """Sizes of differences: moved, pushed and carried; squared_size(difference of rates, plant, h)
    of a step of RK4, whose error is unresolved(first, second, h)."""

    moved: Any
    pushed: Any
    carried: Any
    squared_size: Any
    unresolved: Any


@cache
def resolution_code(numbers: Numbers, tree: Tree) -> Resolution:
    """What a step of RK4 leaves out, from its stages.

    On y' = λ y, z = λ h, the stages are k₁ times 1, 1 + z/2, 1 + z/2 + z²/4 and so on, and a step
    errs by y z⁵/120. So |z| is twice |k₃ - k₂| / |k₂ - k₁|, and the error h |k₃ - k₂| z²/30.
    """
    types, code = device_types(numbers, tree), number_code(numbers)
    Real, State, Plant = types.Real, types.State, types.Plant
    position_of, velocity_of, spin_of = types.position_of, types.velocity_of, types.spin_of
    attitude_of, bends_of, bend_rates_of = types.attitude_of, types.bends_of, types.bend_rates_of
    vec3, Bends, arcs = types.vec3, types.Bends, bend_code(numbers, tree)
    bend_rate_of, pair_of = arcs.bend_rate_of, arcs.pair_of
    zero, one, four, thirty = Real(0.0), Real(1.0), Real(4.0), Real(30.0)
    sections, turn, phase = types.layout.sections, Real(FULL_LENGTH), Real(STEP_PHASE)
    above, finite, vec2 = code.above, code.finite, types.vec2

    @wp.func
    def of_tip(place: vec3, turned: Real, bends: Bends, plant: Plant):
        """How far a difference moves the tip, squared, in arm lengths: of place, by a squared angle
        and of bends, which move it by their angles times their sections' reach."""
        out = wp.length_sq(place) / (plant.length * plant.length) + turned
        for i in range(sections):
            bending = turn * plant.reach[i]
            out += bending * bending * wp.length_sq(pair_of(bends, i))
        return out

    @wp.func
    def moved(d: State, plant: Plant):
        """Of a difference of places; a quaternion changes by half of what it turns by."""
        q = attitude_of(d)
        return of_tip(position_of(d), four * wp.dot(q, q), bends_of(d), plant)

    @wp.func
    def pushed(d: State, plant: Plant):
        """Of a difference of velocities, per second, squared."""
        return of_tip(velocity_of(d), wp.length_sq(spin_of(d)), bend_rates_of(d), plant)

    @wp.func
    def of_base(d: State, plant: Plant):
        length = wp.length_sq(velocity_of(d)) / (plant.length * plant.length)
        return length + wp.length_sq(spin_of(d))

    def plus_arm(before: Any, begin: int, end: int) -> Any:
        @wp.func
        def carried(d: State, plant: Plant):
            """As `pushed`, but sections of one arm may take back what others do to its tip."""
            tip = vec2()
            for i in range(begin, end):
                tip += turn * plant.reach[i] * bend_rate_of(d, i)
            return before(d, plant) + wp.length_sq(tip)

        return carried

    carried = of_base
    for ends in pairwise(tree.first):
        carried = plus_arm(carried, *ends)

    @wp.func
    def squared_size(d: State, plant: Plant, h: Real):
        """Of a difference of rates: how far it moves the tip, squared, in arm lengths per second.

        Accelerations act for the period in which the fastest rate that an automatic step of length
        h resolves turns them into rates.
        """
        period = h / phase
        return moved(d, plant) + period * period * pushed(d, plant)

    @wp.func
    def unresolved(first: Real, second: Real, h: Real):
        """Error of a step of length h [s], as a distance of the tip in arm lengths.

        first and second: the squared sizes of k₂ - k₁ and of k₃ - k₂.
        """
        # Where stages hardly differ, their ratio says nothing: RK4 is unstable from z = 2.8 on.
        square = wp.min(four * second / above(first, zero, first, one), four)
        error = h * wp.sqrt(second) * square / thirty
        return finite(first, above(first, zero, error, zero), first)

    return holding(Resolution, locals())
