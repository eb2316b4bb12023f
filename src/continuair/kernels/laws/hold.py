"""Hold a position, an attitude and a bend: PD loops on each, with weight and spring carried."""

from types import SimpleNamespace

import warp as wp

from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Real, Sense, push, above = code.Real, code.Sense, code.push, code.above
    Bends, vec3, quat, mat33 = code.Bends, code.vec3, code.quat, code.mat33
    two, zero, one = Real(2.0), Real(0.0), Real(1.0)

    @wp.struct
    class Gains:
        position: vec3
        attitude: quat
        bend: Bends
        mass: Real
        inertia: mat33
        bend_inertia: Real
        stiffness: Real
        rate: Real
        attitude_rate: Real
        bend_rate: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        w = gains.rate
        f = gains.mass * w * (w * (gains.position - sense.position) - two * sense.velocity)
        turn = wp.quat_inverse(sense.attitude) * gains.attitude
        side = two * above(zero, turn[3], -one, one)
        w = gains.attitude_rate
        error = side * vec3(turn[0], turn[1], turn[2])
        m = gains.inertia * (w * (w * error - two * sense.angular_velocity))
        w = gains.bend_rate
        b = gains.stiffness * gains.bend
        b += gains.bend_inertia * w * (w * (gains.bend - sense.bend) - two * sense.bend_rate)
        return sense.weight + push(f, m, b)

    return SimpleNamespace(Gains=Gains, control=control)
