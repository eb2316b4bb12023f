"""A law of a user's for the device, which holds the place."""

# Annotations are Warp types made at run time, which mypy cannot follow.
# mypy: ignore-errors

from types import SimpleNamespace
from typing import Any

import warp as wp


def law(code: Any) -> SimpleNamespace:
    """Weight, and critically damped loops for place and attitude, as a user writes them."""
    Real, Sense, vec3, push = code.Real, code.Sense, code.vec3, code.push

    @wp.struct
    class Gains:
        goal: vec3
        mass: Real
        inertia: vec3
        rate: Real
        turn_rate: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        two, w, v = Real(2.0), gains.rate, gains.turn_rate
        force = gains.mass * w * (w * (gains.goal - sense.position) - two * sense.velocity)
        tilt = two * vec3(sense.attitude[0], sense.attitude[1], sense.attitude[2])
        turn = -v * wp.cw_mul(gains.inertia, v * tilt + two * sense.angular_velocity)
        return sense.weight + push(force, turn, Real(0.0) * sense.bend)

    return SimpleNamespace(Gains=Gains, control=control)
