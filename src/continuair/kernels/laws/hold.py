"""Hold a position, an attitude and the bends: PD loops on each, with weight and spring carried.

The spring is carried at the bends to hold, and helps the loops elsewhere. Moments on the bends are
the inertia of the straight arms times the accelerations of their loops: while the base rests, what
one section's loop does moves no other section.
"""

from types import SimpleNamespace

import warp as wp

from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Real, Sense, push, above = code.Real, code.Sense, code.push, code.above
    Bends, vec3, quat, mat33 = code.Bends, code.vec3, code.quat, code.mat33
    two, zero, one = Real(2.0), Real(0.0), Real(1.0)
    bends = code.bends
    BendInertia = wp.types.matrix((bends, bends), Real)

    @wp.struct
    class Gains:
        position: vec3
        attitude: quat
        bend: Bends
        mass: Real
        inertia: mat33
        bend_inertia: BendInertia
        stiffness: Bends
        rate: Real
        attitude_rate: Real
        bend_rate: Bends

    @wp.func
    def control(sense: Sense, gains: Gains):
        w = gains.rate
        f = gains.mass * w * (w * (gains.position - sense.position) - two * sense.velocity)
        turn = wp.quat_inverse(sense.attitude) * gains.attitude
        side = two * above(zero, turn[3], -one, one)
        w = gains.attitude_rate
        error = side * vec3(turn[0], turn[1], turn[2])
        m = gains.inertia * (w * (w * error - two * sense.angular_velocity))
        b = wp.cw_mul(gains.stiffness, gains.bend)
        x = wp.cw_mul(gains.bend_rate, gains.bend - sense.bend) - two * sense.bend_rate
        for i in range(bends):
            b[i] = b[i] + gains.bend_inertia[i, i] * gains.bend_rate[i] * x[i]
            for j in range(bends):
                if i != j:
                    b[i] = b[i] + gains.bend_inertia[i, j] * gains.bend_rate[j] * x[j]
        return sense.weight + push(f, m, b)

    return SimpleNamespace(Gains=Gains, control=control)
