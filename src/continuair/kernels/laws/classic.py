"""Classic image-based visual servoing, v = λ L⁺ e, with an inner loop on the camera's twist.

The inner loop is a wrench on the camera, Λ k (v - v_c), Λ the inertia that the camera feels with
the arm frozen straight; the arm keeps its spring, and the weight is carried.
"""

from types import SimpleNamespace

import warp as wp

from continuair.kernels.sensing.sense import LawCode


def law(code: LawCode) -> SimpleNamespace:
    """The law on the device."""
    Real, Twist, Sense, interaction = code.Real, code.Twist, code.Sense, code.interaction
    camera_push = code.camera_push
    TwistGain = wp.types.matrix((6, 6), Real)

    @wp.struct
    class Gains:
        inertia: TwistGain
        rate: Real
        inner: Real
        feed_forward: Real

    @wp.func
    def solve(A: TwistGain, b: Twist):
        """A⁻¹ b for a symmetric positive definite A, by LDLᵀ."""
        D = Twist()
        x = Twist()
        for j in range(6):
            d = A[j, j]
            for k in range(j):
                d -= A[j, k] * A[j, k] * D[k]
            D[j] = d
            for i in range(j + 1, 6):
                s = A[i, j]
                for k in range(j):
                    s -= A[i, k] * A[j, k] * D[k]
                A[i, j] = s / d
        for i in range(6):
            s = b[i]
            for k in range(i):
                s -= A[i, k] * x[k]
            x[i] = s
        for r in range(6):
            i = 5 - r
            s = x[i] / D[i]
            for k in range(i + 1, 6):
                s -= A[k, i] * x[k]
            x[i] = s
        return x

    @wp.func
    def control(sense: Sense, gains: Gains):
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        normal = wp.transpose(L) * L
        for i in range(6):
            # With too few points in view the motion that they do not determine stays at rest.
            normal[i, i] += Real(1e-9)
        v = gains.rate * solve(normal, wp.transpose(L) * e)
        v += gains.feed_forward * sense.target_twist
        wrench = gains.inertia * (gains.inner * (v - sense.camera_twist))
        return sense.weight + camera_push(sense, wrench)

    return SimpleNamespace(Gains=Gains, control=control)
