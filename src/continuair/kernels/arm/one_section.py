"""Device code of one bending section: its moments, inertia, momentum and tip at a given bend.

Lengths along the arc are in units of λ (engine/moments.py). The derivation of every term is in
docs/numerics.md, and letters are those used there: c first moment, I inertia and J the coupling of
bending and rotation about the common centre of mass, N the inertia of bending, hb the angular
momentum of bending. Warp reads annotations as types, so they are not postponed here.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.kernels.types import MOMENTS, device_types, holding

MAX_BEND_ANGLE = 2.0 * np.pi
"""Largest |k| l [rad] for which the polynomials hold; beyond it a run ends with a status."""


@dataclass(frozen=True)
class Section:
    """Structs and functions of a section; each is defined, and said what it is, below."""

    full: Any
    Shape: Any
    Tip: Any
    shape: Any
    tip_of: Any
    tip_attitude: Any
    moment_of_arm: Any
    coupling_of: Any
    bend_force: Any
    wrench_on_bend: Any
    inertia_of: Any
    own_bending: Any
    solve_bending: Any
    solve_symmetric: Any
    exchange_on_rotation: Any
    momentum_of_bending: Any
    centrifugal: Any


@cache
def section_code(precision: str, sections: int) -> Section:
    """The functions for one precision, "float64" or "float32", and one section."""
    types = device_types(precision, sections)
    Real, Row, Plant = types.Real, types.Row, types.Plant
    vec2, vec3, vec4 = types.vec2, types.vec3, types.vec4
    mat33, quat = types.mat33, types.quat
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)
    alpha, beta, P, Q, S, KP, KQ, KW, NP, ND = range(len(MOMENTS))
    quarter, full = Real(0.25), Real(MAX_BEND_ANGLE / np.sqrt(2.0))

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
    def shape(coefficients: wp.array2d(dtype=Row), i: int, u: Real):
        w = u - Real(1.0)
        out = Shape()
        f = Row()
        d = Row()
        sa = Real(0.0)
        sb = Real(0.0)
        for j in range(coefficients.shape[1]):
            sa = sa * w + d[alpha]
            sb = sb * w + d[beta]
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
        return vec3(s.f[alpha] * b[0], s.f[alpha] * b[1], -s.f[beta])

    @wp.struct
    class Coupling:
        """Columns of J_c, of the first moment, and of J, of rotation and bending, per bend."""

        base_x: vec3
        base_y: vec3
        spin_x: vec3
        spin_y: vec3

    @wp.func
    def coupling_of(s: Shape, e: vec3, b: vec2):
        """e: lever of the mount, horizontal part."""
        g00 = s.f[KQ] + two * s.f[KW] * b[0] * b[0]
        g01 = two * s.f[KW] * b[0] * b[1]
        g11 = s.f[KQ] + two * s.f[KW] * b[1] * b[1]
        ca = two * s.d[alpha]
        cb = -two * s.d[beta]
        out = Coupling()
        out.base_x = vec3(s.f[alpha] + ca * b[0] * b[0], ca * b[0] * b[1], cb * b[0])
        out.base_y = vec3(ca * b[0] * b[1], s.f[alpha] + ca * b[1] * b[1], cb * b[1])
        out.spin_x = vec3(g01, -g00, -s.f[KP] * b[1]) + wp.cross(e, out.base_x)
        out.spin_y = vec3(g11, -g01, s.f[KP] * b[0]) + wp.cross(e, out.base_y)
        return out

    @wp.func
    def along_bend(a: Real, d_a: Real, d_beta: Real, b: vec2, force: vec3):
        """Jᵀ force of a point at (a b, -β), whose derivatives in u are d_a and d_beta."""
        h = vec2(force[0], force[1])
        return a * h + two * (d_a * wp.dot(b, h) - d_beta * force[2]) * b

    @wp.func
    def bend_force(s: Shape, b: vec2, field: vec3):
        """J_cᵀ field: a force on every mass of the arm, per mass, as a force on the bend."""
        return along_bend(s.f[alpha], s.d[alpha], s.d[beta], b, field)

    @wp.func
    def wrench_on_bend(tip: Tip, unit: Real, b: vec2, force: vec3, moment: vec3):
        """Jᵀ (force, moment): a wrench on the tip, in body axes, as a force on the bend."""
        twist = tip.A * moment[2] - tip.Gamma * (b[0] * moment[0] + b[1] * moment[1])
        bend = unit * along_bend(tip.A, tip.dA, tip.dB, b, force)
        return bend + full * vec2(-moment[1], moment[0]) + twist * vec2(-b[1], b[0])

    @wp.func
    def inertia_of(s: Shape, plant: Plant, b: vec2):
        """Inertia about the common centre of mass with the arm frozen; d = u P + S + axial."""
        h = moment_of_arm(s, b)
        e = plant.lever
        eh = e[0] * h[0] + e[1] * h[1]
        d = wp.dot(b, b) * s.f[P] + s.f[S] + two * eh
        xy = -s.f[P] * b[0] * b[1] - e[0] * h[1] - e[1] * h[0]
        xz = s.f[Q] * b[0] - e[0] * h[2]
        yz = s.f[Q] * b[1] - e[1] * h[2]
        return plant.inertia + mat33(
            d - s.f[P] * b[0] * b[0] - two * e[0] * h[0],
            xy,
            xz,
            xy,
            d - s.f[P] * b[1] * b[1] - two * e[1] * h[1],
            yz,
            xz,
            yz,
            d - s.f[S],
        )

    @wp.func
    def own_bending(s: Shape, b: vec2, db: vec2, du: Real, ddu: Real):
        """Ṅ ḃ - ½ ∂(ḃᵀ N ḃ)/∂b."""
        along = quarter * s.d[ND] * du * du + half * (s.f[ND] - s.d[NP]) * ddu
        return s.d[NP] * du * db + along * b

    @wp.func
    def solve_bending(s: Shape, b: vec2, u: Real, rhs: vec2):
        """N⁻¹ rhs with N = NP 1 + ND b bᵀ."""
        along = s.f[ND] * wp.dot(b, rhs) / (s.f[NP] + u * s.f[ND])
        return (rhs - along * b) / s.f[NP]

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
        u = wp.dot(b, b)
        bw = b[0] * w[0] + b[1] * w[1]
        dbw = db[0] * w[0] + db[1] * w[1]
        on_w = du * (s.f[P] + u * s.d[P] + s.d[S]) + two * wp.dot(e, hd)
        on_b = du * (s.d[Q] * w[2] - s.d[P] * bw) - s.f[P] * dbw
        on_db = s.f[Q] * w[2] - s.f[P] * bw
        on_z = du * (s.d[Q] * bw - s.d[S] * w[2]) + s.f[Q] * dbw
        return (
            on_w * w
            + vec3(on_b * b[0] + on_db * db[0], on_b * b[1] + on_db * db[1], on_z)
            - wp.dot(hd, w) * e
            - wp.dot(e, w) * hd
        )

    @wp.func
    def momentum_of_bending(s: Shape, e: vec3, b: vec2, db: vec2, hd: vec3, du: Real):
        """hb: angular momentum of bending about the common centre of mass."""
        x = s.f[KQ] * db[0] + s.f[KW] * du * b[0]
        y = s.f[KQ] * db[1] + s.f[KW] * du * b[1]
        return vec3(y, -x, s.f[KP] * (b[0] * db[1] - b[1] * db[0])) + wp.cross(e, hd)

    @wp.func
    def centrifugal(s: Shape, e: vec3, b: vec2, u: Real, w: vec3):
        """-½ ∂(ωᵀ I ω)/∂b."""
        bw = b[0] * w[0] + b[1] * w[1]
        wz = w[2]
        d_slope = s.f[P] + u * s.d[P] + s.d[S]
        along = (
            d_slope * wp.dot(w, w) - s.d[P] * bw * bw + two * s.d[Q] * bw * wz - s.d[S] * wz * wz
        )
        across = s.f[P] * bw - s.f[Q] * wz
        spin = wp.cross(w, wp.cross(w, e))
        return across * vec2(w[0], w[1]) - along * b + bend_force(s, b, spin)

    return holding(Section, locals())
