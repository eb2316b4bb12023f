"""Device code of rigid bodies: the equivalent body beyond a joint, and the body on a tip."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding
from continuair.sections.kind import carried_type


@dataclass(frozen=True)
class RigidCode:
    """Rigid, a struct, and its transformations.

    body_on_tip: the body of an arm. inverse_of: inverse of an inertia.
    """

    Rigid: Any
    between: Any
    congruent: Any
    turned_by: Any
    inverse_of: Any
    matrix_of: Any
    body_on_tip: Any


@cache
def rigid_code(numbers: Numbers, tree: Tree) -> RigidCode:
    """Return the functions for one kind of numbers and tree."""
    types, Carried = device_types(numbers, tree), carried_type(numbers, tree)
    Real, vec3, mat33, Plant = types.Real, types.vec3, types.mat33, types.Plant
    Matrices = types.Matrices
    half, one, two = Real(0.5), Real(1.0), Real(2.0)

    @wp.struct
    class Rigid:
        """First moment, inertia, bias wrench, and the bias of turning, if it is separate."""

        H: vec3
        I: mat33
        force: vec3
        moment: vec3
        turning_force: vec3
        turning_moment: vec3

    @wp.func
    def between(p: vec3, H: vec3, m: Real, I: mat33):
        """Return the inertia about a base of a body with mass m, and H and I about point p."""
        h = two * H + m * p
        d = wp.dot(p, h)
        xy = -half * (p[0] * h[1] + p[1] * h[0])
        xz = -half * (p[0] * h[2] + p[2] * h[0])
        yz = -half * (p[1] * h[2] + p[2] * h[1])
        return I + mat33(d - p[0] * h[0], xy, xz, xy, d - p[1] * h[1], yz, xz, yz, d - p[2] * h[2])

    @wp.func
    def congruent(R: mat33, I: mat33):
        """Return R I Rᵀ of a symmetric I."""
        T = R * I
        xx = T[0, 0] * R[0, 0] + T[0, 1] * R[0, 1] + T[0, 2] * R[0, 2]
        xy = T[0, 0] * R[1, 0] + T[0, 1] * R[1, 1] + T[0, 2] * R[1, 2]
        xz = T[0, 0] * R[2, 0] + T[0, 1] * R[2, 1] + T[0, 2] * R[2, 2]
        yy = T[1, 0] * R[1, 0] + T[1, 1] * R[1, 1] + T[1, 2] * R[1, 2]
        yz = T[1, 0] * R[2, 0] + T[1, 1] * R[2, 1] + T[1, 2] * R[2, 2]
        zz = T[2, 0] * R[2, 0] + T[2, 1] * R[2, 1] + T[2, 2] * R[2, 2]
        return mat33(xx, xy, xz, xy, yy, yz, xz, yz, zz)

    @wp.func
    def inverse_of(m: mat33):
        """Return the inverse of a symmetric matrix."""
        a = m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2]
        b = m[0, 0] * m[2, 2] - m[0, 2] * m[0, 2]
        c = m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]
        d = m[0, 2] * m[1, 2] - m[0, 1] * m[2, 2]
        e = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
        f = m[0, 1] * m[0, 2] - m[0, 0] * m[1, 2]
        scale = one / (m[0, 0] * a + m[0, 1] * d + m[0, 2] * e)
        return scale * mat33(a, d, e, d, b, f, e, f, c)

    @wp.func
    def turned_by(R: mat33, body: Rigid):
        """Return a body in axes rotated by R."""
        out = Rigid()
        out.H = R * body.H
        out.I = congruent(R, body.I)
        out.force = R * body.force
        out.moment = R * body.moment
        out.turning_force = R * body.turning_force
        out.turning_moment = R * body.turning_moment
        return out

    @wp.func
    def matrix_of(rows: Matrices, arm: int):
        """Return the matrix of one arm."""
        return mat33(
            rows[arm, 0], rows[arm, 1], rows[arm, 2], rows[arm, 3], rows[arm, 4], rows[arm, 5],
            rows[arm, 6], rows[arm, 7], rows[arm, 8],
        )  # fmt: skip

    @wp.func
    def force_of_turning(H: vec3, w: vec3, v: vec3):
        """Return the symmetric form of ω×(ω×H)."""
        return half * (wp.cross(w, wp.cross(v, H)) + wp.cross(v, wp.cross(w, H)))

    @wp.func
    def moment_of_turning(I: mat33, w: vec3, v: vec3):
        """Return the symmetric form of ω×(I ω)."""
        return half * (wp.cross(w, I * v) + wp.cross(v, I * w))

    @wp.func
    def body_on_tip(
        plant: Plant, arm: int, w: vec3, v: vec3, rest: vec3, turning: Carried, bending: Carried
    ):
        """Return the body on a tip; w: its angular velocity; v, rest: parts in the two biases."""
        out = Rigid()
        m = plant.body_mass[arm]
        b = plant.body_moment
        H = vec3(b[arm, 0], b[arm, 1], b[arm, 2])
        I = matrix_of(plant.body_inertia, arm)
        out.H = H
        out.I = I
        out.force = m * bending.base + wp.cross(bending.spin, H) + force_of_turning(H, w, rest)
        out.moment = wp.cross(H, bending.base) + I * bending.spin + moment_of_turning(I, w, rest)
        out.turning_force = m * turning.base + wp.cross(turning.spin, H)
        out.turning_force += force_of_turning(H, w, v)
        out.turning_moment = wp.cross(H, turning.base) + I * turning.spin
        out.turning_moment += moment_of_turning(I, w, v)
        return out

    return holding(RigidCode, locals())
