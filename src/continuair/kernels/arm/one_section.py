"""Device code of one bending section: its moments, inertia, momentum and tip at a given bend.

Lengths along the arc are in units of λ (arc.py). The derivation of every term is in
docs/numerics.md, and letters are those used there: c first moment, I inertia and J the coupling of
bending and rotation about the common centre of mass, N the inertia of bending, hb the angular
momentum of bending. Warp reads annotations as types, so they are not postponed here.
"""

from functools import cache
from types import SimpleNamespace

import numpy as np
import warp as wp

from continuair.vehicle.layout import Layout

MAX_BEND_ANGLE = 2.0 * np.pi
"""Largest |k| l [rad] for which the polynomials hold; beyond it a run ends with a status."""

NAMES = ("alpha", "beta", "P", "Q", "S", "KP", "KQ", "KW", "NP", "ND")
"""Moment functions, in the order in which the device code reads them."""


@cache
def section_code(precision: str, sections: int) -> SimpleNamespace:
    """Warp types and functions for one precision, "float64" or "float32", and one section.

    The state y holds, as `Layout` orders them, position, attitude, b, world velocity, ω and ḃ.
    """
    if sections != 1:
        raise NotImplementedError(f"kernels for {sections} sections")
    layout = Layout(sections)
    Real = getattr(wp, precision)
    vec2, vec3 = wp.types.vector(2, Real), wp.types.vector(3, Real)
    vec4, mat33 = wp.types.vector(4, Real), wp.types.matrix((3, 3), Real)
    quat = wp.types.quaternion(Real)
    Row, State = wp.types.vector(len(NAMES), Real), wp.types.vector(layout.state, Real)
    Push = wp.types.vector(layout.coordinates, Real)
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)
    quarter, full = Real(0.25), Real(MAX_BEND_ANGLE / np.sqrt(2.0))

    @wp.struct
    class Plant:
        mass: Real
        arm_mass: Real
        uav_mass: Real
        unit: Real
        stiffness: Real
        damping: Real
        threshold: Real
        mount: vec3
        lever: vec3
        inertia: mat33
        uav_inertia: mat33

    @wp.struct
    class Shape:
        """Moments and their derivatives in u = |b|² at the current bend."""

        f: Row
        d: Row
        dd_alpha: Real
        dd_beta: Real

    @wp.struct
    class Tip:
        """Tip relative to the arm's base: point [λ], and the functions A, A', B', Γ there."""

        point: vec3
        A: Real
        dA: Real
        dB: Real
        Gamma: Real

    @wp.func
    def attitude_of(y: State):
        return quat(y[3], y[4], y[5], y[6])

    @wp.func
    def shape(coefficients: wp.array2d(dtype=Row), i: int, u: Real):
        w = u - Real(1.0)
        out = Shape()
        f = Row()
        d = Row()
        sa = Real(0.0)
        sb = Real(0.0)
        for j in range(coefficients.shape[1]):
            sa = sa * w + d[0]
            sb = sb * w + d[1]
            d = d * w + f
            f = f * w + coefficients[i, j]
        out.f = f
        out.d = d
        out.dd_alpha = Real(2.0) * sa
        out.dd_beta = Real(2.0) * sb
        return out

    @wp.func
    def stumpff(z: Real):
        """c_1 … c_4 of z; c_0 is 1 - z c_2."""
        if z < Real(0.25):
            c3 = Real(0.0)
            c4 = Real(0.0)
            for i in range(7):
                n = Real(2.0) * Real(6 - i)
                # The compiler folds these quotients of constants; dividing would wait for each.
                c3 = (Real(1.0) - z * c3) * (Real(1.0) / ((n + Real(3.0)) * (n + Real(2.0))))
                c4 = (Real(1.0) - z * c4) * (Real(1.0) / ((n + Real(4.0)) * (n + Real(3.0))))
            c4 = c4 * Real(0.5)
            return vec4(Real(1.0) - z * c3, Real(0.5) - z * c4, c3, c4)
        x = wp.sqrt(z)
        sine = wp.sin(Real(0.5) * x)
        c1 = wp.sin(x) / x
        c2 = Real(2.0) * sine * sine / z
        return vec4(c1, c2, (Real(1.0) - c1) / z, (Real(0.5) - c2) / z)

    @wp.func
    def tip_of(b: vec2):
        out = Tip()
        c = stumpff(full * full * wp.dot(b, b))
        A = full * full * c[1]
        out.A = A
        out.dA = full * full * full * full * (c[3] - half * c[2])
        out.dB = half * full * full * full * (c[2] - c[1])
        out.Gamma = full * full * full * c[2]
        out.point = vec3(A * b[0], A * b[1], -full * c[0])
        return out

    @wp.func
    def tip_attitude(b: vec2):
        """Quaternion of Rz(ψa) Ry(-κ s) Rz(-ψa) diag(1, -1, -1), tip frame to body."""
        u = wp.dot(b, b)
        x = half * full * wp.sqrt(u)
        s = half * full
        if x > Real(1e-4):
            s = half * full * wp.sin(x) / x
        # The bending turns by -|b| s about (-b_y, b_x); diag(1, -1, -1) is half a turn about x.
        return quat(s * b[1], -s * b[0], zero, wp.cos(x)) * quat(one, zero, zero, zero)

    @wp.func
    def moment_of_arm(s: Shape, b: vec2):
        return vec3(s.f[0] * b[0], s.f[0] * b[1], -s.f[1])

    @wp.func
    def bend_force(alpha: Real, d_alpha: Real, d_beta: Real, b: vec2, force: vec3):
        """J_cᵀ force: a force on every mass of the arm, as a force on the bend."""
        h = vec2(force[0], force[1])
        return alpha * h + two * (d_alpha * wp.dot(b, h) - d_beta * force[2]) * b

    @wp.func
    def inertia_of(s: Shape, plant: Plant, b: vec2):
        """Inertia about the common centre of mass with the arm frozen; d = u P + S + axial."""
        P = s.f[2]
        Q = s.f[3]
        S = s.f[4]
        h = moment_of_arm(s, b)
        e = plant.lever
        eh = e[0] * h[0] + e[1] * h[1]
        d = wp.dot(b, b) * P + S + two * eh
        xy = -P * b[0] * b[1] - e[0] * h[1] - e[1] * h[0]
        xz = Q * b[0] - e[0] * h[2]
        yz = Q * b[1] - e[1] * h[2]
        return plant.inertia + mat33(
            d - P * b[0] * b[0] - two * e[0] * h[0],
            xy,
            xz,
            xy,
            d - P * b[1] * b[1] - two * e[1] * h[1],
            yz,
            xz,
            yz,
            d - S,
        )

    @wp.func
    def own_bending(s: Shape, b: vec2, db: vec2, du: Real, ddu: Real):
        """Ṅ ḃ - ½ ∂(ḃᵀ N ḃ)/∂b."""
        along = quarter * s.d[9] * du * du + half * (s.f[9] - s.d[8]) * ddu
        return s.d[8] * du * db + along * b

    @wp.func
    def solve_bending(s: Shape, b: vec2, u: Real, rhs: vec2):
        """N⁻¹ rhs with N = NP 1 + ND b bᵀ."""
        NP = s.f[8]
        ND = s.f[9]
        return (rhs - (ND * wp.dot(b, rhs) / (NP + u * ND)) * b) / NP

    @wp.func
    def solve_symmetric(m: mat33, r: vec3):
        """m⁻¹ r for a symmetric m."""
        a = m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2]
        d = m[0, 2] * m[1, 2] - m[0, 1] * m[2, 2]
        e = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
        scale = one / (m[0, 0] * a + m[0, 1] * d + m[0, 2] * e)
        b = m[0, 0] * m[2, 2] - m[0, 2] * m[0, 2]
        c = m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]
        f = m[0, 1] * m[0, 2] - m[0, 0] * m[1, 2]
        return scale * vec3(
            a * r[0] + d * r[1] + e * r[2],
            d * r[0] + b * r[1] + f * r[2],
            e * r[0] + f * r[1] + c * r[2],
        )

    @wp.func
    def exchange_on_rotation(s: Shape, e: vec3, b: vec2, db: vec2, w: vec3, hd: vec3, du: Real):
        """İ ω, the change of inertia as the arm bends."""
        P = s.f[2]
        Q = s.f[3]
        u = wp.dot(b, b)
        bw = b[0] * w[0] + b[1] * w[1]
        dbw = db[0] * w[0] + db[1] * w[1]
        on_w = du * (P + u * s.d[2] + s.d[4]) + two * wp.dot(e, hd)
        on_b = du * (s.d[3] * w[2] - s.d[2] * bw) - P * dbw
        on_db = Q * w[2] - P * bw
        on_z = du * (s.d[3] * bw - s.d[4] * w[2]) + Q * dbw
        return (
            on_w * w
            + vec3(on_b * b[0] + on_db * db[0], on_b * b[1] + on_db * db[1], on_z)
            - wp.dot(hd, w) * e
            - wp.dot(e, w) * hd
        )

    @wp.func
    def momentum_of_bending(s: Shape, e: vec3, b: vec2, db: vec2, hd: vec3, du: Real):
        """hb: angular momentum of bending about the common centre of mass."""
        x = s.f[6] * db[0] + s.f[7] * du * b[0]
        y = s.f[6] * db[1] + s.f[7] * du * b[1]
        return vec3(y, -x, s.f[5] * (b[0] * db[1] - b[1] * db[0])) + wp.cross(e, hd)

    @wp.func
    def centrifugal(s: Shape, e: vec3, b: vec2, u: Real, w: vec3):
        """-½ ∂(ωᵀ I ω)/∂b."""
        bw = b[0] * w[0] + b[1] * w[1]
        wz = w[2]
        d_slope = s.f[2] + u * s.d[2] + s.d[4]
        along = (
            d_slope * wp.dot(w, w) - s.d[2] * bw * bw + two * s.d[3] * bw * wz - s.d[4] * wz * wz
        )
        across = s.f[2] * bw - s.f[3] * wz
        spin = wp.cross(w, wp.cross(w, e))
        return across * vec2(w[0], w[1]) - along * b + bend_force(s.f[0], s.d[0], s.d[1], b, spin)

    return SimpleNamespace(**locals())
