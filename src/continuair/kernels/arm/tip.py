"""Device code of where the arms' tips are, how they move, and what a wrench on one does.

An arm is followed section by section from its mount, in body axes; a section's tip lies in closed
form at its bend, in units of its λ. The tip's axes are the last section's, turned half about x.
"""

from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Any

import warp as wp

from continuair.kernels.elementary import elementary_code
from continuair.kernels.numbers import Numbers
from continuair.kernels.types import FULL_LENGTH, Tree, device_types, holding


@dataclass(frozen=True)
class TipCode:
    """Structs and functions of the arms' tips; each is defined, and said what it is, below.

    tip_of(arm), moving_tip_of(arm), world_tip_of(arm) and wrench_on(arm) give the functions of one
    arm; points_of_tips is of all.
    """

    Tip: Any
    MovingTip: Any
    End: Any
    end_of: Any
    mounted: Any
    swept_by: Any
    turned_by: Any
    wrench_on_bend: Any
    tip_of: Any
    moving_tip_of: Any
    world_tip_of: Any
    wrench_on: Any
    points_of_tips: Any


@cache
def tip_code(numbers: Numbers, tree: Tree) -> TipCode:
    """The functions for one kind of numbers and tree."""
    types = device_types(numbers, tree)
    Real, State, Plant, Bends = types.Real, types.State, types.Plant, types.Bends
    Vectors = types.Vectors
    vec2, vec3, quat = types.vec2, types.vec3, types.quat
    bend_of, bend_rate_of, mount_of = types.bend_of, types.bend_rate_of, types.mount_of
    position_of, attitude_of = types.position_of, types.attitude_of
    velocity_of, spin_of = types.velocity_of, types.spin_of
    zero, quarter, half, one, two = (Real(x) for x in (0.0, 0.25, 0.5, 1.0, 2.0))
    full, turned, Series = Real(FULL_LENGTH), tree.turned, wp.types.vector(6, Real)
    polynomial = elementary_code(numbers).polynomial
    series_3, series_4 = (
        polynomial([(-1.0) ** k / factorial(2 * k + m) for k in reversed(range(8))]) for m in (3, 4)
    )

    @wp.struct
    class End:
        """A section's end seen from its base: point [λ] and turn, about (-b_y, b_x) by -|b| σ; and
        A, A', B', Γ there."""

        point: vec3
        turn: quat
        A: Real
        dA: Real
        dB: Real
        Gamma: Real

    @wp.struct
    class Tip:
        """An arm's tip on the body: point [m] and tip frame."""

        point: vec3
        attitude: quat

    @wp.struct
    class MovingTip:
        """A tip with its velocity as bends move it [m/s], and its turning with that of bends."""

        tip: Tip
        swept: vec3
        turned: vec3

    @wp.struct
    class WorldTip:
        """A tip in world axes: place [m], velocity [m/s], turning [rad/s] and tip frame."""

        position: vec3
        velocity: vec3
        turning: vec3
        attitude: quat

    @wp.func
    def stumpff(z: Real):
        """c_1 … c_4 of z, and c_0 and c_1 of z/4: series of z/64, and three times the double angle.

        c_0 is 1 - z c_2.
        """
        t = z * Real(0.015625)
        c3 = series_3(t)
        c4 = series_4(t)
        c1 = one - t * c3
        c2 = half - t * c4
        before = vec2(one, c1)
        for _ in range(3):
            c0 = one - t * c2
            before = vec2(c0, c1)
            c4 = Real(0.125) * c3 * (one + c1)
            c3 = (c2 + c0 * c3) * quarter
            c2 = half * c1 * c1
            c1 = c0 * c1
            t = Real(4.0) * t
        return Series(c1, c2, c3, c4, before[0], before[1])

    @wp.func
    def end_of(b: vec2):
        out = End()
        c = stumpff(full * full * wp.dot(b, b))
        A = full * full * c[1]
        out.A = A
        out.dA = full * full * full * full * (c[3] - half * c[2])
        out.dB = half * full * full * full * (c[2] - c[1])
        out.Gamma = full * full * full * c[2]
        out.point = vec3(A * b[0], A * b[1], -full * c[0])
        s = half * full * c[5]
        out.turn = quat(s * b[1], -s * b[0], zero, c[4])
        return out

    @wp.func
    def along_bend(a: Real, d_a: Real, d_beta: Real, b: vec2, force: vec3):
        """Jᵀ force of a point at (a b, -β), whose derivatives in u are d_a and d_beta."""
        h = vec2(force[0], force[1])
        return a * h + two * (d_a * wp.dot(b, h) - d_beta * force[2]) * b

    @wp.func
    def wrench_on_bend(end: End, unit: Real, b: vec2, force: vec3, moment: vec3):
        """Jᵀ (force, moment): a wrench on a section's end, in its axes, as a force on its bend."""
        twist = end.A * moment[2] - end.Gamma * (b[0] * moment[0] + b[1] * moment[1])
        bend = unit * along_bend(end.A, end.dA, end.dB, b, force)
        return bend + full * vec2(-moment[1], moment[0]) + twist * vec2(-b[1], b[0])

    @wp.func
    def swept_by(end: End, unit: Real, b: vec2, db: vec2):
        """Velocity of a section's end as it bends [m/s], in its axes."""
        along = two * wp.dot(b, db)
        return unit * vec3(
            end.A * db[0] + end.dA * along * b[0],
            end.A * db[1] + end.dA * along * b[1],
            -end.dB * along,
        )

    @wp.func
    def turned_by(end: End, b: vec2, db: vec2):
        """Turning of a section's end as it bends, in its axes."""
        across = b[0] * db[1] - b[1] * db[0]
        return vec3(
            full * db[1] - end.Gamma * b[0] * across,
            -full * db[0] - end.Gamma * b[1] * across,
            end.A * across,
        )

    @wp.func
    def mounted(plant: Plant, arm: int):
        """Where an arm begins."""
        out = Tip()
        out.point = mount_of(plant, arm)
        t = plant.mount_attitude
        out.attitude = quat(t[arm, 0], t[arm, 1], t[arm, 2], t[arm, 3])
        return out

    @wp.func
    def half_turn(attitude: quat):
        """The tip frame, whose z points out of the arm, on axes in which it lies along -z."""
        return attitude * quat(one, zero, zero, zero)

    def tip_of(arm: int) -> Any:
        first, last = tree.first[arm], tree.first[arm] + tree.sections[arm]

        @wp.func
        def tip(y: State, plant: Plant):
            """The Tip of this arm."""
            out = mounted(plant, arm)
            for i in range(first, last):
                end = end_of(bend_of(y, i))
                step = plant.unit[i] * end.point
                if wp.static(turned or tree.sections[arm] > 1):
                    step = wp.quat_rotate(out.attitude, step)
                out.point += step
                if wp.static(turned or tree.sections[arm] > 1):
                    out.attitude = out.attitude * end.turn
                else:
                    out.attitude = end.turn
            out.attitude = half_turn(out.attitude)
            return out

        return tip

    def moving_tip_of(arm: int) -> Any:
        first, last = tree.first[arm], tree.first[arm] + tree.sections[arm]

        @wp.func
        def moving_tip(y: State, plant: Plant):
            """The MovingTip of this arm, in body axes."""
            at = mounted(plant, arm)
            swept = vec3()
            spun = vec3()
            for i in range(first, last):
                b = bend_of(y, i)
                db = bend_rate_of(y, i)
                end = end_of(b)
                step = plant.unit[i] * end.point
                moved = swept_by(end, plant.unit[i], b, db)
                spin = turned_by(end, b, db)
                turn = end.turn
                if wp.static(turned or tree.sections[arm] > 1):
                    step = wp.quat_rotate(at.attitude, step)
                    moved = wp.quat_rotate(at.attitude, moved)
                    spin = wp.quat_rotate(at.attitude, spin)
                    turn = at.attitude * turn
                swept += wp.cross(spun, step) + moved
                spun += spin
                at.point += step
                at.attitude = turn
            at.attitude = half_turn(at.attitude)
            out = MovingTip()
            out.tip = at
            out.swept = swept
            out.turned = spun
            return out

        return moving_tip

    def world_tip_of(arm: int) -> Any:
        moving_tip = moving_tip_of(arm)

        @wp.func
        def world_tip(y: State, plant: Plant):
            """The WorldTip of this arm."""
            q, w, moving = attitude_of(y), spin_of(y), moving_tip(y, plant)
            point, out = moving.tip.point, WorldTip()
            out.position = position_of(y) + wp.quat_rotate(q, point)
            out.velocity = velocity_of(y) + wp.quat_rotate(q, wp.cross(w, point) + moving.swept)
            out.turning = wp.quat_rotate(q, w + moving.turned)
            out.attitude = q * moving.tip.attitude
            return out

        return world_tip

    def wrench_on(arm: int) -> Any:
        first, count = tree.first[arm], tree.sections[arm]

        @wp.func
        def wrench(y: State, plant: Plant, tip: Tip, force: vec3, moment: vec3):
            """Jᵀ (force, moment): a wrench on this arm's tip, in body axes, on all bends."""
            out = Bends()
            at = mounted(plant, arm)
            for k in range(count):
                i = first + k
                b = bend_of(y, i)
                end = end_of(b)
                f = force
                m = moment
                if wp.static(turned or count > 1):
                    at.point += wp.quat_rotate(at.attitude, plant.unit[i] * end.point)
                    f = wp.quat_rotate_inv(at.attitude, force)
                    m = wp.quat_rotate_inv(
                        at.attitude, moment + wp.cross(tip.point - at.point, force)
                    )
                    at.attitude = at.attitude * end.turn
                on = wrench_on_bend(end, plant.unit[i], b, f, m)
                out[2 * i] = on[0]
                out[2 * i + 1] = on[1]
            return out

        return wrench

    @wp.func
    def no_points(y: State, plant: Plant):
        return Vectors()

    def plus_point(before: Any, arm: int) -> Any:
        tip = tip_of(arm)

        @wp.func
        def points(y: State, plant: Plant):
            """The tips on the body [m], arm by arm."""
            out = before(y, plant)
            at = tip(y, plant).point
            for j in range(3):
                out[arm, j] = at[j]
            return out

        return points

    points_of_tips = no_points
    for arm in range(len(tree.sections)):
        points_of_tips = plus_point(points_of_tips, arm)
    return holding(TipCode, locals())
