"""Hold a position, an attitude and a bend: PD loops on each, with weight and spring carried."""

from types import SimpleNamespace

import warp as wp


def law(code: SimpleNamespace) -> SimpleNamespace:
    """The law on the device."""
    Real, Push, Sense = code.Real, code.Push, code.Sense
    vec2, vec3, quat, mat33 = code.vec2, code.vec3, code.quat, code.mat33
    two, zero, one = Real(2.0), Real(0.0), Real(1.0)

    @wp.struct
    class Gains:
        position: vec3
        attitude: quat
        bend: vec2
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
        side = two * wp.where(turn[3] < zero, -one, one)
        w = gains.attitude_rate
        error = side * vec3(turn[0], turn[1], turn[2])
        m = gains.inertia * (w * (w * error - two * sense.angular_velocity))
        w = gains.bend_rate
        b = gains.stiffness * gains.bend
        b += gains.bend_inertia * w * (w * (gains.bend - sense.bend) - two * sense.bend_rate)
        return sense.weight + Push(f[0], f[1], f[2], m[0], m[1], m[2], b[0], b[1])

    return SimpleNamespace(Gains=Gains, control=control)
