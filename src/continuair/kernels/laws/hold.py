"""Hold a position, an attitude and the bends: PD loops on each, with weight and spring carried.

Weight and spring of sections that no loop holds are not carried: these hang free. The spring is
carried at the bends to hold, and helps the loops elsewhere. Moments on the bends are the
inertia of the straight arms times the accelerations of their loops: while the base rests, what one
section's loop does moves no other section. Limits cut each number of the push by itself.
"""

from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.kernels.laws.servoing import gains_of
from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Gains = gains_of(_gains(code))
    return SimpleNamespace(Gains=Gains, control=_holding(code, Gains))


def limited_law(code: LawCode) -> SimpleNamespace:
    """The same within limits of the push."""
    Gains = gains_of(_gains(code) | {"limit": code.Push})
    holding, Sense, numbers = _holding(code, Gains), code.Sense, 6 + code.bends

    @wp.func
    def control(sense: Sense, gains: Gains):
        asked = holding(sense, gains)
        for i in range(numbers):
            most = gains.limit[i]
            asked[i] = wp.max(-most, wp.min(most, asked[i]))
        return asked

    return SimpleNamespace(Gains=Gains, control=control)


def _gains(code: LawCode) -> dict[str, Any]:
    """The law's gains and their types."""
    return {
        "position": code.vec3,
        "attitude": code.quat,
        "bend": code.Bends,
        "mass": code.Real,
        "inertia": code.mat33,
        "bend_inertia": wp.types.matrix((code.bends, code.bends), code.Real),
        "stiffness": code.Bends,
        "rate": code.Real,
        "attitude_rate": code.Real,
        "bend_rate": code.Bends,
    }


def _holding(code: LawCode, Gains: Any) -> Any:
    """The push of (sense, gains)."""
    Real, Sense, push, above = code.Real, code.Sense, code.push, code.above
    vec3, bends = code.vec3, code.bends
    two, zero, one = Real(2.0), Real(0.0), Real(1.0)

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
        weight = sense.weight
        for i in range(bends):
            # A free section hangs by its own spring.
            weight[6 + i] = above(gains.bend_rate[i], zero, weight[6 + i], zero)
        return weight + push(f, m, b)

    return control
