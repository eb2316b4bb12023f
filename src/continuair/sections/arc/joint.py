"""Device code of an arc's tip as a joint: position, rotation and motion relative to the base.

The rows are those of sections/kind.py, with J_p for P and J_w for W. From A and Γ at the tip, with
u = |b|²: B = σ - uΓ and C = 1 - uA.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import FULL_LENGTH, Tree, device_types
from continuair.sections.arc.element import element_code
from continuair.sections.arc.moments import MOMENTS
from continuair.sections.kind import section_types
from continuair.vehicle.arc import COORDINATES


@dataclass(frozen=True)
class JointCode:
    """Functions of an arc's tip, defined below."""

    joint: Any
    carried: Any


@cache
def joint_code(numbers: Numbers, tree: Tree) -> JointCode:
    """Return the functions for one kind of numbers and the types of a tree."""
    types, code = device_types(numbers, tree), element_code(numbers, tree)
    own = section_types(numbers, tree, COORDINATES)
    Joint, Carried, Columns = own.Joint, own.Carried, own.Columns
    Real, vec3, mat33 = types.Real, types.vec3, types.mat33
    Shape, Motion = code.Shape, code.Motion
    A, Gamma = MOMENTS.index("A"), MOMENTS.index("Gamma")
    one, two, full = Real(1.0), Real(2.0), Real(FULL_LENGTH)

    @wp.func
    def joint(s: Shape, unit: Real, m: Motion):
        out = Joint()
        db = m.db
        x = m.b[0]
        y = m.b[1]
        u = m.u
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
        p0 = unit * vec3(a + ca * x * x, ca * x * y, cb * x)
        p1 = unit * vec3(ca * x * y, a + ca * y * y, cb * y)
        w0 = vec3(g * x * y, g * y * y - full, -a * y)
        w1 = vec3(full - g * x * x, -g * x * y, a * x)
        out.P = Columns(p0[0], p1[0], p0[1], p1[1], p0[2], p1[2])
        out.W = Columns(w0[0], w1[0], w0[1], w1[1], w0[2], w1[2])
        out.moved = db[0] * p0 + db[1] * p1
        out.turned = db[0] * w0 + db[1] * w1
        return out

    @wp.func
    def carried(s: Shape, unit: Real, m: Motion):
        """Return p̈ and the rate of J_w ḃ at b̈ = 0, in axes of the base."""
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

    return holding(JointCode, locals())
