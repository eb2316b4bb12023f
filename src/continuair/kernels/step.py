"""Device code of one time step, and of the signed branch of the bend."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.pilot import PilotCode
from continuair.kernels.types import device_types, holding

OK, NOT_FINITE, OVERBENT, UNSEEN = 0, 1, 2, 3
STATUS = {
    OK: "ok",
    NOT_FINITE: "not finite",
    OVERBENT: "bent beyond a full circle",
    UNSEEN: "all feature points lost from view",
}


@dataclass(frozen=True)
class Stepping:
    """Branch, a struct, and how it and a state go on; end_of gives the status of a state."""

    Branch: Any
    branch_at: Any
    angle_of: Any
    followed: Any
    unit_attitude: Any
    end_of: Any


@cache
def stepping_code(precision: str, sections: int) -> Stepping:
    """What follows each step."""
    types = device_types(precision, sections)
    Real, State, vec2 = types.Real, types.State, types.vec2
    bend_of, attitude_of = types.bend_of, types.attitude_of
    Q = types.layout.attitude.start
    zero, one, two, pi = Real(0.0), Real(1.0), Real(2.0), Real(3.141592653589793)
    finite, not_finite, overbent = OK, NOT_FINITE, OVERBENT

    @wp.struct
    class Branch:
        """(cos ψa, sin ψa) of the signed branch followed, and its full turns."""

        direction: vec2
        turns: Real

    @wp.func
    def branch_at(angle: Real):
        out = Branch()
        out.direction = vec2(wp.cos(angle), wp.sin(angle))
        within = wp.atan2(out.direction[1], out.direction[0])
        out.turns = wp.round((angle - within) / (two * pi))
        return out

    @wp.func
    def angle_of(branch: Branch):
        """ψa, continuous."""
        return wp.atan2(branch.direction[1], branch.direction[0]) + two * pi * branch.turns

    @wp.func
    def followed(branch: Branch, y: State):
        """κ changes sign when the bend passes through straight; ψa stays continuous."""
        b = bend_of(y)
        u = wp.dot(b, b)
        before = branch.direction
        if u > zero:
            side = wp.where(wp.dot(b, before) < zero, -one, one)
            turned = b * (side / wp.sqrt(u))
            if before[0] + turned[0] < zero:
                if before[1] >= zero and turned[1] < zero:
                    branch.turns += one
                if before[1] < zero and turned[1] >= zero:
                    branch.turns -= one
            branch.direction = turned
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
        if wp.length_sq(bend_of(y)) > two:
            return wp.int32(overbent)
        return wp.int32(finite)

    return holding(Stepping, locals())


def step_code(precision: str, sections: int, rate_of: Any, pilot: PilotCode) -> Any:
    """The function `step`: one step of RK4 of a model, by its rate_of, under a pilot."""
    types, stepping = device_types(precision, sections), stepping_code(precision, sections)
    Real, State, Push, vec2 = types.Real, types.State, types.Push, types.vec2
    Flight, Pilot, push_at = flight_code(precision, sections).Flight, pilot.Pilot, pilot.push_at
    unit_attitude = stepping.unit_attitude
    half, sixth, two = Real(0.5), Real(1.0 / 6.0), Real(2.0)

    @wp.func
    def slope(
        i: int, ahead: int, time: Real, y: State, along: vec2, flight: Flight, pilot: Pilot,
        held: Push,
    ):  # fmt: skip
        """dy/dt at a stage of step i; ahead: 0 at its start, 1 in its middle, 2 at its end."""
        push = push_at(3 * i + ahead, time, y, along, flight, pilot, held)
        row = i * flight.stride + wp.min(flight.stride, ahead)
        return rate_of(y, along, flight, row, push)

    @wp.func
    def step(
        i: int, time: Real, h: Real, y: State, along: vec2, flight: Flight, pilot: Pilot,
        held: Push,
    ):  # fmt: skip
        """The state at the end of step i, which starts at a time and lasts h."""
        middle = time + half * h
        k1 = slope(i, 0, time, y, along, flight, pilot, held)
        k2 = slope(i, 1, middle, y + half * h * k1, along, flight, pilot, held)
        k3 = slope(i, 1, middle, y + half * h * k2, along, flight, pilot, held)
        k4 = slope(i, 2, time + h, y + h * k3, along, flight, pilot, held)
        return unit_attitude(y + (h * sixth) * (k1 + two * (k2 + k3) + k4))

    return step
