"""Device code of one time step, and of the signed branch of the bend."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.dynamics import Dynamics
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.pilot import PilotCode
from continuair.sections.arc.bend import bend_code

OK, NOT_FINITE, OVERBENT, UNSEEN, OVERTURNED, STEP_LIMIT = 0, 1, 2, 3, 4, 5
STATUS = {
    OK: "ok",
    NOT_FINITE: "not finite",
    OVERBENT: "bent beyond a full circle",
    UNSEEN: "all feature points lost from view",
    OVERTURNED: "turned over under its flight controller",
    STEP_LIMIT: "step limit reached",
}


@dataclass(frozen=True)
class Stepping:
    """Branch, a struct, and how it and a state go on; end_of gives the status of a state.

    signed_of(branch, y, unit) holds, for the coordinates of each section, κ [1/m] and ψa on its
    branch, or for a kind that has none of these the coordinates themselves. added(y, change) is a
    state after a change, of unit attitude; compensated(y, rest, change) is that and what rounding
    has added to it, which the next change takes back; rest: from the change before.
    """

    Branch: Any
    branch_at: Any
    signed_of: Any
    followed: Any
    chosen: Any
    added: Any
    compensated: Any
    end_of: Any


@cache
def stepping_code(numbers: Numbers, tree: Tree) -> Stepping:
    """What follows each step."""
    types, code, known = device_types(numbers, tree), number_code(numbers), elementary_code(numbers)
    Cell, Real, State, Bends = types.Cell, types.Real, types.State, types.Bends
    vec2, Along, tilt_of = types.vec2, types.Along, types.tilt_of
    above, finite, of_run = code.above, code.finite, code.of_run
    sine, cosine, angle_of = known.sine, known.cosine, known.angle_of
    PerSection, two_of, with_two = types.PerSection, types.two_of, types.with_two
    attitude_of, sections, bends = types.attitude_of, types.layout.sections, types.layout.bends
    arcs = bend_code(numbers, tree)
    count, section_of, bend_of = arcs.count, arcs.section_of, arcs.bend_of
    bends_of, with_polar = types.bends_of, arcs.with_polar
    Q = types.layout.attitude.start
    zero, half, one = Real(0.0), Real(0.5), Real(1.0)
    whole_turn = Real(2.0 * np.pi)
    ok, not_finite, overbent = (Real(float(status)) for status in (OK, NOT_FINITE, OVERBENT))

    @wp.struct
    class Branch:
        """(cos ψa, sin ψa) of each section on the signed branch followed, and its full turns; and
        (cos φ, sin φ) of the roll on the triple of Euler angles followed."""

        direction: Along
        turns: PerSection

    @wp.func
    def branch_at(angles: wp.array2d(dtype=Cell), run: int):
        out = Branch()
        for i in range(sections):
            angle = of_run(angles, run, i)
            x = cosine(angle)
            y = sine(angle)
            out.direction = with_two(out.direction, i, vec2(x, y))
            out.turns[i] = wp.floor((angle - angle_of(y, x)) / whole_turn + half)
        roll = of_run(angles, run, sections)
        out.direction = with_two(out.direction, sections, vec2(cosine(roll), sine(roll)))
        return out

    @wp.func
    def signed_of(branch: Branch, y: State, unit: Bends):
        """κ and ψa of each section, ψa continuous."""
        out = bends_of(y)
        for j in range(bends):
            out[j] = out[j] / unit[j]
        for k in range(count):
            i = section_of(k)
            along = two_of(branch.direction, i)
            angle = angle_of(along[1], along[0]) + whole_turn * branch.turns[i]
            out = with_polar(out, i, wp.dot(bend_of(y, i), along), angle, unit)
        return out

    @wp.func
    def along_or_against(found: vec2, before: vec2):
        """The direction of a vector or the opposite, whichever is nearer the one before."""
        u = wp.dot(found, found)
        side = above(zero, wp.dot(found, before), -one, one) / wp.sqrt(above(u, zero, u, one))
        x = above(u, zero, found[0] * side, before[0])
        y = above(u, zero, found[1] * side, before[1])
        return vec2(x, y)

    @wp.func
    def followed(branch: Branch, y: State):
        """κ changes sign when a bend passes through straight, and cos θ at a quarter turn of pitch;
        ψa and roll stay continuous."""
        for k in range(count):
            i = section_of(k)
            before = two_of(branch.direction, i)
            turned = along_or_against(bend_of(y, i), before)
            # Between the half-planes y < 0 and y >= 0, on the side of negative x, is a turn's end.
            turn = above(zero, turned[1], one, zero) - above(zero, before[1], one, zero)
            crossed = above(zero, before[0] + turned[0], turn, zero)
            branch.turns[i] = branch.turns[i] + crossed
            branch.direction = with_two(branch.direction, i, turned)
        roll = along_or_against(tilt_of(y), two_of(branch.direction, sections))
        branch.direction = with_two(branch.direction, sections, roll)
        return branch

    @wp.func
    def chosen(which: Real, x: Branch, y: Branch):
        """x where which > 0, else y."""
        out = y
        for i in range(sections + 1):
            one_of, other = two_of(x.direction, i), two_of(y.direction, i)
            both = vec2(
                above(which, zero, one_of[0], other[0]), above(which, zero, one_of[1], other[1])
            )
            out.direction = with_two(out.direction, i, both)
        for i in range(sections):
            out.turns[i] = above(which, zero, x.turns[i], y.turns[i])
        return out

    @wp.func
    def added(y: State, change: State):
        out = y + change
        q = attitude_of(out)
        n = one / wp.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        for j in range(4):
            out[Q + j] = out[Q + j] * n
        return out

    @wp.func
    def compensated(y: State, rest: State, change: State):
        """Kahan's sum: places far from the origin change by less in a step than their last digit,
        and so do velocities and attitudes."""
        whole = change - rest
        out = y + whole
        left = (out - y) - whole
        q = attitude_of(out)
        long = half * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - one)
        for j in range(4):
            left[Q + j] = left[Q + j] + long * q[j]
        return out, left

    @wp.func
    def well(y: State):
        return ok

    def and_section(before: Any, section: int) -> Any:
        bent = tree.kind_of(section).device(numbers, tree, section).bent

        @wp.func
        def found(y: State):
            return above(bent(y), one, overbent, before(y))

        return found

    within = well
    for section in range(sections):
        within = and_section(within, section)

    @wp.func
    def end_of(y: State):
        """The status that a state ends a run with, 0 if none."""
        return finite(wp.length_sq(y), within(y), not_finite)

    return holding(Stepping, locals())


def step_code(numbers: Numbers, tree: Tree, dynamics: Dynamics, pilot: PilotCode) -> Any:
    """The function `step`: what one step of RK4 of a model under a pilot adds to the state."""
    types = device_types(numbers, tree)
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Flight, Pilot, push_at = flight_code(numbers, tree).Flight, pilot.Pilot, pilot.push_at
    rate_of, half, sixth = dynamics.rate_of, Real(0.5), Real(1.0 / 6.0)

    @wp.func
    def step(
        i: int, time: Real, h: Real, y: State, along: Along, flight: Flight, pilot: Pilot,
        held: Push,
    ):  # fmt: skip
        """The change of the state in step i, which starts at a time and lasts h."""
        k = State()
        total = State()
        # A loop for the compiler, too: the rate's code stands there once.
        for stage in range(4 + wp.min(flight.stride, 0)):
            # At the start of the step, twice in its middle and at its end.
            ahead = (stage + 1) // 2
            reach = half * h * Real(ahead)
            at = y + reach * k
            push = push_at(3 * i + ahead, time + reach, at, along, flight, pilot, held)
            row = i * flight.stride + wp.min(flight.stride, ahead)
            k = rate_of(at, along, flight, row, push)
            total += Real(1 + ahead % 2) * k
        return (h * sixth) * total

    return step
