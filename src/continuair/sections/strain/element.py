"""Device code of a section with a strain field as a body on its own base, and of its tip.

The axes R of the cross-sections at the nodes are known; all else are integrals along the arm of
values at the nodes, with the integration matrix A of the nodes (rows: to each node, and to the end),

    p = l A R ε,    W = A R ∂κ/∂q,    P = l A (W × R ε + R ∂ε/∂q),
    α = A (w × R κ̇),    a = l A (α × R ε + w × (w × R ε) + 2 w × R ε̇),

with w = W q̇, v = P q̇ and accelerations a and α of a section on a base at rest, at q̈ = 0. The
rows are those of sections/kind.py. Warp reads annotations as types, so they are not postponed here.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.types import Tree, device_types
from continuair.sections.kind import section_types
from continuair.sections.strain.field import field_code
from continuair.vehicle.strain import Orders

BODIES = ("place", "mass", "transverse", "axial", "length")
"""Rows of the table after the integration matrix: places of the nodes, from 0 to 1, masses [kg] and
inertias [kg m²] there, and the length of the section [m]."""


@dataclass(frozen=True)
class ElementCode:
    """Structs and functions of a section, defined below."""

    Shape: Any
    Motion: Any
    shape: Any
    motion: Any
    element: Any
    full_bias: Any
    turning_bias: Any
    bending_bias: Any
    first_bending: Any
    own_bending: Any
    joint: Any
    carried: Any


@cache
def element_code(
    numbers: Numbers, tree: Tree, orders: Orders, nodes: int, section: int
) -> ElementCode:
    """Return the functions for one kind of numbers and a section of a tree."""
    types, field = device_types(numbers, tree), field_code(numbers, tree, orders, nodes)
    n, turning = len(orders.coordinates), orders.turning
    own = section_types(numbers, tree, n)
    Element, Bias, Joint, Carried = own.Element, own.Bias, own.Joint, own.Carried
    Columns, Coordinates = own.Columns, own.Coordinates
    Real, Row, Table, State, Plant = types.Real, types.Row, types.Table, types.State, types.Plant
    vec3, mat33 = types.vec3, types.mat33
    row_of = number_code(numbers).row_reader(Row)
    Turns, Moves = field.Turns, field.Moves
    series_of, axes_at, advance_of = field.series_of, field.axes_at, field.advance_of
    turning_columns, moving_columns = field.turning_columns, field.moving_columns
    Three, ThreeToEnd = (wp.types.matrix((rows, 3), Real) for rows in (nodes, nodes + 1))
    TurnsAtNodes = wp.types.matrix((nodes, 3 * turning), Real)
    TurnsToEnd = wp.types.matrix((nodes + 1, 3 * turning), Real)
    MovesAtNodes = wp.types.matrix((nodes, Moves._length_), Real)
    All = wp.types.vector(3 * n, Real)
    AllAtNodes, AllToEnd = (wp.types.matrix((rows, 3 * n), Real) for rows in (nodes, nodes + 1))
    zero, half, one, two = (Real(x) for x in (0.0, 0.5, 1.0, 2.0))
    moving = n - turning
    Integrals = wp.types.matrix((nodes + 1, nodes), Real)
    first_row = tree.first_row[section]
    B = types.layout.bend_of(section).start
    DB = types.layout.bend_rate_of(section).start

    @wp.struct
    class Shape:
        """A; of each node: advance l R ε and normal R ẑ of the cross-section, the turning and moving
        columns, mass and inertias; to each node and the end: p, W and P. end: axes of the tip."""

        A: Integrals
        advance: Three
        normal: Three
        turns: TurnsAtNodes
        moves: MovesAtNodes
        bodies: Three
        p: ThreeToEnd
        W: TurnsToEnd
        P: AllToEnd
        end: mat33

    @wp.struct
    class Motion:
        """To each node and the end: w, v, α and a."""

        turned: ThreeToEnd
        moved: ThreeToEnd
        spun: ThreeToEnd
        sped: ThreeToEnd

    def integral(AtNodes: Any, ToEnd: Any, Sum: Any) -> Any:
        """Return the function that integrates values at the nodes to each node, and to the end."""

        @wp.func
        def integrated(A: Integrals, values: AtNodes):
            out = ToEnd()
            count = wp.int32(nodes)
            for i in range(count + 1):
                sum = Sum()
                for k in range(count):
                    sum += A[i, k] * values[k]
                out[i] = sum
            return out

        return integrated

    integrated_3 = integral(Three, ThreeToEnd, vec3)
    integrated_turns = integral(TurnsAtNodes, TurnsToEnd, Turns)
    integrated_all = integral(AllAtNodes, AllToEnd, All)

    @wp.func
    def coordinates_of(y: State, first: int):
        of_all = wp.int32(n)
        out = Coordinates()
        for c in range(of_all):
            out[c] = y[first + c]
        return out

    @wp.func
    def columns_of(W: TurnsToEnd, P: AllToEnd, advance: Three, moves: MovesAtNodes):
        """Return l (W × R ε + R ∂ε/∂q) at the nodes."""
        of_turning = wp.int32(turning)
        of_moving = wp.int32(moving)
        out = AllAtNodes()
        count = wp.int32(nodes)
        for i in range(count):
            t = vec3(advance[i, 0], advance[i, 1], advance[i, 2])
            for c in range(of_turning):
                u = wp.cross(vec3(W[i, 3 * c], W[i, 3 * c + 1], W[i, 3 * c + 2]), t)
                for j in range(3):
                    out[i, 3 * c + j] = u[j]
            for c in range(3 * of_moving):
                out[i, 3 * turning + c] = moves[i, c]
        return out

    @wp.func
    def shape(y: State, table: Table, vehicle: int):
        out = Shape()
        q = coordinates_of(y, B)
        series = series_of(q)
        base = wp.quat_inverse(axes_at(series, -one))
        places = row_of(table, vehicle, first_row + nodes + 1)
        masses = row_of(table, vehicle, first_row + nodes + 2)
        transverse = row_of(table, vehicle, first_row + nodes + 3)
        axial = row_of(table, vehicle, first_row + nodes + 4)
        length = row_of(table, vehicle, first_row + nodes + 5)[0]
        count = wp.int32(nodes)
        for i in range(count + 1):
            to = row_of(table, vehicle, first_row + i)
            for k in range(count):
                out.A[i, k] = to[k]
        for i in range(count):
            at = two * places[i] - one
            R = wp.quat_to_matrix(base * axes_at(series, at))
            x_axis = vec3(R[0, 0], R[1, 0], R[2, 0])
            y_axis = vec3(R[0, 1], R[1, 1], R[2, 1])
            z_axis = vec3(R[0, 2], R[1, 2], R[2, 2])
            out.advance[i] = length * advance_of(q, at, x_axis, y_axis, z_axis)
            out.normal[i] = z_axis
            out.turns[i] = turning_columns(at, x_axis, y_axis, z_axis)
            if wp.static(moving > 0):
                out.moves[i] = length * moving_columns(at, x_axis, y_axis, z_axis)
            out.bodies[i] = vec3(masses[i], transverse[i], axial[i])
        out.end = wp.quat_to_matrix(base * axes_at(series, one))
        out.p = integrated_3(out.A, out.advance)
        out.W = integrated_turns(out.A, out.turns)
        out.P = integrated_all(out.A, columns_of(out.W, out.P, out.advance, out.moves))
        return out

    @wp.func
    def motion(y: State, s: Shape):
        of_turning = wp.int32(turning)
        of_all = wp.int32(n)
        of_moving = wp.int32(moving)
        out = Motion()
        rates = coordinates_of(y, DB)
        count = wp.int32(nodes)
        for i in range(count + 1):
            for c in range(of_turning):
                for j in range(3):
                    out.turned[i, j] = out.turned[i, j] + rates[c] * s.W[i, 3 * c + j]
            for c in range(of_all):
                for j in range(3):
                    out.moved[i, j] = out.moved[i, j] + rates[c] * s.P[i, 3 * c + j]
        values = Three()
        for i in range(count):
            turn = vec3()
            for c in range(of_turning):
                turn += rates[c] * vec3(s.turns[i, 3 * c], s.turns[i, 3 * c + 1], s.turns[i, 3 * c + 2])
            w = vec3(out.turned[i, 0], out.turned[i, 1], out.turned[i, 2])
            values[i] = wp.cross(w, turn)
        out.spun = integrated_3(s.A, values)
        for i in range(count):
            t = vec3(s.advance[i, 0], s.advance[i, 1], s.advance[i, 2])
            w = vec3(out.turned[i, 0], out.turned[i, 1], out.turned[i, 2])
            u = wp.cross(w, t)
            if wp.static(moving > 0):
                for c in range(of_moving):
                    rate = two * rates[turning + c]
                    u += rate * vec3(s.moves[i, 3 * c], s.moves[i, 3 * c + 1], s.moves[i, 3 * c + 2])
            alpha = vec3(out.spun[i, 0], out.spun[i, 1], out.spun[i, 2])
            values[i] = wp.cross(alpha, t) + wp.cross(w, u)
        out.sped = integrated_3(s.A, values)
        return out

    @wp.func
    def element(plant: Plant, s: Shape, m: Motion):
        of_turning = wp.int32(turning)
        of_all = wp.int32(n)
        out = Element()
        count = wp.int32(nodes)
        trace = zero
        for i in range(count):
            mass = s.bodies[i, 0]
            transverse = s.bodies[i, 1]
            along = s.bodies[i, 2] - transverse
            p = vec3(s.p[i, 0], s.p[i, 1], s.p[i, 2])
            z = vec3(s.normal[i, 0], s.normal[i, 1], s.normal[i, 2])
            mp = mass * p
            out.H += mp
            out.I += along * wp.outer(z, z) - wp.outer(mp, p)
            trace += transverse + mp[0] * p[0] + mp[1] * p[1] + mp[2] * p[2]
            # Momentum and angular momentum of the slice about its centre, per rate.
            linear = All()
            spin = Turns()
            for c in range(of_all):
                for j in range(3):
                    linear[3 * c + j] = mass * s.P[i, 3 * c + j]
            for c in range(of_turning):
                w = vec3(s.W[i, 3 * c], s.W[i, 3 * c + 1], s.W[i, 3 * c + 2])
                u = transverse * w + (along * (w[0] * z[0] + w[1] * z[1] + w[2] * z[2])) * z
                for j in range(3):
                    spin[3 * c + j] = u[j]
            for c in range(of_all):
                on = vec3(linear[3 * c], linear[3 * c + 1], linear[3 * c + 2])
                about = wp.cross(p, on)
                for j in range(3):
                    out.F[j, c] = out.F[j, c] + on[j]
                    out.L[j, c] = out.L[j, c] + about[j]
                for d in range(c + 1):
                    shared = s.P[i, 3 * d] * on[0] + s.P[i, 3 * d + 1] * on[1]
                    out.N[d, c] = out.N[d, c] + (shared + s.P[i, 3 * d + 2] * on[2])
            for c in range(of_turning):
                for j in range(3):
                    out.L[j, c] = out.L[j, c] + spin[3 * c + j]
                for d in range(c + 1):
                    shared = s.W[i, 3 * d] * spin[3 * c] + s.W[i, 3 * d + 1] * spin[3 * c + 1]
                    out.N[d, c] = out.N[d, c] + (shared + s.W[i, 3 * d + 2] * spin[3 * c + 2])
        for j in range(3):
            out.I[j, j] = out.I[j, j] + trace
        for c in range(of_all):
            for d in range(c):
                out.N[c, d] = out.N[d, c]
        return out

    @wp.func
    def bias_of(s: Shape, m: Motion, w: vec3, v: vec3, share: Real):
        """Return B((w, q̇), (v, share q̇)) for a share of 0 or 1."""
        of_turning = wp.int32(turning)
        of_all = wp.int32(n)
        out = Bias()
        count = wp.int32(nodes)
        across = v + share * w
        for i in range(count):
            mass = s.bodies[i, 0]
            transverse = s.bodies[i, 1]
            along = s.bodies[i, 2] - transverse
            p = vec3(s.p[i, 0], s.p[i, 1], s.p[i, 2])
            z = vec3(s.normal[i, 0], s.normal[i, 1], s.normal[i, 2])
            turned = vec3(m.turned[i, 0], m.turned[i, 1], m.turned[i, 2])
            moved = vec3(m.moved[i, 0], m.moved[i, 1], m.moved[i, 2])
            a = share * vec3(m.sped[i, 0], m.sped[i, 1], m.sped[i, 2])
            a += wp.cross(across, moved)
            a += half * (wp.cross(w, wp.cross(v, p)) + wp.cross(v, wp.cross(w, p)))
            alpha = share * vec3(m.spun[i, 0], m.spun[i, 1], m.spun[i, 2])
            alpha += half * wp.cross(across, turned)
            one_spin = w + turned
            other_spin = v + share * turned
            one_axial = one_spin[0] * z[0] + one_spin[1] * z[1] + one_spin[2] * z[2]
            other_axial = other_spin[0] * z[0] + other_spin[1] * z[1] + other_spin[2] * z[2]
            # Half of s×I s' + s'×I s, whose transverse parts cancel.
            gyro = wp.cross(one_spin, other_axial * z) + wp.cross(other_spin, one_axial * z)
            alpha_axial = alpha[0] * z[0] + alpha[1] * z[1] + alpha[2] * z[2]
            force = mass * a
            moment = transverse * alpha + along * (alpha_axial * z + half * gyro)
            out.force += force
            out.moment += wp.cross(p, force) + moment
            for c in range(of_all):
                on = s.P[i, 3 * c] * force[0] + s.P[i, 3 * c + 1] * force[1]
                on += s.P[i, 3 * c + 2] * force[2]
                out.coordinates[c] = out.coordinates[c] + on
            for c in range(of_turning):
                on = s.W[i, 3 * c] * moment[0] + s.W[i, 3 * c + 1] * moment[1]
                on += s.W[i, 3 * c + 2] * moment[2]
                out.coordinates[c] = out.coordinates[c] + on
        return out

    @wp.func
    def full_bias(s: Shape, e: Element, m: Motion, w: vec3):
        return bias_of(s, m, w, w, one)

    @wp.func
    def turning_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        return bias_of(s, m, w, v, zero)

    @wp.func
    def bending_bias(s: Shape, e: Element, m: Motion, w: vec3, v: vec3):
        return bias_of(s, m, w, v, one)

    @wp.func
    def first_bending(s: Shape, e: Element, m: Motion, w: vec3):
        return bias_of(s, m, w, vec3(), one)

    @wp.func
    def own_bending(s: Shape, m: Motion):
        return bias_of(s, m, vec3(), vec3(), one).coordinates

    @wp.func
    def joint(plant: Plant, s: Shape, m: Motion):
        of_turning = wp.int32(turning)
        of_all = wp.int32(n)
        out = Joint()
        end = wp.int32(nodes)
        out.p = vec3(s.p[end, 0], s.p[end, 1], s.p[end, 2])
        out.R = s.end
        for c in range(of_all):
            for j in range(3):
                out.P[j, c] = s.P[end, 3 * c + j]
        for c in range(of_turning):
            for j in range(3):
                out.W[j, c] = s.W[end, 3 * c + j]
        out.moved = vec3(m.moved[end, 0], m.moved[end, 1], m.moved[end, 2])
        out.turned = vec3(m.turned[end, 0], m.turned[end, 1], m.turned[end, 2])
        return out

    @wp.func
    def carried(plant: Plant, s: Shape, m: Motion):
        out = Carried()
        end = wp.int32(nodes)
        out.base = vec3(m.sped[end, 0], m.sped[end, 1], m.sped[end, 2])
        out.spin = vec3(m.spun[end, 0], m.spun[end, 1], m.spun[end, 2])
        return out

    return holding(ElementCode, locals())
