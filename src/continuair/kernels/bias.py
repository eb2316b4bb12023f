"""Device code of what is quadratic in the rates: in full, and without what UAV and arm exchange."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.types import MOMENTS, device_types, holding


@dataclass(frozen=True)
class BiasCode:
    """Motion, what follows from a state, and the Bias of the rows of kernels/dynamics.py."""

    Motion: Any
    motion_of: Any
    about_base: Any
    full_bias: Any
    block_bias: Any


@cache
def bias_code(precision: str, sections: int) -> BiasCode:
    """The functions for one precision and number of sections."""
    types, section = device_types(precision, sections), section_code(precision, sections)
    Real, State, Plant, Shape = types.Real, types.State, types.Plant, section.Shape
    vec2, vec3, mat33 = types.vec2, types.vec3, types.mat33
    bend_of, bend_rate_of, spin_of = types.bend_of, types.bend_rate_of, types.spin_of
    inertia_of, moment_of_arm = section.inertia_of, section.moment_of_arm
    momentum_of_bending, own_bending = section.momentum_of_bending, section.own_bending
    exchange_on_rotation, centrifugal = section.exchange_on_rotation, section.centrifugal
    alpha, beta, P, Q, S, KP, KQ, KW, NP, ND = range(len(MOMENTS))
    half, two, four = Real(0.5), Real(2.0), Real(4.0)

    @wp.struct
    class Motion:
        """Bend and its rate, ω, u = |b|² with u̇ and ü at b̈ = 0; the first moment c of the arm on
        its mount and hd, its rate in the body; inertia and hb about the common centre of mass."""

        b: vec2
        db: vec2
        w: vec3
        u: Real
        du: Real
        ddu: Real
        c: vec3
        hd: vec3
        hb: vec3
        inertia: mat33

    @wp.struct
    class Bias:
        """What the rates take from force, moment and bend of the rows."""

        force: vec3
        moment: vec3
        bend: vec2

    @wp.func
    def motion_of(y: State, s: Shape, plant: Plant):
        out = Motion()
        b = bend_of(y)
        db = bend_rate_of(y)
        out.b = b
        out.db = db
        out.w = spin_of(y)
        out.u = wp.dot(b, b)
        out.du = two * wp.dot(b, db)
        out.ddu = two * wp.dot(db, db)
        lift = s.d[alpha] * out.du
        out.c = plant.arm_mass * plant.mount + moment_of_arm(s, b)
        out.hd = vec3(
            s.f[alpha] * db[0] + lift * b[0], s.f[alpha] * db[1] + lift * b[1], -s.d[beta] * out.du
        )
        out.hb = momentum_of_bending(s, plant.lever, b, db, out.hd, out.du)
        out.inertia = inertia_of(s, plant, b)
        return out

    @wp.func
    def about_base(s: Shape, plant: Plant, m: Motion):
        """The shape with N₀ = N + J_cᵀ J_c/m, of bending about the arm's own base, for N."""
        a, da, dda = s.f[alpha], s.d[alpha], s.dd_alpha
        db, ddb = s.d[beta], s.dd_beta
        square = a * da + m.u * da * da + db * db
        slope = two * da * da + a * dda + two * (m.u * da * dda + db * ddb)
        out = Shape()
        out.f = s.f
        out.d = s.d
        out.dd_alpha = s.dd_alpha
        out.dd_beta = s.dd_beta
        out.f[NP] = s.f[NP] + a * a / plant.mass
        out.d[NP] = s.d[NP] + two * a * da / plant.mass
        out.f[ND] = s.f[ND] + four * square / plant.mass
        out.d[ND] = s.d[ND] + four * slope / plant.mass
        return out

    @wp.func
    def full_bias(s: Shape, plant: Plant, m: Motion):
        """Of the coupled model."""
        b, db, w, hd, e = m.b, m.db, m.w, m.hd, plant.lever
        up = s.d[beta] * m.ddu + s.dd_beta * m.du * m.du
        out = s.d[alpha] * m.ddu + s.dd_alpha * m.du * m.du
        hdd = vec3(
            two * s.d[alpha] * m.du * db[0] + out * b[0],
            two * s.d[alpha] * m.du * db[1] + out * b[1],
            -up,
        )
        turn = (s.d[KQ] + s.f[KW]) * m.du
        twist = s.d[KW] * m.du * m.du + s.f[KW] * m.ddu
        own = vec3(
            turn * db[1] + twist * b[1],
            -turn * db[0] - twist * b[0],
            s.d[KP] * m.du * (b[0] * db[1] - b[1] * db[0]),
        ) + wp.cross(e, hdd)
        rate = two * (
            (s.d[KQ] - s.f[KW]) * (b[0] * w[0] + b[1] * w[1]) + (s.f[KP] + m.u * s.d[KP]) * w[2]
        )
        found = Bias()
        found.force = wp.cross(w, wp.cross(w, m.c) + two * hd) + hdd
        found.moment = wp.cross(w, m.inertia * w + m.hb) + own
        found.moment += exchange_on_rotation(s, e, b, db, w, hd, m.du)
        found.bend = own_bending(s, b, db, m.du, m.ddu) + rate * vec2(-db[1], db[0])
        found.bend += centrifugal(s, e, b, m.u, w)
        return found

    @wp.func
    def block_bias(s: Shape, plant: Plant, m: Motion):
        """With the UAV-arm blocks of C zeroed: own terms, and half of what is exchanged.

        s: with the inertia of bending about the arm's own base.
        """
        b, db, w, hd, e = m.b, m.db, m.w, m.hd, plant.lever
        exchange = exchange_on_rotation(s, e, b, db, w, hd, m.du) + wp.cross(w, m.hb)
        # About the arm's own base, K differ from those about the common centre of mass.
        a, da = s.f[alpha], s.d[alpha]
        across = s.d[KQ] - s.f[KW] + two * a * s.d[beta] / plant.mass
        about = s.f[KP] + m.u * s.d[KP] + a * (a + two * m.u * da) / plant.mass
        rate = across * (b[0] * w[0] + b[1] * w[1]) + about * w[2]
        found = Bias()
        found.force = wp.cross(w, wp.cross(w, m.c) + hd)
        found.moment = wp.cross(w, m.inertia * w) + half * exchange
        found.bend = own_bending(s, b, db, m.du, m.ddu) + rate * vec2(-db[1], db[0])
        return found

    return holding(BiasCode, locals())
