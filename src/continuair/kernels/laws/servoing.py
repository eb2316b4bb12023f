"""DPD-SM-IBVS, the paper's law, Eqs. (15) and (16): τ = G + J_Lᵀ (K_p e_a - K_d J_L q̇).

e_a = C_d ė + C_p e + C_s tanh(e/σ), e = s_d - s, ė = -L (v_c - v_t), J_L = L J_c. The image is in
normalised coordinates, L at the image and the depths that the camera reports, v_t the target's
true twist in camera axes. Where the paper prints T_a⁻¹ in J_L, the rotation into camera axes
belongs. Named choices, with what is printed last: damping "camera" (on J_L q̇ = L v_c, printed) or
"feature" (on -ė); feed_forward False or True (printed); compensation "gravity_only" or "literal".
"""

from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Gains = gains_of(constant_gains(code) | choices(code))
    return SimpleNamespace(
        Gains=Gains, control=camera_control(code, Gains, camera_wrench(code, Gains))
    )


def constant_gains(code: LawCode) -> dict[str, Any]:
    """The law's gains and their types."""
    return dict.fromkeys(("Kp", "Kd", "Cp", "Cd", "Cs"), code.ImageGain)


def choices(code: LawCode) -> dict[str, Any]:
    """What else it is given, whatever its gains: σ, named choices and a damping of the posture."""
    names = ("sigma", "feed_forward", "on_feature_rate", "spring", "posture")
    return dict.fromkeys(names, code.Real)


def gains_of(fields: dict[str, Any]) -> Any:
    """Gains, a struct of fields by name."""
    return wp.struct(type("Gains", (), {"__annotations__": fields}))


def camera_control(code: LawCode, Gains: Any, wrench_of: Any) -> Any:
    """The push of (sense, gains): weight, spring, what a wrench on the camera does, and damping."""
    Sense, push, camera_push, vec3 = code.Sense, code.push, code.camera_push, code.vec3

    @wp.func
    def control(sense: Sense, gains: Gains):
        tau = sense.weight + gains.spring * sense.spring
        tau += camera_push(sense, wrench_of(sense, gains))
        return tau + push(vec3(), vec3(), -gains.posture * sense.bend_rate)

    return control


def camera_wrench(code: LawCode, Gains: Any) -> Any:
    """Lᵀ (K_p e_a - K_d L v_c), the law's wrench on the camera, as a function of (sense, gains)."""
    Image, Sense, interaction = code.Image, code.Sense, code.interaction
    rows, tanh = 2 * code.points, code.tanh

    @wp.func
    def wrench_of(sense: Sense, gains: Gains):
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        target_rate = L * sense.target_twist
        camera_rate = L * sense.camera_twist
        e_dot = gains.feed_forward * target_rate - camera_rate
        sliding = Image()
        for i in range(rows):
            sliding[i] = tanh(e[i] / gains.sigma)
        e_a = gains.Cd * e_dot + gains.Cp * e + gains.Cs * sliding
        damped = camera_rate - gains.on_feature_rate * target_rate
        return wp.transpose(L) * (gains.Kp * e_a - gains.Kd * damped)

    return wrench_of
