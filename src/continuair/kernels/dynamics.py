"""Device code of the three models: the rate of the state of an aerial continuum manipulator."""

from functools import cache
from types import SimpleNamespace

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.forces.inputs import load_code


@cache
def device_code(precision: str, sections: int, model: str) -> SimpleNamespace:
    """Warp types and functions for one precision, number of sections and model."""
    coupled, independent = model == "coupled", model == "independent"
    section = section_code(precision, sections)
    loads = load_code(section, independent)
    Real, Row, State, Plant = section.Real, section.Row, section.State, section.Plant
    Shape, Push, vec2, vec3 = section.Shape, section.Push, section.vec2, section.vec3
    Frozen, Load, load_of = loads.Frozen, loads.Load, loads.load_of
    shape, attitude_of, bend_force = section.shape, section.attitude_of, section.bend_force
    inertia_of, moment_of_arm = section.inertia_of, section.moment_of_arm
    momentum_of_bending, own_bending = section.momentum_of_bending, section.own_bending
    exchange_on_rotation, centrifugal = section.exchange_on_rotation, section.centrifugal
    solve_bending, solve_symmetric = section.solve_bending, section.solve_symmetric
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)

    @wp.func
    def coupled_accelerations(
        y: State,
        plant: Plant,
        s: Shape,
        load: Load,
        b: vec2,
        db: vec2,
        w: vec3,
        hd: vec3,
        du: Real,
        ddu: Real,
    ):
        """(a_o - g in body axes, ω̇, b̈) of the full system; gravity cancels from ω̇ and b̈."""
        e = plant.lever
        u = wp.dot(b, b)
        inertia = inertia_of(s, plant, b)
        c = plant.arm_mass * plant.mount + moment_of_arm(s, b)
        hb = momentum_of_bending(s, e, b, db, hd, du)
        up = s.d[1] * ddu + s.dd_beta * du * du
        out = s.d[0] * ddu + s.dd_alpha * du * du
        hdd = vec3(
            two * s.d[0] * du * db[0] + out * b[0], two * s.d[0] * du * db[1] + out * b[1], -up
        )
        turn = (s.d[6] + s.f[7]) * du
        twist = s.d[7] * du * du + s.f[7] * ddu
        own = vec3(
            turn * db[1] + twist * b[1],
            -turn * db[0] - twist * b[0],
            s.d[5] * du * (b[0] * db[1] - b[1] * db[0]),
        ) + wp.cross(e, hdd)
        bias = wp.cross(w, inertia * w + hb) + own
        bias += exchange_on_rotation(s, e, b, db, w, hd, du)
        rhs_w = load.moment - wp.cross(c, load.force) / plant.mass - bias
        rate = two * (
            (s.d[6] - s.f[7]) * (b[0] * w[0] + b[1] * w[1]) + (s.f[5] + u * s.d[5]) * w[2]
        )
        rhs_b = (
            load.bend
            - plant.stiffness * b
            - plant.damping * db
            - bend_force(s.f[0], s.d[0], s.d[1], b, load.force) / plant.mass
            - own_bending(s, b, db, du, ddu)
            - rate * vec2(-db[1], db[0])
            - centrifugal(s, e, b, u, w)
        )
        # Columns of J, the coupling of rotation and bending.
        g00 = s.f[6] + two * s.f[7] * b[0] * b[0]
        g01 = two * s.f[7] * b[0] * b[1]
        g11 = s.f[6] + two * s.f[7] * b[1] * b[1]
        ca = two * s.d[0]
        cb = -two * s.d[1]
        jc0 = vec3(s.f[0] + ca * b[0] * b[0], ca * b[0] * b[1], cb * b[0])
        jc1 = vec3(ca * b[0] * b[1], s.f[0] + ca * b[1] * b[1], cb * b[1])
        j0 = vec3(g01, -g00, -s.f[5] * b[1]) + wp.cross(e, jc0)
        j1 = vec3(g11, -g01, s.f[5] * b[0]) + wp.cross(e, jc1)
        # Schur complement on the rotation.
        n = one / s.f[8]
        k = n * s.f[9] / (s.f[8] + u * s.f[9])
        jb = b[0] * j0 + b[1] * j1
        y0 = n * j0 - (k * b[0]) * jb
        y1 = n * j1 - (k * b[1]) * jb
        schur = inertia - wp.outer(y0, j0) - wp.outer(y1, j1)
        dw = solve_symmetric(schur, rhs_w - rhs_b[0] * y0 - rhs_b[1] * y1)
        ddb = solve_bending(s, b, u, rhs_b - vec2(wp.dot(j0, dw), wp.dot(j1, dw)))
        moved = wp.cross(dw, c) + wp.cross(w, wp.cross(w, c) + two * hd) + hdd
        moved += ddb[0] * jc0 + ddb[1] * jc1
        return (load.force - moved) / plant.mass, dw, ddb

    @wp.func
    def decoupled_accelerations(
        y: State,
        plant: Plant,
        s: Shape,
        load: Load,
        b: vec2,
        db: vec2,
        w: vec3,
        hd: vec3,
        du: Real,
        ddu: Real,
        gravity: Real,
    ):
        """The same with the UAV-arm blocks of M and C zeroed: own terms and half the exchange."""
        e = plant.lever
        u = wp.dot(b, b)
        alpha = s.f[0]
        inertia = inertia_of(s, plant, b)
        c = plant.arm_mass * plant.mount + moment_of_arm(s, b)
        hb = momentum_of_bending(s, e, b, db, hd, du)
        exchange = exchange_on_rotation(s, e, b, db, w, hd, du) + wp.cross(w, hb)
        bias = wp.cross(w, inertia * w) + half * exchange
        dw = solve_symmetric(inertia, load.moment - wp.cross(c, load.force) / plant.mass - bias)
        moved = wp.cross(dw, c) + wp.cross(w, wp.cross(w, c) + hd)
        # About the arm's own base, K differ from those about the common centre of mass.
        across = s.d[6] - s.f[7] + two * alpha * s.d[1] / plant.mass
        about = s.f[5] + u * s.d[5] + alpha * (alpha + two * u * s.d[0]) / plant.mass
        rate = across * (b[0] * w[0] + b[1] * w[1]) + about * w[2]
        weight = wp.quat_rotate_inv(attitude_of(y), vec3(zero, zero, -gravity))
        rhs_b = (
            load.bend
            - plant.stiffness * b
            - plant.damping * db
            + bend_force(alpha, s.d[0], s.d[1], b, weight)
            - own_bending(s, b, db, du, ddu)
            - rate * vec2(-db[1], db[0])
        )
        return (load.force - moved) / plant.mass, dw, solve_bending(s, b, u, rhs_b)

    @wp.func
    def independent_accelerations(
        y: State,
        plant: Plant,
        frozen: Frozen,
        s: Shape,
        load: Load,
        b: vec2,
        db: vec2,
        w: vec3,
        du: Real,
        ddu: Real,
        gravity: Real,
    ):
        """A rigid vehicle with frozen payload, and the arm on a base fixed as it starts."""
        c = frozen.moment
        bias = wp.cross(w, frozen.inertia * w)
        dw = frozen.inverse * (load.moment - wp.cross(c, load.force) / plant.mass - bias)
        moved = wp.cross(dw, c) + wp.cross(w, wp.cross(w, c))
        weight = wp.quat_rotate_inv(frozen.attitude, vec3(zero, zero, -gravity))
        rhs_b = (
            load.bend
            - plant.stiffness * b
            - plant.damping * db
            + bend_force(s.f[0], s.d[0], s.d[1], b, weight)
            - own_bending(s, b, db, du, ddu)
        )
        return ((load.force - moved) / plant.mass, dw, solve_bending(s, b, wp.dot(b, b), rhs_b))

    @wp.func
    def rate_of(
        y: State,
        branch: vec2,
        plant: Plant,
        frozen: Frozen,
        coefficients: wp.array2d(dtype=Row),
        vehicle: int,
        inputs: wp.array3d(dtype=Real),
        row: int,
        run: int,
        groups: int,
        command: Push,
        gravity: Real,
    ):
        """dy/dt."""
        b = vec2(y[7], y[8])
        db = vec2(y[15], y[16])
        w = vec3(y[12], y[13], y[14])
        du = two * wp.dot(b, db)
        ddu = two * wp.dot(db, db)
        s = shape(coefficients, vehicle, wp.dot(b, b))
        load = load_of(y, b, branch, plant, frozen, inputs, row, run, groups, command)
        lift = s.d[0] * du
        hd = vec3(s.f[0] * db[0] + lift * b[0], s.f[0] * db[1] + lift * b[1], -s.d[1] * du)
        if wp.static(coupled):
            a, dw, ddb = coupled_accelerations(y, plant, s, load, b, db, w, hd, du, ddu)
        elif wp.static(independent):
            a, dw, ddb = independent_accelerations(
                y, plant, frozen, s, load, b, db, w, du, ddu, gravity
            )
        else:
            a, dw, ddb = decoupled_accelerations(y, plant, s, load, b, db, w, hd, du, ddu, gravity)
        v = wp.quat_rotate(attitude_of(y), a)
        return State(
            y[9],
            y[10],
            y[11],
            half * (y[6] * w[0] + y[4] * w[2] - y[5] * w[1]),
            half * (y[6] * w[1] + y[5] * w[0] - y[3] * w[2]),
            half * (y[6] * w[2] + y[3] * w[1] - y[4] * w[0]),
            -half * (y[3] * w[0] + y[4] * w[1] + y[5] * w[2]),
            db[0],
            db[1],
            v[0],
            v[1],
            v[2] - gravity,
            dw[0],
            dw[1],
            dw[2],
            ddb[0],
            ddb[1],
        )

    return SimpleNamespace(**vars(section), **vars(loads), model=model, rate_of=rate_of)
