"""Device code of a section's tip as a joint: its place, turn and motion, seen from the base.

The tip's axes are the section's own, carried along the backbone without twist. With a, ω and ω̇ of
the base, all in the section's axes,

    ω_t = ω + J_w ḃ        a_t = a + ω̇×p + J_p b̈ + g_a        ω̇_t = ω̇ + J_w b̈ + g_w

where the biases g_a and g_w are quadratic in z = (ω, ḃ), and taken apart as those of a section
(kernels/arm/element.py). From A and Γ at the tip, with u = |b|²: B = σ - uΓ and C = 1 - uA.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.element import element_code
from continuair.kernels.numbers import Numbers
from continuair.kernels.types import FULL_LENGTH, MOMENTS, Tree, device_types, holding


@dataclass(frozen=True)
class JointCode:
    """Structs and functions of a section's tip; each is defined, and said what it is, below."""

    Joint: Any
    Carried: Any
    joint: Any
    full_carried: Any
    turning_carried: Any
    bending_carried: Any
    carried_on: Any


@cache
def joint_code(numbers: Numbers, tree: Tree) -> JointCode:
    """The functions for one kind of numbers; the tree says what types they take."""
    types, code = device_types(numbers, tree), element_code(numbers, tree)
    Real, vec2, vec3, mat33 = types.Real, types.vec2, types.vec3, types.mat33
    Shape, Motion = code.Shape, code.Motion
    A, Gamma = MOMENTS.index("A"), MOMENTS.index("Gamma")
    half, one, two, full = Real(0.5), Real(1.0), Real(2.0), Real(FULL_LENGTH)

    @wp.struct
    class Joint:
        """The tip: its point p [m], R (tip axes to the section's), columns of J_p and J_w per bend,
        and how bending moves and turns it: ṗ and J_w ḃ."""

        p: vec3
        R: mat33
        p0: vec3
        p1: vec3
        w0: vec3
        w1: vec3
        moved: vec3
        turned: vec3

    @wp.struct
    class Carried:
        """Acceleration of a point, and of the turning there, that velocities alone cause."""

        base: vec3
        spin: vec3

    @wp.func
    def joint(s: Shape, unit: Real, b: vec2, db: vec2):
        out = Joint()
        x = b[0]
        y = b[1]
        u = wp.dot(b, b)
        a, g, da = s.f[A], s.f[Gamma], s.d[A]
        along = full - u * g
        d_along = -g - u * s.d[Gamma]
        out.p = unit * vec3(a * x, a * y, -along)
        out.R = mat33(
            one - a * x * x, -a * x * y, -along * x,
            -a * x * y, one - a * y * y, -along * y,
            along * x, along * y, one - u * a,
        )  # fmt: skip
        ca = two * da
        cb = -two * d_along
        out.p0 = unit * vec3(a + ca * x * x, ca * x * y, cb * x)
        out.p1 = unit * vec3(ca * x * y, a + ca * y * y, cb * y)
        out.w0 = vec3(g * x * y, g * y * y - full, -a * y)
        out.w1 = vec3(full - g * x * x, -g * x * y, a * x)
        out.moved = db[0] * out.p0 + db[1] * out.p1
        out.turned = db[0] * out.w0 + db[1] * out.w1
        return out

    @wp.func
    def bent_on(s: Shape, unit: Real, m: Motion):
        """p̈ and the rate of J_w ḃ at b̈ = 0, in the section's axes."""
        out = Carried()
        b, db = m.b, m.db
        ddu = two * wp.dot(db, db)
        d_along = -s.f[Gamma] - m.u * s.d[Gamma]
        dd_along = -two * s.d[Gamma] - m.u * s.dd_Gamma
        lift = two * s.d[A] * m.du
        on_b = s.d[A] * ddu + s.dd_A * m.du * m.du
        up = d_along * ddu + dd_along * m.du * m.du
        out.base = unit * vec3(lift * db[0] + on_b * b[0], lift * db[1] + on_b * b[1], -up)
        slope = s.d[Gamma] * m.du * m.c
        on_db = s.f[Gamma] * m.c
        out.spin = vec3(
            -slope * b[0] - on_db * db[0], -slope * b[1] - on_db * db[1], s.d[A] * m.du * m.c
        )
        return out

    @wp.func
    def full_carried(s: Shape, unit: Real, j: Joint, m: Motion, w: vec3):
        """g_a and g_w."""
        out = bent_on(s, unit, m)
        out.base += wp.cross(w, wp.cross(w, j.p) + two * j.moved)
        out.spin += wp.cross(w, j.turned)
        return out

    @wp.func
    def turning_carried(j: Joint, w: vec3, v: vec3):
        """Of the forms of z = (w, ḃ) and (v, 0)."""
        out = Carried()
        out.base = half * (wp.cross(w, wp.cross(v, j.p)) + wp.cross(v, wp.cross(w, j.p)))
        out.base += wp.cross(v, j.moved)
        out.spin = half * wp.cross(v, j.turned)
        return out

    @wp.func
    def bending_carried(s: Shape, unit: Real, j: Joint, m: Motion, w: vec3, v: vec3):
        """Of the forms of z = (w, ḃ) and (v, ḃ)."""
        out = bent_on(s, unit, m)
        out.base += half * (wp.cross(w, wp.cross(v, j.p)) + wp.cross(v, wp.cross(w, j.p)))
        out.base += wp.cross(w + v, j.moved)
        out.spin += half * wp.cross(w + v, j.turned)
        return out

    @wp.func
    def carried_on(on: Carried, by: Carried, j: Joint):
        """At the tip, in its axes: what the base carries there, and what the section adds."""
        out = Carried()
        back = wp.transpose(j.R)
        out.base = back * (on.base + wp.cross(on.spin, j.p) + by.base)
        out.spin = back * (on.spin + by.spin)
        return out

    return holding(JointCode, locals())
