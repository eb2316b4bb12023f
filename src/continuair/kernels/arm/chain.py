"""Device code of arms with sections of any kind: composite inertias, from the tips to the body.

The outer sections act on a section as one rigid body at its tip, with the columns of their own
coordinates. The function of a section computes velocities and biases outwards, calls that of the
next section, and then computes inertias and wrenches inwards. Quantities refer to a section's base,
in its axes; at the body, to B's origin in body axes. Kinds of bias:

"full", all terms quadratic in the rates; "block", B(z, (ω, 0)) in the rows of the UAV and
B(z, (0, q̇)) in those of the arms, see sections/kind.py; "alone", of arms on a base at rest.
"""

from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding, room
from continuair.kernels.arm.joint import joint_code
from continuair.kernels.arm.rigid import rigid_code
from continuair.sections.kind import carried_type, section_types


@dataclass(frozen=True)
class TotalTypes:
    """Total, a struct, and its matrices: Columns (3, bends) and Square (bends, bends)."""

    Total: Any
    Columns: Any
    Square: Any


@cache
def total_types(numbers: Numbers, tree: Tree) -> TotalTypes:
    """Return the types for one kind of numbers and tree."""
    types = device_types(numbers, tree)
    Real, vec3, mat33, Bends = types.Real, types.vec3, types.mat33, types.Bends
    width = types.layout.bends
    Columns = wp.types.matrix((3, room(width)), Real)
    Square = wp.types.matrix((room(width), room(width)), Real)

    @wp.struct
    class Total:
        """Sums over all arms about B: first moment H, inertia I, bias force and moment; of the
        bends, columns F and L of force and moment on the body, inertia M and bias."""

        H: vec3
        I: mat33
        force: vec3
        moment: vec3
        F: Columns
        L: Columns
        M: Square
        bend: Bends

    return holding(TotalTypes, locals())


@dataclass(frozen=True)
class ChainCode:
    """Total, a struct, and total_of(y, table, plant, vehicle), the sum over all arms.

    of_arm(arm) returns the same function for one arm.
    """

    Total: Any
    total_of: Any
    of_arm: Any


@cache
def chain_code(numbers: Numbers, tree: Tree, bias: str) -> ChainCode:
    """Return the sum over all arms for one kind of numbers, tree and kind of bias."""
    types, rigid = device_types(numbers, tree), rigid_code(numbers, tree)
    State, Plant, Table = types.State, types.Plant, types.Table
    vec3, spin_of, mount_of = types.vec3, types.spin_of, types.mount_of
    matrix_of, Carried = rigid.matrix_of, carried_type(numbers, tree)
    between, turned_by = rigid.between, rigid.turned_by
    Total = total_types(numbers, tree).Total
    turned, block, alone = tree.turned, bias == "block", bias == "alone"

    def adding(arm: int) -> Any:
        """Return the function that adds an arm to the others."""
        visit = _section(numbers, tree, bias, arm, 0).visit
        own = types.layout.of_arm[arm]
        first, count = own.start, own.stop - own.start

        @wp.func
        def add(total: Total, y: State, table: Table, plant: Plant, vehicle: int):
            p = mount_of(plant, arm)
            T = matrix_of(plant.turn, arm)
            w = spin_of(y)
            if wp.static(alone):
                w = vec3()
            carried = Carried()
            carried.base = wp.cross(w, wp.cross(w, p))
            if wp.static(turned):
                w = wp.transpose(T) * w
                carried.base = wp.transpose(T) * carried.base
            if wp.static(block):
                c = visit(y, table, plant, vehicle, w, w, carried, Carried())
            else:
                c = visit(y, table, plant, vehicle, w, w, Carried(), carried)
            body = c.body
            F = c.F
            L = c.L
            M = c.M
            bend = c.bend
            if wp.static(turned):
                body = turned_by(T, body)
                F = T * F
                L = T * L
            f = body.force
            n = body.moment
            if wp.static(block):
                f = body.turning_force
                n = body.turning_moment
            total.I += between(p, body.H, plant.arm_mass[arm], body.I)
            total.H += body.H + plant.arm_mass[arm] * p
            total.force += f
            total.moment += n + wp.cross(p, f)
            for j in range(count):
                on = vec3(F[0, j], F[1, j], F[2, j])
                about = vec3(L[0, j], L[1, j], L[2, j]) + wp.cross(p, on)
                for r in range(3):
                    total.F[r, first + j] = on[r]
                    total.L[r, first + j] = about[r]
                total.bend[first + j] = bend[j]
                for r in range(count):
                    total.M[first + r, first + j] = M[r, j]
            return total

        return add

    @wp.func
    def none(y: State, table: Table, plant: Plant, vehicle: int):
        return Total()

    def plus_arm(before: Any, arm: int) -> Any:
        """Return the function that adds an arm to the result of another function."""
        add = adding(arm)

        @wp.func
        def summed(y: State, table: Table, plant: Plant, vehicle: int):
            return add(before(y, table, plant, vehicle), y, table, plant, vehicle)

        return summed

    @cache
    def of_arm(arm: int) -> Any:
        return plus_arm(none, arm)

    total_of = none
    for arm in range(len(tree.sections)):
        total_of = plus_arm(total_of, arm)
    return holding(ChainCode, locals())


def _section(numbers: Numbers, tree: Tree, bias: str, arm: int, index: int) -> SimpleNamespace:
    """Return the function visit(y, table, plant, vehicle, w, v, turning, bending) of a section.

    It covers the section and all sections beyond it. w: angular velocity of its base; v: its part
    from the body, not from bends. turning and bending: bias accelerations of the base, by parts of
    the bias; all in bending unless the bias is "block". It returns a struct: body, the equivalent
    Rigid on the base, and F, L, M and bias of the coordinates, as in Total.
    """
    at, beyond = tree.first[arm] + index, tree.sections[arm] - index - 1
    kind = tree.kind_of(at)
    n, code = kind.coordinates, kind.device(numbers, tree, at)
    types, own_types = device_types(numbers, tree), section_types(numbers, tree, n)
    joints, rigid = joint_code(numbers, tree, n), rigid_code(numbers, tree)
    Real, State, Plant, Table, vec3 = types.Real, types.State, types.Plant, types.Table, types.vec3
    Carried, Joint, Rigid, Bias = own_types.Carried, own_types.Joint, rigid.Rigid, own_types.Bias
    Element, Motion, Shape, column = own_types.Element, code.Motion, code.Shape, own_types.column
    shape, motion, element = code.shape, code.motion, code.element
    full_bias, turning_bias, bending_bias = code.full_bias, code.turning_bias, code.bending_bias
    first_bending, own_bending = code.first_bending, code.own_bending
    joint, carried_alone = code.joint, code.carried
    full_carried, turning_carried = joints.full_carried, joints.turning_carried
    bending_carried, carried_on = joints.bending_carried, joints.carried_on
    turned_by, between, body_on_tip = rigid.turned_by, rigid.between, rigid.body_on_tip
    first, block, alone = index == 0, bias == "block", bias == "alone"
    inner = _section(numbers, tree, bias, arm, index + 1) if beyond else None
    others = inner.own if inner else 0
    own = n + others
    loaded = beyond > 0 or tree.bodies
    Columns, Square = wp.types.matrix((3, own), Real), wp.types.matrix((own, own), Real)
    Own = wp.types.vector(own, Real)
    Loads = own_types.Columns

    @wp.struct
    class Chain:
        body: Rigid
        F: Columns
        L: Columns
        M: Square
        bend: Own

    @wp.struct
    class Biases:
        turning: Bias
        bending: Bias

    @wp.func
    def carried_by_base(e: Element, mass: Real, b: Bias, carried: Carried):
        """Return a bias with the bias accelerations of the base, linear only at the mount."""
        F = e.F
        L = e.L
        coordinates = b.coordinates
        base = carried.base
        b.force += mass * base
        b.moment += wp.cross(e.H, base)
        for k in range(n):
            coordinates[k] = coordinates[k] + wp.dot(column(F, k), base)
        if wp.static(not first):
            b.force += wp.cross(carried.spin, e.H)
            b.moment += e.I * carried.spin
            spin = carried.spin
            for k in range(n):
                coordinates[k] = coordinates[k] + wp.dot(column(L, k), spin)
        b.coordinates = coordinates
        return b

    @wp.func
    def biases(
        s: Shape, e: Element, m: Motion, mass: Real, w: vec3, v: vec3, turning: Carried,
        bending: Carried,
    ):  # fmt: skip
        out = Biases()
        if wp.static(block):
            out.turning = carried_by_base(e, mass, turning_bias(s, e, m, w, v), turning)
            if wp.static(first):
                out.bending = first_bending(s, e, m, w)
            else:
                out.bending = bending_bias(s, e, m, w, w - v)
                out.bending = carried_by_base(e, mass, out.bending, bending)
        elif wp.static(alone and first):
            out.bending.coordinates = own_bending(s, m)
        else:
            out.bending = carried_by_base(e, mass, full_bias(s, e, m, w), bending)
        return out

    @wp.func
    def bent(
        plant: Plant, s: Shape, e: Element, m: Motion, w: vec3, v: vec3, turning: Carried,
        bending: Carried,
    ):  # fmt: skip
        """Return the Chain of the section alone."""
        out = Chain()
        b = biases(s, e, m, plant.section_mass[at], w, v, turning, bending)
        out.body.H = e.H
        out.body.I = e.I
        out.body.force = b.bending.force
        out.body.moment = b.bending.moment
        out.body.turning_force = b.turning.force
        out.body.turning_moment = b.turning.moment
        own_F = e.F
        own_L = e.L
        N = e.N
        coordinates = b.bending.coordinates
        for k in range(n):
            for r in range(3):
                out.F[r, k] = own_F[r, k]
                out.L[r, k] = own_L[r, k]
            for r in range(n):
                out.M[r, k] = N[r, k]
            out.bend[k] = coordinates[k]
        return out

    @wp.func
    def with_body(out: Chain, j: Joint, m: Real, body: Rigid):
        """Add a rigid body of mass m at the tip, in the section's axes."""
        H, I, f, about_tip = body.H, body.I, body.force, body.moment
        P = j.P
        W = j.W
        F = out.F
        L = out.L
        M = out.M
        bend = out.bend
        on = Loads()
        about = Loads()
        for k in range(n):
            p = column(P, k)
            w = column(W, k)
            u = m * p + wp.cross(w, H)
            v = wp.cross(H, p) + I * w
            for r in range(3):
                on[r, k] = u[r]
                about[r, k] = v[r]
        out.body.I += between(j.p, H, m, I)
        out.body.H += H + m * j.p
        out.body.force += f
        out.body.moment += about_tip + wp.cross(j.p, f)
        out.body.turning_force += body.turning_force
        out.body.turning_moment += body.turning_moment + wp.cross(j.p, body.turning_force)
        for k in range(n):
            p = column(P, k)
            w = column(W, k)
            u = column(on, k)
            v = column(about, k)
            M[k, k] = M[k, k] + (wp.dot(p, u) + wp.dot(w, v))
            for i in range(k):
                # Symmetric: from a column and the body's reaction to another.
                shared = wp.dot(column(P, i), u) + wp.dot(column(W, i), v)
                M[i, k] = M[i, k] + shared
                M[k, i] = M[k, i] + shared
            bend[k] = bend[k] + (wp.dot(p, f) + wp.dot(w, about_tip))
            lever = v + wp.cross(j.p, u)
            for r in range(3):
                F[r, k] = F[r, k] + u[r]
                L[r, k] = L[r, k] + lever[r]
        out.F = F
        out.L = L
        out.M = M
        out.bend = bend
        return out

    InnerChain = inner.Chain if inner else Chain
    visit_inner = inner.visit if inner else None

    @wp.func
    def brought(out: Chain, j: Joint, c: InnerChain):
        """Add the columns of the coordinates beyond the joint."""
        inner_F = j.R * c.F
        inner_L = j.R * c.L
        inner_M = c.M
        inner_bend = c.bend
        P = j.P
        W = j.W
        F = out.F
        L = out.L
        M = out.M
        bend = out.bend
        for k in range(others):
            on = vec3(inner_F[0, k], inner_F[1, k], inner_F[2, k])
            about = vec3(inner_L[0, k], inner_L[1, k], inner_L[2, k])
            for i in range(n):
                shared = wp.dot(column(P, i), on) + wp.dot(column(W, i), about)
                M[i, k + n] = shared
                M[k + n, i] = shared
            about += wp.cross(j.p, on)
            for r in range(3):
                F[r, k + n] = on[r]
                L[r, k + n] = about[r]
            bend[k + n] = inner_bend[k]
            for r in range(others):
                M[r + n, k + n] = inner_M[r, k]
        out.F = F
        out.L = L
        out.M = M
        out.bend = bend
        return out

    @wp.func
    def visit(
        y: State, table: Table, plant: Plant, vehicle: int, w: vec3, v: vec3,
        turning: Carried, bending: Carried,
    ):  # fmt: skip
        seen = w
        if wp.static(block):
            seen = vec3()
        if wp.static(block and not first):
            seen = w - v
        s = shape(y, table, vehicle, w, seen)
        m = motion(y, s)
        e = element(plant, s, m)
        out = bent(plant, s, e, m, w, v, turning, bending)
        if wp.static(loaded):
            j = joint(plant, s, m)
            back = wp.transpose(j.R)
            tip_w = back * (w + j.turned)
            tip_v = back * v
            on_tip = Carried()
            if wp.static(block):
                on_tip = carried_on(turning, turning_carried(j, w, v), j)
                by_rates = bending_carried(carried_alone(plant, s, m), j, w, w - v)
            else:
                by_rates = full_carried(carried_alone(plant, s, m), j, w)
            rest = carried_on(bending, by_rates, j)
            if wp.static(beyond == 0):
                of_bends = tip_w
                if wp.static(block):
                    of_bends = tip_w - tip_v
                body = body_on_tip(plant, arm, tip_w, tip_v, of_bends, on_tip, rest)
                out = with_body(out, j, plant.beyond[at], turned_by(j.R, body))
            else:
                c = visit_inner(y, table, plant, vehicle, tip_w, tip_v, on_tip, rest)
                out = with_body(out, j, plant.beyond[at], turned_by(j.R, c.body))
                out = brought(out, j, c)
        return out

    return SimpleNamespace(visit=visit, Chain=Chain, own=own)
