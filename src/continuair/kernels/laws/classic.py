"""Classic image-based visual servoing, v = λ L⁺ e, with an inner loop on the camera's twist.

The inner loop is a wrench on the camera, Λ k (v - v_c), Λ the inertia that the camera feels with
the arm frozen straight; the arm keeps its spring, and the weight is carried.
"""

from types import SimpleNamespace

import warp as wp

from continuair.kernels.laws.definite import definite_code
from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Real, Sense, interaction = code.Real, code.Sense, code.interaction
    camera_push, definite = code.camera_push, definite_code(code)
    TwistGain, determined = definite.Matrix, definite.determined
    factored, solved = definite.factored, definite.solved

    @wp.struct
    class Gains:
        inertia: TwistGain
        rate: Real
        inner: Real
        feed_forward: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        H = factored(determined(wp.transpose(L) * L))
        v = gains.rate * solved(H, wp.transpose(L) * e)
        v += gains.feed_forward * sense.target_twist
        wrench = gains.inertia * (gains.inner * (v - sense.camera_twist))
        return sense.weight + camera_push(sense, wrench)

    return SimpleNamespace(Gains=Gains, control=control)
