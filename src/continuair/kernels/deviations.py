"""Kernel of the deviations between two logs of the tip."""

from typing import Any

import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.vehicle.layout import DEVIATIONS, TIP_POSE

ROUNDING = 1e-12
"""Rounding error relative to the largest number of a run, in its motion and in a difference."""


def deviation_kernel(numbers: Numbers) -> Any:
    """Return the kernel `deviate`: the columns DEVIATIONS, one run or pack per thread."""
    code, angle_of = number_code(numbers), elementary_code(numbers).angle_of
    Cell, Real, above, lanes = code.Cell, code.Real, code.above, code.lanes
    of_sample, keep_of_run = code.of_sample, code.keep_of_run
    vec3 = wp.types.vector(3, Real)
    quat = wp.types.quaternion(Real)
    zero, one, two = Real(0.0), Real(1.0), Real(2.0)
    P, Q = TIP_POSE["position"].start, TIP_POSE["attitude"].start
    nrmse_t, nrmse_r, rmse_t, rmse_r, angle = range(len(DEVIATIONS))
    pi = Real(3.141592653589793)

    @wp.struct
    class Angles:
        """Continuous ZYX angles: principal and chosen angles, whole turns, and other, 1 if the
        other triple is followed."""

        principal: vec3
        chosen: vec3
        turns: vec3
        other: Real

    @wp.func
    def attitude(log: wp.array3d(dtype=Cell), run: int, sample: int):
        return quat(
            of_sample(log, run, sample, Q),
            of_sample(log, run, sample, Q + 1),
            of_sample(log, run, sample, Q + 2),
            of_sample(log, run, sample, Q + 3),
        )

    @wp.func
    def euler(tip: quat):
        """Return principal roll, pitch and yaw of R_tip diag(1, -1, -1)."""
        x, y, z, w = tip[3], tip[2], -tip[1], -tip[0]
        sine = wp.max(-one, wp.min(one, two * (w * y - x * z)))
        return vec3(
            angle_of(two * (y * z + w * x), one - two * (x * x + y * y)),
            angle_of(sine, wp.sqrt((one - sine) * (one + sine))),
            angle_of(two * (x * y + w * z), one - two * (y * y + z * z)),
        )

    @wp.func
    def turned(a: vec3):
        """Return the other triple of the same attitude."""
        return vec3(a[0] + pi, pi - a[1], a[2] + pi)

    @wp.func
    def gap_on_circle(a: Real):
        """Return |a| wrapped to at most π, for |a| up to 3π."""
        size = wp.abs(a)
        return wp.min(size, wp.abs(size - two * pi))

    @wp.func
    def wrapped_square(a: vec3):
        gap = vec3(gap_on_circle(a[0]), gap_on_circle(a[1]), gap_on_circle(a[2]))
        return wp.length_sq(gap)

    @wp.func
    def turn_of(a: Real):
        """Return the whole turns, -1, 0 or 1, in a step a, for |a| up to 3π."""
        return above(a, pi, one, above(-pi, a, -one, zero))

    @wp.func
    def begin(tip: quat):
        out = Angles()
        out.principal = euler(tip)
        out.chosen = out.principal
        return out

    @wp.func
    def follow(angles: Angles, tip: quat):
        """Return the next sample's angles on the branch nearest to the previous; see tip_euler."""
        a = euler(tip)
        b = turned(a)
        nearer = wrapped_square(a - angles.principal)
        other = above(
            nearer, wrapped_square(b - angles.principal), one - angles.other, angles.other
        )
        out = Angles()
        out.principal = a
        out.other = other
        out.chosen = a + other * (b - a)
        step = out.chosen - angles.chosen
        out.turns = angles.turns - vec3(turn_of(step[0]), turn_of(step[1]), turn_of(step[2]))
        return out

    @wp.func
    def larger(size: Real, a: vec3):
        return wp.max(size, wp.max(wp.abs(a[0]), wp.max(wp.abs(a[1]), wp.abs(a[2]))))

    @wp.func
    def ratio(squares: Real, spread: vec3, samples: Real, largest: Real):
        """Return the NRMSE of Amiri et al., as `differences` of analysis/metrics.py defines it.

        It is 0 if the difference is rounding, inf if only the motion is, and NaN stays NaN.
        """
        error, moved = wp.sqrt(squares / samples), wp.length(spread)
        unsure = Real(ROUNDING) * wp.max(largest, one)
        return above(error, unsure, error / above(moved, unsure, moved, zero), zero * error)

    @wp.func
    def angle_between(a: quat, b: quat):
        turn = wp.quat_inverse(a) * b
        return two * angle_of(wp.length(vec3(turn[0], turn[1], turn[2])), wp.abs(turn[3]))

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def deviate(
        reference: wp.array3d(dtype=Cell),
        other: wp.array3d(dtype=Cell),
        out: wp.array2d(dtype=Cell),
    ):
        run = wp.tid() * lanes
        samples = reference.shape[1]
        at = vec3(
            of_sample(reference, run, 0, P),
            of_sample(reference, run, 0, P + 1),
            of_sample(reference, run, 0, P + 2),
        )
        least = at
        most = at
        ours = begin(attitude(reference, run, 0))
        theirs = begin(attitude(other, run, 0))
        least_angle = ours.chosen
        most_angle = ours.chosen
        farthest = Real(0.0)
        widest = Real(0.0)
        moved = Real(0.0)
        rotated = Real(0.0)
        apart = Real(0.0)
        for i in range(samples):
            r, s = attitude(reference, run, i), attitude(other, run, i)
            if i > 0:
                ours = follow(ours, r)
                theirs = follow(theirs, s)
            for j in range(3):
                x = of_sample(reference, run, i, P + j)
                least[j] = wp.min(least[j], x)
                most[j] = wp.max(most[j], x)
                farthest = wp.max(farthest, wp.abs(x))
                gap = x - of_sample(other, run, i, P + j)
                moved += gap * gap
            angles = ours.chosen + two * pi * ours.turns
            least_angle = wp.min(least_angle, angles)
            most_angle = wp.max(most_angle, angles)
            widest = larger(widest, angles)
            rotated += wp.length_sq(angles - theirs.chosen - two * pi * theirs.turns)
            turn = angle_between(r, s)
            apart += turn * turn
        n = Real(samples)
        keep_of_run(out, run, nrmse_t, ratio(moved, most - least, n, farthest))
        keep_of_run(out, run, nrmse_r, ratio(rotated, most_angle - least_angle, n, widest))
        keep_of_run(out, run, rmse_t, wp.sqrt(moved / n))
        keep_of_run(out, run, rmse_r, wp.sqrt(rotated / n))
        keep_of_run(out, run, angle, wp.sqrt(apart / n))

    return deviate
