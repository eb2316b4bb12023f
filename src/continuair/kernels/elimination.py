"""Device code that solves the rows of the dynamics (kernels/dynamics.py) for accelerations."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.chain import total_types
from continuair.kernels.arm.rigid import rigid_code


@dataclass(frozen=True)
class EliminationCode:
    """Rows and Accelerations, structs, and solutions.

    together: with the blocks between UAV and arms; apart: without them; bends_alone: of the bends.
    """

    Rows: Any
    Accelerations: Any
    together: Any
    apart: Any
    bends_alone: Any


@cache
def elimination_code(numbers: Numbers, tree: Tree) -> EliminationCode:
    """Return the functions for one kind of numbers and tree."""
    types, rigid = device_types(numbers, tree), rigid_code(numbers, tree)
    between, inverse_of = rigid.between, rigid.inverse_of
    Real, vec3, mat33, Bends = types.Real, types.vec3, types.mat33, types.Bends
    sums = total_types(numbers, tree)
    Total, Columns, Square = sums.Total, sums.Columns, sums.Square
    one, bends, last = Real(1.0), types.layout.bends, types.layout.bends - 1

    @wp.struct
    class Rows:
        """Right-hand sides: force [N] and moment about B's origin [N m], body axes, and bends."""

        force: vec3
        moment: vec3
        bend: Bends

    @wp.struct
    class Accelerations:
        """Accelerations: a' in body axes, ω̇ and b̈."""

        base: vec3
        spin: vec3
        bend: Bends

    @wp.func
    def column(m: Columns, j: int):
        return vec3(m[0, j], m[1, j], m[2, j])

    @wp.struct
    class Factors:
        """Factors of a symmetric matrix Uᵀ D U: inverse of D, and U without its unit diagonal."""

        U: Square
        inverse: Bends

    @wp.func
    def factored(M: Square):
        """Return the factors of M, from its upper triangle."""
        U = Square()
        inverse = Bends()
        for h in range(bends):
            for i in range(h):
                for j in range(i):
                    M[i, h] = M[i, h] - U[j, i] * M[j, h]
            for j in range(h):
                share = M[j, h] * inverse[j]
                U[j, h] = share
                M[h, h] = M[h, h] - share * M[j, h]
            inverse[h] = one / M[h, h]
        out = Factors()
        out.U = U
        out.inverse = inverse
        return out

    @wp.func
    def forward(f: Factors, r: Bends):
        """Return U⁻ᵀ r."""
        U = f.U
        for i in range(bends):
            for j in range(i):
                r[i] = r[i] - U[j, i] * r[j]
        return r

    @wp.func
    def backward(f: Factors, r: Bends):
        """Return (D U)⁻¹ r."""
        U = f.U
        inverse = f.inverse
        for i in range(bends):
            r[i] = inverse[i] * r[i]
        for i in range(last, 0, -1):
            for j in range(i):
                r[j] = r[j] - U[j, i] * r[i]
        return r

    @wp.func
    def bends_alone(total: Total, rows: Rows):
        """Return b̈ of arms on a base at rest."""
        f = factored(total.M)
        return backward(f, forward(f, rows.bend))

    @wp.func
    def apart(mass: Real, inertia: mat33, total: Total, rows: Rows):
        """Solve for the vehicle with frozen arms, and for the arms, separately."""
        c = total.H / mass
        out = Accelerations()
        reduced = inertia - between(c, vec3(), mass, mat33())
        out.spin = inverse_of(reduced) * (rows.moment - wp.cross(c, rows.force))
        out.bend = bends_alone(total, rows)
        out.base = (rows.force - wp.cross(out.spin, total.H)) / mass
        return out

    @wp.func
    def about_common_centre(mass: Real, c: vec3, total: Total):
        """Return M and L with translation eliminated; c: the common centre of mass."""
        F = total.F
        L = total.L
        M = total.M
        for j in range(bends):
            on = column(F, j)
            about = wp.cross(c, on)
            for k in range(3):
                L[k, j] = L[k, j] - about[k]
            for i in range(j):
                M[i, j] = M[i, j] - wp.dot(column(F, i), on) / mass
            M[j, j] = M[j, j] - wp.dot(on, on) / mass
        total.L = L
        total.M = M
        return total

    @wp.func
    def together(mass: Real, inertia: mat33, total: Total, rows: Rows):
        """Solve all rows; inertia: of UAV and arms about B's origin."""
        c = total.H / mass
        about = about_common_centre(mass, c, total)
        f = factored(about.M)
        L = about.L
        U = f.U
        inverse = f.inverse
        F = total.F
        for i in range(bends):
            for j in range(i):
                for k in range(3):
                    L[k, i] = L[k, i] - U[j, i] * L[k, j]
        r = forward(f, rows.bend)
        schur = inertia - between(c, vec3(), mass, mat33())
        moment = rows.moment - wp.cross(c, rows.force)
        for j in range(bends):
            turn = column(L, j)
            scaled = inverse[j] * turn
            schur -= wp.outer(scaled, turn)
            moment -= r[j] * scaled
        out = Accelerations()
        out.spin = inverse_of(schur) * moment
        spin = out.spin
        for j in range(bends):
            r[j] = r[j] - wp.dot(column(L, j), spin)
        bent = backward(f, r)
        out.bend = bent
        moved = wp.cross(out.spin, total.H)
        for j in range(bends):
            moved += bent[j] * column(F, j)
        out.base = (rows.force - moved) / mass
        return out

    return holding(EliminationCode, locals())
