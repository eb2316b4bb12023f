"""Device code of one time step, and of the signed branch of the bend."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.pilot import PilotCode
from continuair.kernels.types import FULL_LENGTH, Tree, device_types, holding

STEP_PHASE = 0.2
"""Largest product of an automatic step and the fastest rate: RK4 then keeps the amplitude of the
stiffest mode, and follows the fastest decay."""

OK, NOT_FINITE, OVERBENT, UNSEEN = 0, 1, 2, 3
STATUS = {
    OK: "ok",
    NOT_FINITE: "not finite",
    OVERBENT: "bent beyond a full circle",
    UNSEEN: "all feature points lost from view",
}


@dataclass(frozen=True)
class Stepping:
    """Branch, a struct, and how it and a state go on; end_of gives the status of a state.

    signed_of(branch, y) is κ and ψa of each section on its branch.
    """

    Branch: Any
    branch_at: Any
    signed_of: Any
    followed: Any
    unit_attitude: Any
    end_of: Any


@cache
def stepping_code(precision: str, tree: Tree) -> Stepping:
    """What follows each step."""
    types = device_types(precision, tree)
    Real, State, vec2, Bends = types.Real, types.State, types.vec2, types.Bends
    Along, tilt_of = types.Along, types.tilt_of
    PerSection, two_of = types.PerSection, types.two_of
    bend_of, attitude_of, sections = types.bend_of, types.attitude_of, types.layout.sections
    Q = types.layout.attitude.start
    zero, one, two, pi = Real(0.0), Real(1.0), Real(2.0), Real(3.141592653589793)
    finite, not_finite, overbent = OK, NOT_FINITE, OVERBENT

    @wp.struct
    class Branch:
        """(cos ψa, sin ψa) of each section on the signed branch followed, and its full turns; and
        (cos φ, sin φ) of the roll on the triple of Euler angles followed."""

        direction: Along
        turns: PerSection

    @wp.func
    def branch_at(angles: wp.array2d(dtype=Real), run: int):
        out = Branch()
        for i in range(sections):
            angle = angles[run, i]
            x = wp.cos(angle)
            y = wp.sin(angle)
            out.direction[2 * i] = x
            out.direction[2 * i + 1] = y
            out.turns[i] = wp.round((angle - wp.atan2(y, x)) / (two * pi))
        roll = angles[run, sections]
        out.direction[2 * sections] = wp.cos(roll)
        out.direction[2 * sections + 1] = wp.sin(roll)
        return out

    @wp.func
    def signed_of(branch: Branch, y: State):
        """κ and ψa of each section, ψa continuous."""
        out = Bends()
        for i in range(sections):
            along = two_of(branch.direction, i)
            out[2 * i] = wp.dot(bend_of(y, i), along)
            out[2 * i + 1] = wp.atan2(along[1], along[0]) + two * pi * branch.turns[i]
        return out

    @wp.func
    def followed(branch: Branch, y: State):
        """κ changes sign when a bend passes through straight, and cos θ at a quarter turn of pitch;
        ψa and roll stay continuous."""
        for i in range(sections):
            b = bend_of(y, i)
            u = wp.dot(b, b)
            before = two_of(branch.direction, i)
            if u > zero:
                side = wp.where(wp.dot(b, before) < zero, -one, one)
                turned = b * (side / wp.sqrt(u))
                if before[0] + turned[0] < zero:
                    if before[1] >= zero and turned[1] < zero:
                        branch.turns[i] = branch.turns[i] + one
                    if before[1] < zero and turned[1] >= zero:
                        branch.turns[i] = branch.turns[i] - one
                branch.direction[2 * i] = turned[0]
                branch.direction[2 * i + 1] = turned[1]
        tilt = tilt_of(y)
        level = wp.dot(tilt, tilt)
        if level > zero:
            ahead = wp.dot(tilt, two_of(branch.direction, sections))
            roll = tilt * (wp.where(ahead < zero, -one, one) / wp.sqrt(level))
            branch.direction[2 * sections] = roll[0]
            branch.direction[2 * sections + 1] = roll[1]
        return branch

    @wp.func
    def unit_attitude(y: State):
        q = attitude_of(y)
        n = one / wp.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        for j in range(4):
            y[Q + j] = y[Q + j] * n
        return y

    @wp.func
    def end_of(y: State):
        """The status that a state ends a run with, 0 if none."""
        if not wp.isfinite(wp.length_sq(y)):
            return wp.int32(not_finite)
        for i in range(sections):
            if wp.length_sq(bend_of(y, i)) > two:
                return wp.int32(overbent)
        return wp.int32(finite)

    return holding(Stepping, locals())


@cache
def resolution_code(precision: str, tree: Tree) -> Any:
    """The function `unresolved`: what a step of RK4 leaves out, from its stages.

    On y' = λ y, z = λ h, the stages are k₁ times 1, 1 + z/2, 1 + z/2 + z²/4 and so on, and a step
    errs by y z⁵/120. So |z| is twice |k₃ - k₂| / |k₂ - k₁|, and the error h |k₃ - k₂| z²/30.
    """
    types, full = device_types(precision, tree), FULL_LENGTH
    Real, State, Plant = types.Real, types.State, types.Plant
    position_of, velocity_of, spin_of = types.position_of, types.velocity_of, types.spin_of
    attitude_of, bend_of, bend_rate_of = types.attitude_of, types.bend_of, types.bend_rate_of
    zero, four, thirty, phase = Real(0.0), Real(4.0), Real(30.0), Real(STEP_PHASE)
    sections, turn = types.layout.sections, Real(full)

    @wp.func
    def squared_size(d: State, plant: Plant, period: Real):
        """Of a difference of rates: how far it moves the tip, squared, in arm lengths per second.

        A moment of the arm turns by twice a change of the quaternion, and a bend moves the tip by
        its angle times its section's reach; accelerations act for a period [s].
        """
        area = plant.length * plant.length
        q = attitude_of(d)
        moved = wp.length_sq(position_of(d)) / area + four * wp.dot(q, q)
        pushed = wp.length_sq(velocity_of(d)) / area + wp.length_sq(spin_of(d))
        for i in range(sections):
            bending = turn * plant.reach[i]
            moved += bending * bending * wp.length_sq(bend_of(d, i))
            pushed += bending * bending * wp.length_sq(bend_rate_of(d, i))
        return moved + period * period * pushed

    @wp.func
    def unresolved(k1: State, k2: State, k3: State, h: Real, plant: Plant):
        """Error of a step of length h [s], as a distance of the tip in arm lengths."""
        # The fastest rate that an automatic step resolves turns accelerations into rates.
        first = squared_size(k2 - k1, plant, h / phase)
        second = squared_size(k3 - k2, plant, h / phase)
        if first == zero:
            return zero
        # Where stages hardly differ, their ratio says nothing: RK4 is unstable from z = 2.8 on.
        square = wp.min(four * second / first, four)
        return h * wp.sqrt(second) * square / thirty

    return unresolved


def step_code(precision: str, tree: Tree, rate_of: Any, pilot: PilotCode) -> Any:
    """The function `step`: one step of RK4 of a model, by its rate_of, under a pilot.

    It returns the state at the step's end, and the error of the step in arm lengths; 0 for a step
    that is not measured.
    """
    types, stepping = device_types(precision, tree), stepping_code(precision, tree)
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Flight, Pilot, push_at = flight_code(precision, tree).Flight, pilot.Pilot, pilot.push_at
    unit_attitude, unresolved = stepping.unit_attitude, resolution_code(precision, tree)
    half, sixth, two, zero = Real(0.5), Real(1.0 / 6.0), Real(2.0), Real(0.0)

    @wp.func
    def slope(
        i: int, ahead: int, time: Real, y: State, along: Along, flight: Flight, pilot: Pilot,
        held: Push,
    ):  # fmt: skip
        """dy/dt at a stage of step i; ahead: 0 at its start, 1 in its middle, 2 at its end."""
        push = push_at(3 * i + ahead, time, y, along, flight, pilot, held)
        row = i * flight.stride + wp.min(flight.stride, ahead)
        return rate_of(y, along, flight, row, push)

    @wp.func
    def step(
        i: int, time: Real, h: Real, y: State, along: Along, flight: Flight, pilot: Pilot,
        held: Push, measured: wp.bool,
    ):  # fmt: skip
        """The state at the end of step i, which starts at a time and lasts h."""
        middle = time + half * h
        k1 = slope(i, 0, time, y, along, flight, pilot, held)
        k2 = slope(i, 1, middle, y + half * h * k1, along, flight, pilot, held)
        k3 = slope(i, 1, middle, y + half * h * k2, along, flight, pilot, held)
        error = zero
        if measured:
            error = unresolved(k1, k2, k3, h, flight.plant)
        k4 = slope(i, 2, time + h, y + h * k3, along, flight, pilot, held)
        return unit_attitude(y + (h * sixth) * (k1 + two * (k2 + k3) + k4)), error

    return step
