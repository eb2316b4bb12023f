"""The paper's law on a vehicle whose arms are carried along: servoing with several sections.

Ours, not the paper's: its wrench on the camera, J_Lᵀ (K_p e_a - K_d J_L q̇), pushes the body as with
its arms frozen; the bends, those of other arms too, get the moments that the inertia of straight
arms asks for then, and loops of their own about straight. All bends move the camera and its twist.
"""

from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.kernels.laws.servoing import camera_wrench, choices, constant_gains, gains_of
from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Gains = gains_of(constant_gains(code) | choices(code) | carrying_gains(code))
    return SimpleNamespace(
        Gains=Gains, control=carrying_control(code, Gains, camera_wrench(code, Gains))
    )


def carrying_gains(code: LawCode) -> dict[str, Any]:
    """What carries the arms, and its types."""
    Real, bends = code.Real, code.bends
    return {
        "per_push": wp.types.matrix((bends, 6), Real),
        "bend_inertia": wp.types.matrix((bends, bends), Real),
        "bend_rate": Real,
    }


def carrying_control(code: LawCode, Gains: Any, wrench_of: Any) -> Any:
    """The push of (sense, gains): a wrench on the camera, and what carries the arms under it."""
    vec3, Bends, bends = code.vec3, code.Bends, code.bends
    Sense, push, camera_push, two = code.Sense, code.push, code.camera_push, code.Real(2.0)
    force_of, moment_of = code.force_of, code.moment_of

    @wp.func
    def carrying(sense: Sense, gains: Gains, force: vec3, moment: vec3):
        """Moments on the bends under a push on the body, both in its axes."""
        w = gains.bend_rate
        out = Bends()
        for i in range(bends):
            for j in range(3):
                out[i] = out[i] + gains.per_push[i, j] * force[j]
                out[i] = out[i] + gains.per_push[i, 3 + j] * moment[j]
            for j in range(bends):
                back = w * (w * sense.bend[j] + two * sense.bend_rate[j])
                out[i] = out[i] - gains.bend_inertia[i, j] * back
        return out

    @wp.func
    def control(sense: Sense, gains: Gains):
        frozen = camera_push(sense, wrench_of(sense, gains))
        force = force_of(frozen)
        moment = moment_of(frozen)
        bend = carrying(sense, gains, wp.quat_rotate_inv(sense.attitude, force), moment)
        tau = sense.weight + gains.spring * sense.spring
        return tau + push(force, moment, bend - gains.posture * sense.bend_rate)

    return control
