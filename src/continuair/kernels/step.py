"""Device code of one time step, and of the followed branches of the paper's angles."""

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
    """Branch, a struct, and updates of branches and states; end_of returns the status of a state.

    signed_of(branch, y, unit): κ [1/m] and ψa of each section on its branch, or the coordinates
    themselves for other kinds. euler_of(branch): roll, pitch and yaw. followed(branch, y, path,
    share, end): branches after a share of a step from y along a Path.

    added(y, change): state after a change, with unit quaternion. compensated(y, rest, change): the
    same with its rounding error, which the next change corrects; rest: previous rounding error.
    """

    Branch: Any
    branch_at: Any
    signed_of: Any
    euler_of: Any
    Path: Any
    followed: Any
    chosen: Any
    added: Any
    compensated: Any
    end_of: Any


@cache
def stepping_code(numbers: Numbers, tree: Tree) -> Stepping:
    """Return the updates after each step, for one kind of numbers and tree."""
    types, code, known = device_types(numbers, tree), number_code(numbers), elementary_code(numbers)
    Cell, Real, State, Bends = types.Cell, types.Real, types.State, types.Bends
    vec2, vec3, Along, tilt_of = types.vec2, types.vec3, types.Along, types.tilt_of
    above, finite, of_run, any_above = code.above, code.finite, code.of_run, code.any_above
    sine, cosine, angle_of = known.sine, known.cosine, known.angle_of
    PerSection, two_of, with_two = types.PerSection, types.two_of, types.with_two
    attitude_of, sections, bends = types.attitude_of, types.layout.sections, types.layout.bends
    arcs = bend_code(numbers, tree)
    count, section_of, bend_of = arcs.count, arcs.section_of, arcs.bend_of
    bends_of, with_polar = types.bends_of, arcs.with_polar
    Q = types.layout.attitude.start
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)
    whole_turn = Real(2.0 * np.pi)
    # cos(1 rad), and the largest distance from zero [rad] of a vector that passes through it.
    clear, columns = Real(float(np.cos(1.0))), types.layout.state
    through = Real(1e-5 if numbers.precision == "float32" else 1e-9)
    ok, not_finite, overbent = (Real(float(status)) for status in (OK, NOT_FINITE, OVERBENT))

    @wp.struct
    class Branch:
        """Followed branches.

        direction, turns: (cos ψa, sin ψa) of each section on its signed branch, at last
        (cos φ, sin φ), and full turns of ψa. pitch, yaw: (cos θ, sin θ), (cos ψ, sin ψ).
        euler_turns: full turns of roll, pitch and yaw.
        """

        direction: Along
        turns: PerSection
        pitch: vec2
        yaw: vec2
        euler_turns: vec3

    @wp.struct
    class Path:
        """A step: its change, and the slopes at both ends times its length."""

        change: State
        begins: State
        ends: State

    @wp.func
    def added(y: State, change: State):
        out = y + change
        q = attitude_of(out)
        n = one / wp.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        for j in range(4):
            out[Q + j] = out[Q + j] * n
        return out

    @wp.func
    def euler_of(branch: Branch):
        """Return roll, pitch and yaw, whole turns included."""
        roll = two_of(branch.direction, sections)
        within = vec3(
            angle_of(roll[1], roll[0]),
            angle_of(branch.pitch[1], branch.pitch[0]),
            angle_of(branch.yaw[1], branch.yaw[0]),
        )
        return within + whole_turn * branch.euler_turns

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
        pitch = of_run(angles, run, sections + 1)
        yaw = of_run(angles, run, sections + 2)
        out.direction = with_two(out.direction, sections, vec2(cosine(roll), sine(roll)))
        out.pitch = vec2(cosine(pitch), sine(pitch))
        out.yaw = vec2(cosine(yaw), sine(yaw))
        turned = (vec3(roll, pitch, yaw) - euler_of(out)) / whole_turn
        for j in range(3):
            out.euler_turns[j] = wp.floor(turned[j] + half)
        return out

    @wp.func
    def product(a: vec2, b: vec2):
        """Return a·b; the rounding of wp.dot depends on the compilation."""
        return a[0] * b[0] + a[1] * b[1]

    @wp.func
    def signed_of(branch: Branch, y: State, unit: Bends):
        """Return κ and ψa of each section, with continuous ψa."""
        out = bends_of(y)
        for j in range(bends):
            out[j] = out[j] / unit[j]
        for k in range(count):
            i = section_of(k)
            along = two_of(branch.direction, i)
            angle = angle_of(along[1], along[0]) + whole_turn * branch.turns[i]
            out = with_polar(out, i, product(bend_of(y, i), along), angle, unit)
        return out

    @wp.func
    def direction(found: vec2, side: Real, before: vec2):
        """Return the direction of a vector times side, the previous one for a zero vector."""
        u = product(found, found)
        scale = side / wp.sqrt(above(u, zero, u, one))
        x = above(u, zero, found[0] * scale, before[0])
        y = above(u, zero, found[1] * scale, before[1])
        return vec2(x, y)

    @wp.func
    def turned_to(along: vec2, a: vec2, b: vec2):
        """Return the direction after a vector has moved from a to b in a straight line.

        It rotates with the vector, on the same side, unless the vector starts at zero or passes
        through it.
        """
        crossed = wp.abs(a[0] * b[1] - a[1] * b[0])
        gone = b - a
        begun = above(product(a, a), through * through, zero, one)
        passed = above(crossed * crossed, through * through * product(gone, gone), zero, one)
        passed = above(zero, product(a, b), passed, zero)
        side = above(zero, product(a, along), -one, one)
        near = above(zero, product(b, along), -one, one)
        side = above(begun + passed, half, near, side)
        far = above(product(b, b), through * through, one, zero)
        there = direction(b, side, along)
        return vec2(above(far, half, there[0], along[0]), above(far, half, there[1], along[1]))

    @wp.func
    def turns_between(before: vec2, after: vec2):
        """Return 1 or -1 where a direction has passed ±π, in a rotation of less than π, else 0."""
        sense = before[0] * after[1] - before[1] * after[0]
        down = above(zero, after[1], above(zero, before[1], zero, one), zero)
        up = above(zero, before[1], above(zero, after[1], zero, one), zero)
        return down * above(sense, zero, one, zero) - up * above(zero, sense, one, zero)

    @wp.func
    def with_euler(branch: Branch, before: State, y: State):
        """Update the Euler angles: roll, pitch and yaw stay continuous.

        cos θ changes sign where the vertical passes through the body's x axis.
        """
        q = attitude_of(y)
        tilt = tilt_of(y)
        held = two_of(branch.direction, sections)
        roll = turned_to(held, tilt_of(before), tilt)
        side = above(zero, product(tilt, roll), -one, one)
        level = two * (q[3] * q[1] - q[0] * q[2])
        # From one product, for the same bits with any compilation.
        pitch = vec2(side * wp.sqrt(wp.max(zero, one - level * level)), level)
        heading = vec2(one - two * (q[1] * q[1] + q[2] * q[2]), two * (q[0] * q[1] + q[3] * q[2]))
        there = direction(heading, side, branch.yaw)
        far = above(product(tilt, tilt), through * through, one, zero)
        yaw = vec2(
            above(far, half, there[0], branch.yaw[0]), above(far, half, there[1], branch.yaw[1])
        )
        branch.euler_turns = branch.euler_turns + vec3(
            turns_between(held, roll),
            turns_between(branch.pitch, pitch),
            turns_between(branch.yaw, yaw),
        )
        branch.direction = with_two(branch.direction, sections, roll)
        branch.pitch = pitch
        branch.yaw = yaw
        return branch

    @wp.func
    def with_bend(branch: Branch, section: int, before: vec2, bend: vec2):
        """Update the branch of a bend: κ changes sign at bend 0, ψa stays continuous."""
        held = two_of(branch.direction, section)
        turned = turned_to(held, before, bend)
        branch.turns[section] = branch.turns[section] + turns_between(held, turned)
        branch.direction = with_two(branch.direction, section, turned)
        return branch

    @wp.func
    def doubtful(a: vec2, b: vec2):
        """Return 1 where a vector has rotated by more than a radian."""
        turned = product(a, b)
        limit = clear * clear * product(a, a) * product(b, b)
        return above(turned * wp.abs(turned), limit, zero, above(limit, zero, one, zero))

    @wp.func
    def nearest(a: vec2, b: vec2):
        """Return the share of the line from a to b, 0 to 1, that is nearest to zero."""
        gone = b - a
        square = product(gone, gone)
        share = -product(a, gone) / above(square, zero, square, one)
        return wp.max(zero, wp.min(one, share))

    @wp.func
    def on_path(path: Path, y: State, share: Real, wanted: Real):
        """Return the state at a share of a step, on a cubic Hermite spline; y where not wanted."""
        s = share
        change = s * s * (Real(3.0) - two * s) * path.change
        change += s * (one - s) * ((one - s) * path.begins - s * path.ends)
        there = added(y, change)
        out = State()
        for j in range(columns):
            out[j] = above(wanted, half, there[j], y[j])
        return out

    @wp.func
    def followed(branch: Branch, y: State, path: Path, share: Real, end: State):
        """Return the branches at the end, a share of the step from y along the path.

        A direction that rotates far is followed through the point where its vector is nearest to
        zero.
        """
        begun = tilt_of(y)
        doubt = doubtful(begun, tilt_of(end))
        via = y
        if any_above(doubt, half):
            via = on_path(path, y, share * nearest(begun, tilt_of(end)), doubt)
            branch = with_euler(branch, y, via)
        branch = with_euler(branch, via, end)
        for k in range(count):
            i = section_of(k)
            bend = bend_of(y, i)
            doubt = doubtful(bend, bend_of(end, i))
            if any_above(doubt, half):
                near = share * nearest(bend, bend_of(end, i))
                passed = bend_of(on_path(path, y, near, doubt), i)
                branch = with_bend(branch, i, bend, passed)
                bend = passed
            branch = with_bend(branch, i, bend, bend_of(end, i))
        return branch

    @wp.func
    def chosen(which: Real, x: Branch, y: Branch):
        """Return x where which > 0, else y."""
        out = y
        for i in range(sections + 1):
            for j in range(2):
                out.direction[i, j] = above(which, zero, x.direction[i, j], y.direction[i, j])
        for i in range(sections):
            out.turns[i] = above(which, zero, x.turns[i], y.turns[i])
        for j in range(2):
            out.pitch[j] = above(which, zero, x.pitch[j], y.pitch[j])
            out.yaw[j] = above(which, zero, x.yaw[j], y.yaw[j])
        for j in range(3):
            out.euler_turns[j] = above(which, zero, x.euler_turns[j], y.euler_turns[j])
        return out

    @wp.func
    def compensated(y: State, rest: State, change: State):
        """Return the sum by Kahan's method, and its rounding error.

        A change in one step can be smaller than the last digit of a position, velocity or attitude.
        """
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
        """Return the status with which a state stops a run, or 0."""
        return finite(wp.length_sq(y), within(y), not_finite)

    return holding(Stepping, locals())


def step_code(numbers: Numbers, tree: Tree, dynamics: Dynamics, pilot: PilotCode) -> Any:
    """Return the function `step`: the change of the state in one step of RK4."""
    types = device_types(numbers, tree)
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Flight, Pilot, push_at = flight_code(numbers, tree).Flight, pilot.Pilot, pilot.push_at
    rate_of, half, sixth = dynamics.rate_of, Real(0.5), Real(1.0 / 6.0)

    @wp.func
    def step(
        i: int, time: Real, h: Real, y: State, along: Along, flight: Flight, pilot: Pilot,
        held: Push,
    ):  # fmt: skip
        """Return the change of the state in step i, which starts at a time and lasts h."""
        k = State()
        total = State()
        # A loop that the compiler does not unroll: the code of the rate is compiled once.
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
