"""The paper's law, Eqs. (15) and (16), with gains made for the image of now: K_p, K_d, C_d of L.

With L Λ^(-1/2) = Σ s_i u_i v_iᵀ at the image of now, Λ the inertia that the camera feels, and
ω_i = ω s_i² / (s_i² + ε), they are in the directions seen

    K_p = c Σ ω_i²/s_i² u_i u_iᵀ,  K_d = k Σ ω_i²/(ω s_i)² u_i u_iᵀ,  C_d = 1/c Σ 2ζ/ω_i u_i u_iᵀ,

and C_p = 1: symmetric positive definite with anything positive in the 2n - 6 others, of which Lᵀ
makes nothing. c caps far errors, one factor for all directions, 1 near the target. The wrench on
the camera takes no singular values: with H = LᵀL + ε Λ, the displacement that the image tells,
ξ = H⁻¹ Lᵀ (e + C_s tanh(e/σ)), and the share of a motion that it shows, P = 1 - ε H⁻¹ Λ,

    Lᵀ (K_p e_a - K_d L v_c) = Λ P (c ω² ξ + 2ζω (v_t - v_c) - k P v_c).
"""

from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.kernels.laws.carried import carrying_control, carrying_gains
from continuair.kernels.laws.definite import definite_code
from continuair.kernels.laws.servoing import camera_control, choices, gains_of
from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Gains = gains_of(current_gains(code) | choices(code))
    return SimpleNamespace(
        Gains=Gains, control=camera_control(code, Gains, camera_wrench(code, Gains))
    )


def carrying_law(code: LawCode) -> SimpleNamespace:
    """The same on a vehicle whose arms are carried along."""
    Gains = gains_of(current_gains(code) | choices(code) | carrying_gains(code))
    return SimpleNamespace(
        Gains=Gains, control=carrying_control(code, Gains, camera_wrench(code, Gains))
    )


def current_gains(code: LawCode) -> dict[str, Any]:
    """What gains are made of, and its types: Λ, ω², 2ζω, k, C_s, ε and the caps of c."""
    names = ("stiffness", "damping", "rate_gain", "sliding", "floor", "farthest", "widest")
    inertia = definite_code(code).Matrix
    return {"inertia": inertia} | dict.fromkeys(names, code.Real)


def camera_wrench(code: LawCode, Gains: Any) -> Any:
    """The law's wrench on the camera, as a function of (sense, gains)."""
    Real, Twist, Sense, interaction = code.Real, code.Twist, code.Sense, code.interaction
    above, tanh, rows = code.above, code.tanh, 2 * code.points
    definite = definite_code(code)
    Matrix, factored, solved = definite.Matrix, definite.factored, definite.solved
    zero, one = Real(0.0), Real(1.0)

    @wp.func
    def share_within(x: Real, y: Real, z: Real, most: Real):
        """What brings a vector of three to a length at most."""
        size = wp.sqrt(x * x + y * y + z * z)
        return above(size, most, most / above(size, zero, size, one), one)

    @wp.func
    def shown(H: Matrix, gains: Gains, motion: Twist):
        """P motion."""
        return motion - gains.floor * solved(H, gains.inertia * motion)

    @wp.func
    def wrench_of(sense: Sense, gains: Gains):
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        for i in range(rows):
            e[i] = e[i] + gains.sliding * tanh(e[i] / gains.sigma)
        H = factored(wp.transpose(L) * L + gains.floor * gains.inertia)
        xi = solved(H, wp.transpose(L) * e)
        near = wp.min(
            share_within(xi[0], xi[1], xi[2], gains.farthest),
            share_within(xi[3], xi[4], xi[5], gains.widest),
        )
        behind = gains.feed_forward * sense.target_twist - sense.camera_twist
        damped = sense.camera_twist - gains.on_feature_rate * sense.target_twist
        wanted = near * gains.stiffness * xi + gains.damping * behind
        wanted -= gains.rate_gain * shown(H, gains, damped)
        return gains.inertia * shown(H, gains, wanted)

    return wrench_of
